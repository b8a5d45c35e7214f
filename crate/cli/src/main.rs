//! `ipdrecon`: the engine on the command line. The same `recon` as in the browser, with files at both ends.

mod compute;
mod doctor;
mod eval;
mod failure;
mod files;
mod fuse;
mod progress;

use clap::{Parser, Subcommand};
use failure::Failure;
use std::process::ExitCode;

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
    /// Compare a mesh with ground truth.
    Eval(eval::Arguments),
    /// Look into a scan and say what is wrong with it.
    Doctor(doctor::Arguments),
}

fn main() -> ExitCode {
    let result: Result<(), Failure> = match Arguments::parse().command {
        Command::Fuse(arguments) => fuse::run(&arguments),
        Command::Eval(arguments) => eval::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
