//! `ipdrecon`: the engine on the command line. The same `recon` as in the browser, with files at both ends.

mod bench;
mod compute;
mod depth_folder;
mod doctor;
mod eval;
mod failure;
mod files;
mod fuse;
mod import;
mod job;
mod progress;
mod protocol;
mod reconstruct;
mod size;
mod stereo;
mod synth;
mod table;
mod train;
mod weights;

use clap::{Parser, Subcommand};
use failure::Failure;
use std::process::ExitCode;

/// It keeps large buffers at hand. glibc's gives those above 32 MB back at once and has each page of the next one faulted in again, which took a third
/// of the network's time with pictures of 640x480 and 60 views of a piece.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Posed photos of a room in, a metric triangle mesh out.
#[derive(Parser)]
#[command(name = "ipdrecon", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fuse the depth images of a scan into a mesh.
    Fuse(fuse::Arguments),
    /// Make depth from the colour images of a scan, and a mesh from that.
    Stereo(stereo::Arguments),
    /// Make a mesh from the colour images of a scan with a trained network.
    Reconstruct(reconstruct::Arguments),
    /// Compare a mesh with ground truth, or depth maps with the sensor's depth.
    Eval(eval::Arguments),
    /// The paper's tables on any scans.
    Table(table::Arguments),
    /// Time the network's parts on this machine.
    Bench(bench::Arguments),
    /// Look into a scan and say what is wrong with it.
    Doctor(doctor::Arguments),
    /// Make scans of made-up rooms, with exact depth, to learn from.
    Synth(synth::Arguments),
    /// Make weights of a checkpoint of VoRTX's own code.
    Import(import::Arguments),
    /// Train the network on scans with depth.
    Train(train::Arguments),
}

fn main() -> ExitCode {
    let result: Result<(), Failure> = match Arguments::parse().command {
        Command::Fuse(arguments) => fuse::run(&arguments),
        Command::Stereo(arguments) => stereo::run(&arguments),
        Command::Reconstruct(arguments) => reconstruct::run(&arguments),
        Command::Eval(arguments) => eval::run(&arguments),
        Command::Table(arguments) => table::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Synth(arguments) => synth::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Train(arguments) => train::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
