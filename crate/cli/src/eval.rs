//! `ipdrecon eval`: a mesh against ground truth.

use crate::{
    failure::Failure,
    files::{open_scan, read_mesh},
    progress::bar,
};
use burn::tensor::Device;
use clap::{Args, ValueEnum};
use recon::evaluate::{self, Report};
use std::path::PathBuf;

/// What `eval` is told.
#[derive(Args)]
pub struct Arguments {
    /// The mesh to judge, PLY, in the scan's own world.
    #[arg(long)]
    pred: PathBuf,
    /// Ground truth, PLY.
    #[arg(long)]
    gt: PathBuf,
    /// The scan: says what was seen, and gives the depth for the 2D figures.
    #[arg(long)]
    scan: Option<PathBuf>,
    /// How to compare.
    #[arg(long, value_enum)]
    protocol: Protocol,
    /// Seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the figures as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Protocol {
    Vortx,
    #[value(name = "transformerfusion")]
    TransformerFusion,
    Plain,
}

/// Runs `eval`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let pred = read_mesh(&arguments.pred)?;
    let gt = read_mesh(&arguments.gt)?;
    let scan = arguments.scan.as_deref().map(open_scan).transpose()?;
    let protocol = match arguments.protocol {
        Protocol::Vortx => evaluate::Protocol::Vortx,
        Protocol::TransformerFusion => evaluate::Protocol::TransformerFusion,
        Protocol::Plain => evaluate::Protocol::Plain,
    };
    let bar = bar("comparing", 0);
    let report = pollster::block_on(evaluate::evaluate(
        &pred,
        &gt,
        scan.as_ref(),
        protocol,
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
        print(&report);
    }
    Ok(())
}

fn print(report: &Report) {
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
        println!("abs rel      {:.4}", depth.abs_rel);
        println!("abs diff     {:.4} m", depth.abs_diff);
        println!("sq rel       {:.4} m", depth.sq_rel);
        println!("rmse         {:.4} m", depth.rmse);
        println!("log rmse     {:.4}", depth.log_rmse);
        println!(
            "delta        {:.4} {:.4} {:.4}",
            depth.delta_1, depth.delta_2, depth.delta_3
        );
        println!("coverage     {:.4}", depth.completeness);
    }
}
