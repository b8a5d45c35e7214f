//! `ipdrecon table`: the paper's Tables 3 to 8 on any scans, as Markdown and JSON.

mod efficiency;
mod figures;
mod grid;
mod layout;
mod measure;
mod method;
mod picture;
mod report;
mod scans;
mod setting;

use crate::{compute::DeviceChoice, failure::Failure, protocol::Protocol, size::Size};
use clap::Args;
use layout::{Kind, Table};
use method::Method;
use recon::NetworkConfig;
use report::Report;
use scans::named;
use setting::{Of, Setting};
use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

/// What `table` is told.
#[derive(Args)]
pub struct Arguments {
    /// Which of the paper's tables.
    #[arg(value_enum)]
    kind: Kind,
    /// Scans with depth: folders and zips; FOLDER/* is every one in it; FILE.txt names one on each line, from where it
    /// lies. For `generalization` each is a set, which NAME=… names.
    #[arg(long, num_args = 1.., value_name = "SCAN")]
    scans: Vec<String>,
    /// The weights of the row "ours"; without it those that come with the program.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// The weights of the row "baseline": the network trained alike with all of its switches off.
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    /// Weights of one more row; or a mesh (.ply, in the canonical world) that is the same guess for every scan.
    #[arg(long, value_name = "NAME=FILE")]
    row: Vec<String>,
    /// Take at most this many views of each scan, or of each tile with --of tile; several for `views`, such as 60,80,100.
    /// Without it all keyframes are taken. For `efficiency`: views of a chunk.
    #[arg(long, value_delimiter = ',')]
    views: Vec<usize>,
    /// What --views bounds.
    #[arg(long, value_enum, default_value_t = Of::Scan)]
    of: Of,
    /// Make each tile of the room from at most this many keyframes; without it what suits the weights.
    #[arg(long, conflicts_with = "of")]
    tile_views: Option<usize>,
    /// Choose the views of a tile at random with the seeds 0, 1, … below this; without it by what they cover, which no
    /// seed changes.
    #[arg(long)]
    seeds: Option<u64>,
    /// How meshes are compared.
    #[arg(long, value_enum, default_value_t = Protocol::TransformerFusion)]
    protocol: Protocol,
    /// A folder with the true mesh of each scan, NAME.ply in the scan's own world. Without it that is gt.ply in the scan's
    /// folder, or else fused from depth.
    #[arg(long, value_name = "FOLDER")]
    truth: Option<PathBuf>,
    /// Depth counts up to this many metres, in the truth as in every row.
    #[arg(long, value_name = "METRES", default_value_t = NetworkConfig::default().reach_m)]
    reach: f32,
    /// Pictures are scaled down to fit into this many pixels; without it what suits the weights.
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Option<Size>,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t = DeviceChoice::Cpu)]
    device: DeviceChoice,
    /// Work on so many scans at a time. Several are done sooner on a processor, but their seconds say little.
    #[arg(long, default_value = "1")]
    jobs: NonZeroUsize,
    /// Write a page into this folder: the table, plots, and every mesh beside the truth, coloured by its errors.
    #[arg(long, value_name = "FOLDER")]
    report: Option<PathBuf>,
    /// Write every single figure into this file too.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs `table`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (device, limits) = arguments.device.device()?;
    let networks = arguments.networks(&device)?;
    let table = if arguments.kind == Kind::Efficiency {
        let views = match arguments.views.as_slice() {
            [] => &[20, 60, 100],
            views => views,
        };
        let name = arguments.device.name(&device);
        efficiency::table(&networks, views, arguments.size, &device, &name)?
    } else {
        let sets = scans::sets(&arguments.scans)?;
        let setting = Setting {
            views: match arguments.views.as_slice() {
                [] => vec![None],
                views => views.iter().copied().map(Some).collect(),
            },
            of: arguments.of,
            tile_views: arguments.tile_views,
            seeds: arguments.seeds,
            protocol: arguments.protocol.into(),
            truth: arguments.truth.clone(),
            reach_m: arguments.reach,
            size: arguments.size.map(|size| size.0),
            device_name: arguments.device.name(&device),
            device,
            limits,
            jobs: arguments.jobs,
        };
        let mut methods = vec![Method::sensor(), Method::stereo()];
        methods.extend(networks);
        let mut report = arguments
            .report
            .as_deref()
            .map(Report::create)
            .transpose()?;
        let cells = measure::all(&sets, &methods, &setting, report.as_mut())?;
        let table = layout::table(arguments.kind, &methods, &cells, &setting);
        if let Some(report) = report {
            report.write(&table, &cells)?;
        }
        table
    };
    arguments.write(&table)
}

impl Arguments {
    /// The rows that networks make: the baseline, ours, and whatever else was named.
    fn networks(&self, device: &burn::tensor::Device) -> Result<Vec<Method>, Failure> {
        let mut methods = vec![
            match &self.baseline {
                None => Method::missing("baseline".to_owned()),
                Some(file) => Method::network("baseline".to_owned(), Some(file), device)?,
            },
            Method::network("ours".to_owned(), self.weights.as_deref(), device)?,
        ];
        for row in &self.row {
            let (name, file) = named(row).ok_or_else(|| Failure::Named {
                option: "--row",
                expected: "NAME=FILE",
                found: row.clone(),
            })?;
            methods.push(Method::from_file(name.to_owned(), Path::new(file), device)?);
        }
        Ok(methods)
    }

    fn write(&self, table: &Table) -> Result<(), Failure> {
        if let Some(file) = &self.json {
            let text = serde_json::to_string_pretty(&table.json())?;
            fs::write(file, text).map_err(|error| Failure::file("write", file, error))?;
        }
        print!("{}", table.markdown());
        Ok(())
    }
}
