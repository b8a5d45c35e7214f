//! A run that was lost goes on from the last stage it had finished: nothing is done twice, and the mesh is the same.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{color_alone, open};
use mesh::Mesh;
use net::{Ipdrecon, weights};
use recon::{
    DepthSource, Flow, Level, Limits, NetworkConfig, Options, Plan, RunError, Sink, Stage, plan,
};
use scan::Scan;
use std::collections::HashMap;

/// All stages that are kept, in order.
const KEPT: [Stage; 4] = [
    Stage::Matching,
    Stage::Decoding(Level::Coarse),
    Stage::Decoding(Level::Medium),
    Stage::Decoding(Level::Fine),
];

/// Keeps what stages made, gives back what it was given, and may stop when a stage begins.
#[derive(Default)]
struct Keeper {
    made: HashMap<Stage, Vec<u8>>,
    gives: HashMap<Stage, Vec<u8>>,
    stages: Vec<Stage>,
    stop_at: Option<Stage>,
}

impl Sink for Keeper {
    fn stage(&mut self, stage: Stage, _total: usize) {
        self.stages.push(stage);
    }

    fn keeps(&self) -> bool {
        true
    }

    fn keep(&mut self, stage: Stage, made: Vec<u8>) {
        self.made.insert(stage, made);
    }

    fn kept(&mut self, stage: Stage) -> Option<Vec<u8>> {
        self.gives.remove(&stage)
    }

    async fn checkpoint(&mut self) -> Flow {
        match self.stop_at.is_some() && self.stages.last().copied() == self.stop_at {
            true => Flow::Stop,
            false => Flow::Continue,
        }
    }
}

struct Job {
    scan: Scan,
    plan: Plan,
    network: Ipdrecon,
}

impl Job {
    /// The released network on a few photos of the sample room.
    fn new() -> Self {
        let scan = open(color_alone(|_, bytes| bytes));
        let config = NetworkConfig {
            size: (160, 120),
            views_a_tile: 8,
            ..NetworkConfig::default()
        };
        let options = Options {
            depth: Some(DepthSource::Network(config)),
            views: Some(8),
            ..Options::default()
        };
        let plan = plan(&scan, &Limits::default(), options).unwrap();
        let file = std::fs::read(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../weights/ipdrecon.safetensors"
        ));
        let network = weights::load(file.unwrap().as_slice(), &Device::flex()).unwrap();
        Self {
            scan,
            plan,
            network,
        }
    }

    fn run(&self, sink: &mut Keeper) -> Result<Mesh, RunError> {
        let (scan, plan, device) = (&self.scan, &self.plan, Device::flex());
        let outcome = recon::reconstruct(scan, plan, &self.network, &device, sink);
        Ok(pollster::block_on(pollster::block_on(outcome)?.volume.mesh()).unwrap())
    }
}

#[test]
fn a_run_that_begins_again_goes_on_after_the_last_finished_stage() {
    let job = Job::new();
    let mut straight = Keeper::default();
    let mesh = job.run(&mut straight).unwrap();
    assert!(mesh.triangles.len() > 1000, "{}", mesh.triangles.len());
    for stage in KEPT {
        assert!(straight.made.contains_key(&stage), "{stage:?} is kept");
    }

    for finished in 1..=KEPT.len() {
        // The first run ends where a device would be lost: in the stage after.
        let stop_at = KEPT.get(finished).copied().unwrap_or(Stage::Coloring);
        let mut lost = Keeper {
            stop_at: Some(stop_at),
            ..Keeper::default()
        };
        job.run(&mut lost).unwrap();
        assert_eq!(lost.made.len(), finished, "until {stop_at:?}");

        let mut again = Keeper {
            gives: lost.made,
            ..Keeper::default()
        };
        let resumed = job.run(&mut again).unwrap();
        let twice = KEPT[..finished].iter().find(|s| again.stages.contains(s));
        assert_eq!(twice, None, "nothing is done twice");
        let rest = KEPT[finished..].iter();
        assert!(rest.clone().all(|stage| again.stages.contains(stage)));
        assert_eq!(resumed.positions, mesh.positions, "from {stop_at:?} on");
        assert_eq!(resumed.triangles, mesh.triangles, "from {stop_at:?} on");
        assert_eq!(resumed.colors, mesh.colors, "from {stop_at:?} on");
    }
}

#[test]
fn what_was_kept_and_is_damaged_is_made_again() {
    let job = Job::new();
    let mut straight = Keeper::default();
    let mesh = job.run(&mut straight).unwrap();
    type Damage = fn(&mut Vec<u8>);
    let damages: [Damage; 3] = [
        |bytes| bytes.truncate(bytes.len() / 2),
        |bytes| bytes.clear(),
        |bytes| bytes[..4].copy_from_slice(&u32::MAX.to_le_bytes()),
    ];
    for damage in damages {
        let mut gives = straight.made.clone();
        gives.values_mut().for_each(damage);
        let mut again = Keeper {
            gives,
            ..Keeper::default()
        };
        assert_eq!(job.run(&mut again).unwrap().positions, mesh.positions);
        assert!(KEPT.iter().all(|stage| again.stages.contains(stage)));
    }
}
