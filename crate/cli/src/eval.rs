//! `ipdrecon eval`: a mesh against ground truth, or depth maps of stereo against the sensor's depth.

use crate::{
    depth_folder::{DepthFolder, Kind},
    failure::Failure,
    files::{open_scan, read_mesh},
    progress::bar,
    protocol::Protocol,
};
use burn::tensor::Device;
use clap::Args;
use mesh::metrics::Depth2d;
use recon::evaluate::{self, DepthFigures, Report, compare_depth, mean_depth};
use serde_json::json;
use std::path::{Path, PathBuf};

/// What `eval` is told.
#[derive(Args)]
pub struct Arguments {
    /// The mesh to judge, PLY, in the scan's own world.
    #[arg(long, required_unless_present = "depth", requires_all = ["gt", "protocol"])]
    pred: Option<PathBuf>,
    /// Ground truth, PLY.
    #[arg(long, requires = "pred")]
    gt: Option<PathBuf>,
    /// The scan: says what was seen, and gives the sensor's depth for the 2D figures.
    #[arg(long, required_unless_present = "pred")]
    scan: Option<PathBuf>,
    /// How to compare.
    #[arg(long, value_enum, requires = "pred")]
    protocol: Option<Protocol>,
    /// Judge the depth maps in this folder, as `stereo --depth` writes them, instead of a mesh.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["pred", "gt", "protocol"], requires = "scan")]
    depth: Option<PathBuf>,
    /// Seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs `eval`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match arguments {
        Arguments {
            depth: Some(folder),
            scan: Some(scan),
            ..
        } => judge_depth(folder, scan, arguments.json),
        Arguments {
            pred: Some(pred),
            gt: Some(gt),
            protocol: Some(protocol),
            ..
        } => judge_mesh(arguments, pred, gt, *protocol),
        // The arguments' own rules leave nothing else.
        _ => Ok(()),
    }
}

fn judge_mesh(
    arguments: &Arguments,
    pred: &Path,
    gt: &Path,
    protocol: Protocol,
) -> Result<(), Failure> {
    let pred = read_mesh(pred)?;
    let gt = read_mesh(gt)?;
    let scan = arguments.scan.as_deref().map(open_scan).transpose()?;
    let bar = bar("comparing", 0);
    let report = pollster::block_on(evaluate::evaluate(
        &pred,
        &gt,
        scan.as_ref(),
        protocol.into(),
        arguments.seed,
        &Device::flex(),
        |done, total| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        },
    ));
    bar.finish_and_clear();
    let report = report?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print_mesh(&report);
    }
    Ok(())
}

/// Both maps of every frame that has them.
fn judge_depth(folder: &Path, scan: &Path, as_json: bool) -> Result<(), Failure> {
    let scan = open_scan(scan)?;
    let folder = DepthFolder::of(folder, &scan)?;
    let bar = bar("comparing", scan.frames().len());
    let mut figures: [Vec<DepthFigures>; 2] = Default::default();
    for (index, frame) in scan.frames().iter().enumerate() {
        for (kind, figures) in [Kind::Raw, Kind::Filtered].into_iter().zip(&mut figures) {
            if let Some(picture) = folder.read(index, kind)? {
                // As stereo works: the colour camera's picture, scaled.
                let camera = frame.color_camera.scaled(picture.width, picture.height);
                figures.extend(compare_depth(&scan, index, &camera, &picture.depth_m)?);
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let [raw, filtered] = figures.map(|maps| mean_depth(&maps));
    if raw.is_none() && filtered.is_none() {
        return Err(folder.nothing_to_compare(&scan));
    }
    if as_json {
        let report = json!({ "raw": raw, "filtered": filtered });
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(());
    }
    for (name, figures) in [("raw", raw), ("filtered", filtered)] {
        if let Some(figures) = figures {
            println!("{name} depth of {} keyframes", figures.maps);
            print_depth(&figures.errors, figures.coverage);
        }
    }
    Ok(())
}

fn print_mesh(report: &Report) {
    let surface = &report.surface;
    println!("protocol     {:?}, seed {}", report.protocol, report.seed);
    println!("accuracy     {:.4} m", surface.accuracy_m);
    println!("completeness {:.4} m", surface.completeness_m);
    println!("chamfer      {:.4} m", surface.chamfer_m);
    println!("precision    {:.4}", surface.precision);
    println!("recall       {:.4}", surface.recall);
    println!(
        "F            {:.4} at {} m",
        surface.f_score, surface.threshold_m
    );
    if let Some(depth) = &report.depth {
        print_depth(depth, depth.completeness);
    }
}

fn print_depth(depth: &Depth2d, coverage: f64) {
    println!("abs rel      {:.4}", depth.abs_rel);
    println!("abs diff     {:.4} m", depth.abs_diff);
    println!("sq rel       {:.4} m", depth.sq_rel);
    println!("rmse         {:.4} m", depth.rmse);
    println!("log rmse     {:.4}", depth.log_rmse);
    println!(
        "delta        {:.4} {:.4} {:.4}",
        depth.delta_1, depth.delta_2, depth.delta_3
    );
    println!("coverage     {coverage:.4}");
}
