//! `ipdrecon bench`: what the network's parts cost on this machine, beside what the machine can do at best.

use crate::{compute::DeviceChoice, failure::Failure, size::Size, weights::Weights};
use ::bench::{Report, Subject, Times, Unread, input::EDGE, report::Asked};
use burn::tensor::Device;
use clap::Args;
use net::{Ipdrecon, ops};
use pollster::block_on;
use std::{fs, path::PathBuf};

/// The network's own pictures and the paper's.
const SIZES: [(u32, u32); 2] = [(160, 120), (640, 480)];
/// Coarse voxels of an attention on its own.
const ATTENDED: (usize, usize) = (1_000, 20);
/// Edge of the piece with --quick, and of the one that tensor operations have to do: 0.64 m.
const SMALL_EDGE: i32 = 16;
/// Views of that piece.
const SMALL_VIEWS: usize = 10;

/// What `bench` is told.
#[derive(Args)]
pub struct Arguments {
    /// Weights; without them those that come with the program.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t = DeviceChoice::Cpu)]
    device: DeviceChoice,
    /// Views of a piece of 1.6 m, several.
    #[arg(long, value_delimiter = ',', default_values_t = [20, 60, 100])]
    views: Vec<usize>,
    /// Sizes of pictures, several; pieces are seen in pictures of the first.
    #[arg(long, value_delimiter = ',', value_name = "WIDTHxHEIGHT", default_values_t = SIZES.map(Size))]
    size: Vec<Size>,
    /// Runs of each part, after a cold one and another.
    #[arg(long, default_value_t = 9)]
    runs: usize,
    /// A small piece and one run, to see that it works.
    #[arg(long)]
    quick: bool,
    /// On a GPU: kernels beside the tensor operations that they stand for, one small piece.
    #[arg(long)]
    plain: bool,
    /// Write all figures into this file too.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs `bench`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (device, _) = arguments.device.device()?;
    let weights = Weights::read(arguments.weights.as_deref())?;
    let network = weights.get(|bytes| net::weights::load(bytes, &device))?;
    let sizes: Vec<(u32, u32)> = arguments.size.iter().map(|size| size.0).collect();
    let asked = Asked {
        piece_size: sizes.first().copied().unwrap_or(SIZES[0]),
        sizes,
        views: arguments.views.clone(),
        edge: if arguments.quick { SMALL_EDGE } else { EDGE },
        runs: if arguments.quick { 1 } else { arguments.runs },
    };
    let name = arguments.device.name(&device);
    if arguments.plain {
        println!("{}", block_on(beside_plain(&network, &device, &asked))?);
    } else {
        let report = block_on(Report::measure(&network, &device, &asked))?;
        println!("{}", report.markdown());
        if let Some(path) = &arguments.json {
            let data = serde_json::json!({ "device": name, "report": report });
            fs::write(path, data.to_string())
                .map_err(|error| Failure::file("write", path, error))?;
        }
    }
    println!(
        "\n{name}; version {}, commit {}",
        env!("CARGO_PKG_VERSION"),
        env!("IPDRECON_COMMIT")
    );
    Ok(())
}

/// Kernels and tensor operations in turns, part by part.
async fn beside_plain(
    network: &Ipdrecon,
    device: &Device,
    asked: &Asked,
) -> Result<String, Unread> {
    let subject = Subject {
        network,
        device,
        size: asked.piece_size,
        edge: SMALL_EDGE,
        runs: asked.runs,
    };
    let (width, height) = asked.piece_size;
    let (voxels, views) = ATTENDED;
    let mut lines = vec![
        "| part | tensor operations ms | kernels ms | ratio |".to_owned(),
        "|---|---|---|---|".to_owned(),
    ];
    let mut row = |part: String, [plain, fused]: [f64; 2]| {
        let ratio = plain / fused;
        lines.push(format!("| {part} | {plain:.1} | {fused:.1} | {ratio:.1} |"));
    };
    let recurrence = both(async || subject.recurrence().await).await?;
    row(
        format!("linear recurrence, fine plane of {width}x{height}"),
        recurrence,
    );
    let attention = both(async || subject.attention(voxels, views).await).await?;
    row(
        format!("attention, {voxels} voxels of {views} views"),
        attention,
    );
    let picture = both(async || subject.picture().await).await?;
    row(format!("planes of a picture of {width}x{height}"), picture);
    let piece = both(async || Ok(subject.piece(SMALL_VIEWS).await?.whole)).await?;
    row(
        format!("piece of 0.64 m, {SMALL_VIEWS} views: fusion and 3D networks"),
        piece,
    );
    // A run computes the planes of every view, too.
    let whole = [0, 1].map(|form| SMALL_VIEWS as f64 * picture[form] + piece[form]);
    row(
        format!("whole network: the planes of {SMALL_VIEWS} pictures and that piece"),
        whole,
    );
    Ok(lines.join("\n"))
}

/// Warm milliseconds of `work` in tensor operations, then in kernels.
async fn both(mut work: impl AsyncFnMut() -> Result<Times, Unread>) -> Result<[f64; 2], Unread> {
    let mut found = [0.0; 2];
    for (found, plain) in found.iter_mut().zip([true, false]) {
        ops::use_plain(plain);
        let times = work().await;
        ops::use_plain(false);
        *found = times?.warm_ms;
    }
    Ok(found)
}
