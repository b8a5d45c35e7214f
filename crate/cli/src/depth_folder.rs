//! A folder of depth maps: 16-bit grey PNG in millimetres, 0 where nothing is known, one file a keyframe and kind.

use crate::failure::Failure;
use scan::Scan;
use std::{
    fs::{self, File},
    io::{BufReader, BufWriter},
    path::{Path, PathBuf},
};
use stereo::DepthMap;

/// Which of a keyframe's two maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What may be relied on.
    Filtered,
    /// Every pixel's best guess.
    Raw,
}

impl Kind {
    fn ending(self) -> &'static str {
        match self {
            Self::Filtered => "depth",
            Self::Raw => "raw",
        }
    }
}

/// The folder, and what its files are called.
pub struct DepthFolder {
    folder: PathBuf,
    /// The name of each frame of the scan.
    names: Vec<String>,
}

impl DepthFolder {
    /// Makes the folder unless it is there.
    pub fn create(folder: &Path, scan: &Scan) -> Result<Self, Failure> {
        let made = fs::create_dir_all(folder);
        made.map_err(|error| Failure::file("write", folder, error))?;
        Self::of(folder, scan)
    }

    /// A folder that is there.
    pub fn of(folder: &Path, scan: &Scan) -> Result<Self, Failure> {
        fs::read_dir(folder).map_err(|error| Failure::file("read", folder, error))?;
        let names = scan.frames().iter();
        Ok(Self {
            folder: folder.to_owned(),
            names: names
                .map(|frame| frame.name.replace(['/', '\\'], "_"))
                .collect(),
        })
    }

    /// That no file in it belongs to a frame with the sensor's depth.
    pub fn nothing_to_compare(&self, scan: &Scan) -> Failure {
        Failure::NoDepthMaps {
            folder: self.folder.clone(),
            name: scan.name().to_owned(),
            measured: scan.frames().iter().filter(|f| f.depth.is_some()).count(),
        }
    }

    fn path(&self, frame: usize, kind: Kind) -> PathBuf {
        let file = format!("{}.{}.png", self.names[frame], kind.ending());
        self.folder.join(file)
    }

    /// Writes both maps of a keyframe.
    pub fn write(&self, map: &DepthMap) -> Result<(), Failure> {
        for (kind, depth_m) in [
            (Kind::Filtered, &map.depth_m),
            (Kind::Raw, &map.raw_depth_m),
        ] {
            let path = self.path(map.frame, kind);
            let file = File::create(&path).map_err(|error| Failure::file("write", &path, error))?;
            let size = (map.camera.width, map.camera.height);
            write_png(file, size, depth_m).map_err(|error| Failure::Png {
                path,
                error: error.to_string(),
            })?;
        }
        Ok(())
    }

    /// Width, height and metres of a frame's map; `None` where there is no such file.
    pub fn read(&self, frame: usize, kind: Kind) -> Result<Option<Picture>, Failure> {
        let path = self.path(frame, kind);
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Failure::file("read", &path, error)),
        };
        match read_png(file) {
            Ok(picture) => Ok(Some(picture)),
            Err(error) => Err(Failure::Png { path, error }),
        }
    }
}

/// A depth map out of a file.
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Metres, row by row, 0 where nothing is known.
    pub depth_m: Vec<f32>,
}

/// Depth that does not fit into 16 bits, beyond 65 m, becomes unknown.
fn write_png(
    file: File,
    (width, height): (u32, u32),
    depth_m: &[f32],
) -> Result<(), png::EncodingError> {
    let millimetres = depth_m.iter().map(|z| (z * 1000.0).round());
    let stored = millimetres.map(|mm| if mm < 65535.0 { mm as u16 } else { 0 });
    let bytes: Vec<u8> = stored.flat_map(u16::to_be_bytes).collect();
    let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()
}

fn read_png(file: File) -> Result<Picture, String> {
    let words = |error: png::DecodingError| format!("found {error}");
    let decoder = png::Decoder::new(BufReader::new(file));
    let mut reader = decoder.read_info().map_err(words)?;
    let (width, height) = reader.info().size();
    let found = reader.output_color_type();
    if found != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err(format!("found {:?} with {} bits", found.0, found.1 as u8));
    }
    let length = reader.output_buffer_size();
    let mut bytes = vec![0; length.ok_or("found a picture too large for memory")?];
    reader.next_frame(&mut bytes).map_err(words)?;
    let stored = bytes.chunks_exact(2);
    Ok(Picture {
        width,
        height,
        depth_m: stored
            .map(|pair| f32::from(u16::from_be_bytes([pair[0], pair[1]])) / 1000.0)
            .collect(),
    })
}
