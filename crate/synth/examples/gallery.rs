//! A contact sheet of training scans: `cargo run --release -p synth --example gallery -- FILE [FIRST] [WIDTHxHEIGHT]`.
//! A row for each of two rooms, six pictures a room.

use std::{env, fs::File, io};

const ACROSS: usize = 6;
const ROOMS: u64 = 12;
const FRAMES: usize = 60;

fn main() -> io::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let file = arguments
        .first()
        .ok_or_else(|| io::Error::other("expected a file, found no argument"))?;
    let first = arguments
        .get(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(0);
    let size = arguments.get(2).and_then(|text| text.split_once('x'));
    let (width, height) = size
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)))
        .unwrap_or((240, 180));
    let (w, h) = (width as usize, height as usize);
    let mut sheet = vec![[255u8; 3]; ROOMS as usize * h * ACROSS * w];
    for row in 0..ROOMS as usize {
        let scan = synth::TrainingScan::new(first + row as u64, FRAMES, width, height);
        for column in 0..ACROSS.min(scan.views().len()) {
            let frame = scan.frame(column * scan.views().len() / ACROSS);
            for y in 0..h {
                let at = (row * h + y) * ACROSS * w + column * w;
                sheet[at..at + w].copy_from_slice(&frame.color[y * w..(y + 1) * w]);
            }
        }
    }
    let mut encoder = png::Encoder::new(
        File::create(file)?,
        (ACROSS * w) as u32,
        (ROOMS as usize * h) as u32,
    );
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(sheet.as_flattened())?;
    Ok(())
}
