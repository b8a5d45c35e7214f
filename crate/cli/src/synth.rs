//! `ipdrecon synth`: scans of rooms made by rule, a folder a seed, in the 7-Scenes layout with Z up.

use crate::{failure::Failure, progress::bar};
use ::synth::{Frame, GpuTracer, TrainingScan};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::{
    fs,
    io::{self, Write},
    ops::Range,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
    time::Instant,
};

/// What `synth` is told.
#[derive(Args)]
pub struct Arguments {
    /// Which rooms: a seed names one, the same on every machine. FROM..TO leaves out TO.
    #[arg(long, value_name = "FROM..TO", value_parser = seeds)]
    seeds: Range<u64>,
    /// Pictures a scan.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=5000))]
    frames: u32,
    /// Size of the pictures in pixels; of several, separated by commas, each seed picks one.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "320x240", value_delimiter = ',', value_parser = size)]
    size: Vec<(u32, u32)>,
    /// Folder in which each seed gets its own, room-000123; rooms that are there already are left as they are.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Depth with the noise and the reach of a sensor instead of exact depth.
    #[arg(long)]
    noisy_depth: bool,
    /// Poses as a tracker tells them, off by millimetres and tenths of a degree, instead of exact ones.
    #[arg(long)]
    noisy_poses: bool,
    /// What casts the rays: a graphics card where there is one, or else the processor.
    #[arg(long, value_enum, default_value_t = Caster::Auto)]
    device: Caster,
    /// Threads that draw; all cores without it.
    #[arg(long, value_name = "COUNT")]
    threads: Option<usize>,
}

/// What casts the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Caster {
    /// A graphics card, or else the processor.
    Auto,
    /// The processor.
    Cpu,
    /// A graphics card, or a program that plays one.
    Gpu,
}

impl Caster {
    fn open(self) -> Result<Option<GpuTracer>, Failure> {
        match self {
            Self::Auto => Ok(GpuTracer::open(false).ok()),
            Self::Cpu => Ok(None),
            Self::Gpu => Ok(Some(GpuTracer::open(true)?)),
        }
    }
}

fn seeds(text: &str) -> Result<Range<u64>, String> {
    let range = text
        .split_once("..")
        .and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
    match range {
        Some(range) if !range.is_empty() => Ok(range),
        _ => Err("expected two whole numbers, the second larger, such as 0..200".into()),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text
        .split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    match sides {
        Some((width, height)) if (16..=4096).contains(&width) && (16..=4096).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("expected a width and a height from 16 to 4096, such as 320x240".into()),
    }
}

/// Runs `synth`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let wanted = arguments.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(wanted)
        .build()
        .map_err(|error| Failure::Threads {
            wanted,
            error: error.to_string(),
        })?;
    let gpu = arguments.device.open()?;
    let seeds: Vec<u64> = arguments.seeds.clone().collect();
    let bar = bar("rooms", seeds.len());
    let made = AtomicUsize::new(0);
    let start = Instant::now();
    pool.install(|| {
        seeds.par_iter().try_for_each(|&seed| {
            let folder = arguments.output.join(format!("room-{seed:06}"));
            if !folder.exists() {
                write_room(arguments, gpu.as_ref(), seed, &folder)?;
                made.fetch_add(1, Ordering::Relaxed);
            }
            bar.inc(1);
            Ok::<(), Failure>(())
        })
    })?;
    bar.finish_and_clear();
    let (made, seconds) = (made.into_inner(), start.elapsed().as_secs_f64());
    let kept = seeds.len() - made;
    let mut line = format!(
        "{made} scans of {} pictures in {seconds:.1} s on {}: {:.1} scans a minute",
        arguments.frames,
        gpu.as_ref().map_or("the processor", GpuTracer::name),
        60.0 * made as f64 / seconds
    );
    if kept > 0 {
        line += &format!("; {kept} were there already");
    }
    writeln!(io::stdout(), "{line}")
        .map_err(|error| Failure::file("write", Path::new("standard output"), error))
}

/// Writes one scan under another name first, so that a folder of the right name is always whole.
fn write_room(
    arguments: &Arguments,
    gpu: Option<&GpuTracer>,
    seed: u64,
    folder: &Path,
) -> Result<(), Failure> {
    let (width, height) = arguments.size[(seed % arguments.size.len() as u64) as usize];
    let scan = TrainingScan::new(seed, arguments.frames as usize, width, height);
    let part = folder.with_extension("part");
    fs::create_dir_all(&part).map_err(|error| Failure::file("write", &part, error))?;
    let write = |name: &str, bytes: &[u8]| {
        let path = part.join(name);
        fs::write(&path, bytes).map_err(|error| Failure::file("write", &path, error))
    };
    let tracked = arguments.noisy_poses.then(|| scan.tracked());
    for (name, text) in scan.texts(tracked.as_deref().unwrap_or(scan.views())) {
        write(&name, text.as_bytes())?;
    }
    let write_frame = |i: usize, frame: Frame| {
        let stem = format!("frame-{i:06}");
        let refused = |error: String| Failure::Picture {
            path: part.join(&stem),
            error,
        };
        let color =
            color_jpeg(&frame, scan.quality()).map_err(|error| refused(error.to_string()))?;
        write(&format!("{stem}.color.jpg"), &color)?;
        let sensed = arguments
            .noisy_depth
            .then(|| scan.sensed(i, &frame.depth_m));
        let depth_m = sensed.as_deref().unwrap_or(&frame.depth_m);
        let depth = depth_png(&frame, depth_m).map_err(|error| refused(error.to_string()))?;
        write(&format!("{stem}.depth.png"), &depth)
    };
    let count = scan.views().len();
    match gpu {
        None => (0..count)
            .into_par_iter()
            .try_for_each(|i| write_frame(i, scan.frame(i)))?,
        Some(gpu) => {
            let most = gpu.most_frames(width, height);
            for from in (0..count).step_by(most) {
                let gathered = gpu.gather(&scan, from..count.min(from + most))?;
                gathered
                    .par_iter()
                    .try_for_each(|rays| write_frame(rays.index, scan.frame_of(rays)))?;
            }
        }
    }
    fs::rename(&part, folder).map_err(|error| Failure::file("write", folder, error))
}

fn color_jpeg(frame: &Frame, quality: u8) -> Result<Vec<u8>, jpeg_encoder::EncodingError> {
    let mut bytes = Vec::new();
    jpeg_encoder::Encoder::new(&mut bytes, quality).encode(
        frame.color.as_flattened(),
        frame.width as u16,
        frame.height as u16,
        jpeg_encoder::ColorType::Rgb,
    )?;
    Ok(bytes)
}

/// Whole millimetres in 16 bits.
fn depth_png(frame: &Frame, depth_m: &[f32]) -> Result<Vec<u8>, png::EncodingError> {
    let bytes: Vec<u8> = depth_m
        .iter()
        .flat_map(|z| ((z * 1000.0 + 0.5) as u16).to_be_bytes())
        .collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, frame.width, frame.height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(out)
}
