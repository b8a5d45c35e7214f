//! The header of a PLY file: which numbers follow, in which order and in which types.

use super::PlyError;

/// How the body is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The number types of the format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in a binary body.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// What a user calls it.
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::F32 | Self::F64 => "a number",
            _ => "a whole number",
        }
    }
}

/// One property: a number, or a list with its length in front.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) length: Option<Scalar>,
    pub(super) value: Scalar,
}

/// One element kind and how often it comes.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Row numbers; none when a row holds nothing, so that a false count costs no time.
    pub(super) fn rows(&self) -> std::ops::Range<u64> {
        if self.properties.is_empty() {
            return 0..0;
        }
        0..self.count
    }
}

/// The header, and where the body starts.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) lines: usize,
    pub(super) bytes: usize,
}

pub(super) fn parse(data: &[u8]) -> Result<Header, PlyError> {
    let mut lines = Lines { data, at: 0 };
    match lines.next() {
        Some("ply") => (),
        _ => {
            let start = String::from_utf8_lossy(&data[..data.len().min(12)]);
            return Err(PlyError::NotPly {
                found: format!("{start:?}"),
            });
        }
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut line = 1;
    while let Some(text) = lines.next() {
        line += 1;
        let wrong = |expected| PlyError::Header {
            line,
            expected,
            found: text.chars().take(80).collect(),
        };
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["comment" | "obj_info", ..] => (),
            ["format", name, _version] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => {
                        return Err(wrong(
                            "ascii, binary_little_endian or binary_big_endian after \"format\"",
                        ));
                    }
                });
            }
            ["element", name, count] => elements.push(Element {
                name: name.to_owned(),
                count: count
                    .parse()
                    .map_err(|_| wrong("\"element\", a name and a count"))?,
                properties: Vec::new(),
            }),
            ["property", .., name] => {
                let (length, value) = match words[1..words.len() - 1] {
                    [value] => (None, Scalar::named(value)),
                    ["list", length, value] => (Scalar::named(length), Scalar::named(value)),
                    _ => (None, None),
                };
                let is_list = words[1] == "list";
                let element = elements.last_mut();
                let element =
                    element.ok_or_else(|| wrong("an \"element\" before its properties"))?;
                let Some(value) = value.filter(|_| is_list == length.is_some()) else {
                    return Err(wrong("number types and a name after \"property\""));
                };
                element.properties.push(Property {
                    name: name.to_owned(),
                    length,
                    value,
                });
            }
            ["end_header"] => {
                let encoding =
                    encoding.ok_or_else(|| wrong("a \"format\" line before \"end_header\""))?;
                return Ok(Header {
                    encoding,
                    elements,
                    lines: line,
                    bytes: lines.at,
                });
            }
            _ => {
                return Err(wrong(
                    "format, comment, element, property or end_header, with its words",
                ));
            }
        }
    }
    Err(PlyError::Header {
        line: line + 1,
        expected: "\"end_header\"",
        found: "end of file".to_owned(),
    })
}

/// Header lines, ended by LF, CR LF or the file's end.
struct Lines<'a> {
    data: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    /// The next line; `None` at the end or where the bytes are no text.
    fn next(&mut self) -> Option<&'a str> {
        let rest = self.data.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|&byte| byte == b'\n');
        let end = end.unwrap_or(rest.len());
        self.at += end + 1;
        let line = std::str::from_utf8(&rest[..end]).ok()?;
        Some(line.trim())
    }
}
