//! A small zip writer, to make archives no ordinary program would make.

use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// One file of an archive.
pub struct Member<'a> {
    pub name: &'a str,
    pub content: &'a [u8],
    pub deflate: bool,
    /// Bit 0 marks encryption.
    pub flags: u16,
}

impl<'a> Member<'a> {
    pub fn deflated(name: &'a str, content: &'a [u8]) -> Self {
        Member {
            name,
            content,
            deflate: true,
            flags: 0,
        }
    }
}

/// Writes an archive as PKWARE's APPNOTE describes it.
pub fn write(members: &[Member<'_>]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut directory = Vec::new();
    for member in members {
        let packed = if member.deflate {
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(member.content).unwrap();
            encoder.finish().unwrap()
        } else {
            member.content.to_vec()
        };
        let offset = file.len() as u32;
        let mut common = Vec::new();
        common.extend(20_u16.to_le_bytes());
        common.extend(member.flags.to_le_bytes());
        common.extend(if member.deflate { 8_u16 } else { 0 }.to_le_bytes());
        common.extend([0; 4]);
        common.extend(crc32fast::hash(member.content).to_le_bytes());
        common.extend((packed.len() as u32).to_le_bytes());
        common.extend((member.content.len() as u32).to_le_bytes());
        common.extend((member.name.len() as u16).to_le_bytes());
        common.extend(0_u16.to_le_bytes());

        file.extend(b"PK\x03\x04");
        file.extend(&common);
        file.extend(member.name.as_bytes());
        file.extend(&packed);

        directory.extend(b"PK\x01\x02");
        directory.extend(20_u16.to_le_bytes());
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(member.name.as_bytes());
    }
    let offset = file.len() as u32;
    file.extend(&directory);
    file.extend(b"PK\x05\x06");
    file.extend([0; 4]);
    file.extend((members.len() as u16).to_le_bytes());
    file.extend((members.len() as u16).to_le_bytes());
    file.extend((directory.len() as u32).to_le_bytes());
    file.extend(offset.to_le_bytes());
    file.extend(0_u16.to_le_bytes());
    file
}
