//! Pictures out of bytes. Colour is JPEG or PNG, depth is 16-bit grey PNG; which of them is told by the bytes, not
//! by the file's name. A picture that is cut short is an error, never a half-grey picture.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Bytes that hold the size of almost every picture; JPEGs with large previews need the whole file.
pub(crate) const HEAD_LEN: usize = 64 * 1024;

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
const MAX_SIDE: u32 = 16_384;
const MAX_PIXELS: u64 = 100_000_000;

/// A colour picture, 8 bits a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue of each pixel, row by row from the top left: `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

/// A depth picture: distance along the optical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Metres of each pixel, row by row from the top left; 0 where nothing was measured.
    pub depth_m: Vec<f32>,
}

/// How a format stores depth in 16 bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DepthCode {
    /// Stored units in a metre.
    pub units_per_m: f32,
    /// A stored value that, beside 0, means "no measurement".
    pub invalid: Option<u16>,
}

impl DepthCode {
    /// Whole millimetres, and the largest number where nothing was measured.
    pub(crate) const MILLIMETRES: Self = Self {
        units_per_m: 1000.0,
        invalid: Some(u16::MAX),
    };
}

/// Why bytes are not the picture that was expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DecodeFault {
    pub expected: &'static str,
    pub found: String,
}

const COLOR: &str = "a complete JPEG or 8-bit PNG picture";
const DEPTH: &str = "a complete 16-bit grey PNG picture";

fn fault(expected: &'static str, found: impl Into<String>) -> DecodeFault {
    DecodeFault {
        expected,
        found: found.into(),
    }
}

/// Width and height from the first bytes of a JPEG or PNG; `None` when they are not there.
pub(crate) fn size(head: &[u8]) -> Option<(u32, u32)> {
    if head.starts_with(PNG_SIGNATURE) {
        let word = |at: usize| Some(u32::from_be_bytes(head.get(at..at + 4)?.try_into().ok()?));
        return Some((word(16)?, word(20)?));
    }
    let (frame, _) = jpeg_segment(head, |marker| {
        matches!(marker, 0xC0..=0xCF) && !matches!(marker, 0xC4 | 0xC8 | 0xCC)
    })?;
    let half = |at: usize| {
        Some(u32::from(u16::from_be_bytes(
            head.get(at..at + 2)?.try_into().ok()?,
        )))
    };
    Some((half(frame + 5)?, half(frame + 3)?))
}

/// Finds a JPEG segment by its marker: where its length field starts, and where the next segment starts.
fn jpeg_segment(bytes: &[u8], wanted: impl Fn(u8) -> bool) -> Option<(usize, usize)> {
    if !bytes.starts_with(&[0xFF, 0xD8]) {
        return None;
    }
    let mut at = 2;
    loop {
        while *bytes.get(at)? == 0xFF && *bytes.get(at + 1)? == 0xFF {
            at += 1;
        }
        if *bytes.get(at)? != 0xFF {
            return None;
        }
        let marker = *bytes.get(at + 1)?;
        let length = usize::from(u16::from_be_bytes(
            bytes.get(at + 2..at + 4)?.try_into().ok()?,
        ));
        let next = at + 2 + length;
        if wanted(marker) {
            return Some((at + 2, next));
        }
        at = next;
    }
}

/// Decodes a colour picture.
pub(crate) fn decode_color(bytes: &[u8]) -> Result<ColorImage, DecodeFault> {
    if bytes.starts_with(PNG_SIGNATURE) {
        decode_color_png(bytes)
    } else if bytes.starts_with(&[0xFF, 0xD8]) {
        decode_color_jpeg(bytes)
    } else {
        Err(fault(COLOR, unknown(bytes)))
    }
}

fn unknown(bytes: &[u8]) -> String {
    match bytes.len() {
        0 => "an empty file".to_owned(),
        length => format!("{length} bytes that are neither JPEG nor PNG"),
    }
}

fn decode_color_jpeg(bytes: &[u8]) -> Result<ColorImage, DecodeFault> {
    // Decoders fill what is missing at the end with grey; the end marker tells a whole file from a cut one.
    let scan_data = jpeg_segment(bytes, |marker| marker == 0xDA).map(|(_, next)| next);
    let whole = scan_data
        .and_then(|start| bytes.get(start..))
        .is_some_and(|data| data.windows(2).any(|pair| pair == [0xFF, 0xD9]));
    if !whole {
        return Err(fault(
            COLOR,
            format!("a JPEG cut short after {} bytes", bytes.len()),
        ));
    }
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let broken = |error: &dyn std::fmt::Display| fault(COLOR, format!("a broken JPEG ({error})"));
    let rgb = decoder.decode().map_err(|error| broken(&error))?;
    let (width, height) = decoder
        .dimensions()
        .ok_or_else(|| broken(&"no picture size"))?;
    if rgb.len() != 3 * width * height {
        return Err(fault(COLOR, "a JPEG that is neither grey nor YCbCr or RGB"));
    }
    Ok(ColorImage {
        width: width as u32,
        height: height as u32,
        rgb,
    })
}

fn png_reader<'b>(
    bytes: &'b [u8],
    transformations: png::Transformations,
    expected: &'static str,
) -> Result<png::Reader<Cursor<&'b [u8]>>, DecodeFault> {
    let limits = png::Limits {
        bytes: usize::MAX / 2,
    };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(transformations);
    let reader = decoder
        .read_info()
        .map_err(|error| png_fault(expected, bytes, &error))?;
    let info = reader.info();
    let pixels = u64::from(info.width) * u64::from(info.height);
    if info.width > MAX_SIDE || info.height > MAX_SIDE || pixels > MAX_PIXELS {
        return Err(fault(
            expected,
            format!("{}x{} pixels, too many", info.width, info.height),
        ));
    }
    Ok(reader)
}

fn png_fault(expected: &'static str, bytes: &[u8], error: &png::DecodingError) -> DecodeFault {
    match error {
        png::DecodingError::IoError(_) => fault(
            expected,
            format!("a PNG cut short after {} bytes", bytes.len()),
        ),
        other => fault(expected, format!("a broken PNG ({other})")),
    }
}

fn png_pixels(
    mut reader: png::Reader<Cursor<&[u8]>>,
    bytes: &[u8],
    expected: &'static str,
) -> Result<Vec<u8>, DecodeFault> {
    let length = reader
        .output_buffer_size()
        .ok_or_else(|| fault(expected, "a PNG too large for memory"))?;
    let mut pixels = vec![0; length];
    reader
        .next_frame(&mut pixels)
        .map_err(|error| png_fault(expected, bytes, &error))?;
    Ok(pixels)
}

fn decode_color_png(bytes: &[u8]) -> Result<ColorImage, DecodeFault> {
    let reader = png_reader(bytes, png::Transformations::normalize_to_color8(), COLOR)?;
    let (width, height) = reader.info().size();
    let (color, _) = reader.output_color_type();
    let pixels = png_pixels(reader, bytes, COLOR)?;
    let rgb = match color {
        png::ColorType::Rgb => pixels,
        png::ColorType::Rgba => pixels
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect(),
        png::ColorType::Grayscale => pixels.iter().flat_map(|&grey| [grey; 3]).collect(),
        png::ColorType::GrayscaleAlpha => pixels.chunks_exact(2).flat_map(|p| [p[0]; 3]).collect(),
        png::ColorType::Indexed => return Err(fault(COLOR, "a PNG whose palette is missing")),
    };
    Ok(ColorImage { width, height, rgb })
}

/// Decodes a depth picture to metres.
pub(crate) fn decode_depth(bytes: &[u8], code: DepthCode) -> Result<DepthImage, DecodeFault> {
    if !bytes.starts_with(PNG_SIGNATURE) {
        return Err(fault(
            DEPTH,
            if bytes.starts_with(&[0xFF, 0xD8]) {
                "a JPEG".to_owned()
            } else {
                unknown(bytes)
            },
        ));
    }
    let reader = png_reader(bytes, png::Transformations::IDENTITY, DEPTH)?;
    let (width, height) = reader.info().size();
    match reader.output_color_type() {
        (png::ColorType::Grayscale, png::BitDepth::Sixteen) => {}
        (color, depth) => {
            return Err(fault(
                DEPTH,
                format!("a PNG of {color:?} with {} bits", depth as u8),
            ));
        }
    }
    let pixels = png_pixels(reader, bytes, DEPTH)?;
    let depth_m = pixels
        .chunks_exact(2)
        .map(|pair| u16::from_be_bytes([pair[0], pair[1]]))
        .map(|stored| {
            if Some(stored) == code.invalid {
                0.0
            } else {
                f32::from(stored) / code.units_per_m
            }
        })
        .collect();
    Ok(DepthImage {
        width,
        height,
        depth_m,
    })
}
