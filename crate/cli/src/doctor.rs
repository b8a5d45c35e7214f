//! `ipdrecon doctor`: looks into a scan before any work.

use crate::{failure::Failure, files::open_scan, progress::print_finding};
use clap::Args;
use scan::doctor::{self, Look, Report};
use std::path::PathBuf;

/// What `doctor` is told.
#[derive(Args)]
pub struct Arguments {
    /// Folder or zip of the scan.
    scan: PathBuf,
    /// Write the report as JSON.
    #[arg(long)]
    json: bool,
    /// Decode at most this many frames, evenly spread; 0 for all.
    #[arg(long, default_value_t = 0)]
    sample: usize,
}

/// Runs `doctor`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let scan = open_scan(&arguments.scan)?;
    let look = match arguments.sample {
        0 => Look::All,
        count => Look::Sample(count),
    };
    let report = doctor::examine(&scan, look);
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print(&report);
    }
    Ok(())
}

fn print(report: &Report) {
    println!("{} ({})", report.name, report.format);
    println!(
        "frames       {} ({} with colour, {} with depth), {} keyframes",
        report.frames, report.color_frames, report.depth_frames, report.keyframes
    );
    for (name, camera) in [
        ("colour", &report.color_camera),
        ("depth", &report.depth_camera),
    ] {
        if let Some(camera) = camera {
            println!(
                "{name:12} {} x {}, fx {:.2} fy {:.2} cx {:.2} cy {:.2}",
                camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
            );
        }
    }
    println!(
        "path         {:.2} m long, {:.2} m across, {:.2} m up and down",
        report.path_length_m, report.path_extent_m, report.height_spread_m
    );
    println!(
        "gravity      {:?}, up was {:.1} degrees from the files' Z",
        report.gravity.source, report.gravity.rotated_deg
    );
    if report.findings.is_empty() {
        println!("no findings");
    }
    report.findings.iter().for_each(print_finding);
}
