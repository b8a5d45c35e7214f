//! Pictures of every accepted kind decode to the right pixels, and a cut one never does.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Files, flat_depth, jpeg, png, png_rgb, png_u16, texture};
use scan::{ColorImage, FrameError, Scan};

const W: u32 = 64;
const H: u32 = 48;

/// A scan of one frame with this colour picture.
fn with_color(bytes: &[u8]) -> Scan {
    let mut files = Files::seven_scenes(1);
    files.set("frame-000000.color.jpg", bytes);
    files.open().unwrap()
}

fn color(bytes: &[u8]) -> Result<ColorImage, FrameError> {
    with_color(bytes).color(0)
}

fn rgb() -> Vec<u8> {
    texture(W, H)
}

/// Smooth, so that JPEG keeps it within a few grey levels.
fn ramp() -> Vec<u8> {
    (0..H)
        .flat_map(|y| (0..W).flat_map(move |x| [x as u8 * 3, y as u8 * 4, 90]))
        .collect()
}

fn largest_difference(a: &[u8], b: &[u8]) -> u8 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
}

#[test]
fn png_colours_are_exact_whatever_their_kind() {
    assert_eq!(
        color(&png_rgb(W, H, &rgb())).unwrap(),
        ColorImage {
            width: W,
            height: H,
            rgb: rgb()
        }
    );

    let rgba: Vec<u8> = rgb()
        .chunks(3)
        .flat_map(|p| [p[0], p[1], p[2], 77])
        .collect();
    let file = png(W, H, png::ColorType::Rgba, png::BitDepth::Eight, &rgba);
    assert_eq!(color(&file).unwrap().rgb, rgb());

    let grey: Vec<u8> = (0..W * H).map(|i| (i % 251) as u8).collect();
    let file = png(W, H, png::ColorType::Grayscale, png::BitDepth::Eight, &grey);
    assert_eq!(
        color(&file).unwrap().rgb,
        grey.iter().flat_map(|&g| [g; 3]).collect::<Vec<_>>()
    );
}

#[test]
fn jpeg_colours_are_close_baseline_progressive_and_grey() {
    assert!(largest_difference(&color(&jpeg(W, H, &ramp())).unwrap().rgb, &ramp()) <= 12);

    let mut progressive = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut progressive, 95);
    encoder.set_progressive(true);
    encoder
        .encode(&ramp(), W as u16, H as u16, jpeg_encoder::ColorType::Rgb)
        .unwrap();
    assert!(largest_difference(&color(&progressive).unwrap().rgb, &ramp()) <= 12);

    let grey: Vec<u8> = (0..H)
        .flat_map(|y| (0..W).map(move |x| (x + y) as u8))
        .collect();
    let mut file = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut file, 95);
    encoder
        .encode(&grey, W as u16, H as u16, jpeg_encoder::ColorType::Luma)
        .unwrap();
    let expected: Vec<u8> = grey.iter().flat_map(|&g| [g; 3]).collect();
    assert!(largest_difference(&color(&file).unwrap().rgb, &expected) <= 6);
}

#[test]
fn a_jpeg_cut_anywhere_is_an_error() {
    let mut progressive = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut progressive, 90);
    encoder.set_progressive(true);
    encoder
        .encode(&rgb(), W as u16, H as u16, jpeg_encoder::ColorType::Rgb)
        .unwrap();
    for whole in [jpeg(W, H, &rgb()), progressive] {
        let scan = with_color(&whole);
        assert!(scan.color(0).is_ok());
        // Some lengths, and each of the last, where the entropy-coded data end.
        let lengths = (0..whole.len()).filter(|at| at % 13 == 0 || at + 40 > whole.len());
        for length in lengths {
            let mut files = Files::seven_scenes(2);
            files.set("frame-000001.color.jpg", &whole[..length]);
            let error = files.open().unwrap().color(1).unwrap_err();
            assert!(
                matches!(error, FrameError::Undecodable(_)),
                "{length} of {}",
                whole.len()
            );
        }
    }
}

#[test]
fn a_png_cut_anywhere_before_its_last_pixel_is_an_error() {
    let values: Vec<u16> = (0..W * H).map(|i| (i * 37 % 5000) as u16).collect();
    let whole = png_u16(W, H, &values);
    // Behind the pixels only the checksum and the end mark follow.
    let end_mark = 12;
    for length in (0..whole.len() - end_mark - 4).rev().step_by(13) {
        let mut files = Files::seven_scenes(2);
        files.set("frame-000001.depth.png", &whole[..length]);
        let error = files.open().unwrap().depth(1).unwrap_err();
        assert!(
            matches!(error, FrameError::Undecodable(_)),
            "{length} of {}",
            whole.len()
        );
    }
}

#[test]
fn a_jpeg_with_a_damaged_middle_is_an_error() {
    let whole = jpeg(W, H, &rgb());
    let mut damaged = whole.clone();
    let middle = whole.len() / 2;
    damaged[middle..middle + 40].fill(0xFF);
    assert!(color(&damaged).is_err());
}

#[test]
fn a_png_with_a_flipped_bit_is_an_error() {
    let mut files = Files::seven_scenes(1);
    let mut bytes = flat_depth(W, H, 1234);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    files.set("frame-000000.depth.png", bytes);
    assert!(files.open().unwrap().depth(0).is_err());
}

#[test]
fn depth_must_be_sixteen_bit_grey() {
    let grey = png(
        W,
        H,
        png::ColorType::Grayscale,
        png::BitDepth::Eight,
        &vec![9; (W * H) as usize],
    );
    for (bytes, found) in [
        (grey, "a PNG of Grayscale with 8 bits"),
        (png_rgb(W, H, &rgb()), "a PNG of Rgb with 8 bits"),
        (jpeg(W, H, &rgb()), "found a JPEG"),
        (
            b"no picture".to_vec(),
            "found 10 bytes that are neither JPEG nor PNG",
        ),
        (Vec::new(), "found an empty file"),
    ] {
        let mut files = Files::seven_scenes(1);
        files.set("frame-000000.depth.png", bytes);
        let error = files.open().unwrap().depth(0).unwrap_err();
        common::assert_tells(
            &error.to_string(),
            &["frame-000000.depth.png", "16-bit grey PNG", found],
        );
    }
}

#[test]
fn a_picture_that_claims_to_be_huge_is_refused_before_memory_is_taken() {
    let mut bytes = flat_depth(W, H, 1000);
    bytes[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]); // 16384 x 16384
    let checksum = crc32fast::hash(&bytes[12..29]).to_be_bytes();
    bytes[29..33].copy_from_slice(&checksum);
    let mut files = Files::seven_scenes(2);
    files.set("frame-000001.depth.png", bytes);
    let error = files.open().unwrap().depth(1).unwrap_err();
    common::assert_tells(&error.to_string(), &["16384x16384 pixels, too many"]);
}

#[test]
fn the_size_is_found_behind_a_long_preview() {
    // 100 kB of metadata before the picture, as cameras with previews write it.
    let plain = jpeg(W, H, &rgb());
    let mut long = plain[..2].to_vec();
    for _ in 0..2 {
        long.extend([0xFF, 0xE1, 0xC3, 0x50]);
        long.extend(vec![0; 50_000 - 2]);
    }
    long.extend(&plain[2..]);
    let scan = with_color(&long);
    assert_eq!(scan.frames()[0].color_camera.width, W);
    assert_eq!(scan.color(0).unwrap().rgb, color(&plain).unwrap().rgb);
}
