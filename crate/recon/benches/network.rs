//! Where the time of a reconstruction goes, stage by stage, as a Markdown table: the whole network with untrained weights on
//! the sample room. What it finds there would be nonsense, so that a room's true distances take its logits' place and the
//! voxels are those that a trained network would go on with.
//!
//! `cargo bench --bench network -- [small|medium|full]`

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use burn::{
    Tensor,
    tensor::{Device, TensorData},
};
use common::{SEED, color_alone, open, sample};
use glam::{DAffine3, IVec3, Vec3};
use net::{Ipdrecon, NetConfig, View, model::Decoded, planes::Plane};
use recon::{
    DepthSource, Flow, Input, Level, Limits, Network, NetworkConfig, Options, Preset, Seen, Sink,
    Stage,
};
use std::{
    cell::{Cell, RefCell},
    time::Instant,
};
use synth::Room;

/// The network's work with the room's truth as its result.
struct Rigged {
    model: Ipdrecon,
    room: Room,
    room_from_canonical: DAffine3,
    sites: RefCell<Vec<usize>>,
    decoding_s: Cell<f64>,
}

impl Network for Rigged {
    type Plane = Plane;

    fn device(&self) -> Device {
        Network::device(&self.model)
    }

    fn row_bytes(&self, level: Level) -> usize {
        Network::row_bytes(&self.model, level)
    }

    fn guided(&self) -> bool {
        false
    }

    fn planes(&self, images: Tensor<4>, views: &[View]) -> [Plane; 3] {
        Network::planes(&self.model, images, views)
    }

    fn stack(&self, planes: &[&Plane]) -> Plane {
        self.model.stack(planes)
    }

    fn fuse(
        &self,
        level: Level,
        plane: &Plane,
        views: &[View],
        sites: &[IVec3],
        origin_m: Vec3,
    ) -> (Tensor<2>, Option<Seen>) {
        Network::fuse(&self.model, level, plane, views, sites, origin_m)
    }

    fn decode(&self, level: Level, input: Input<'_>) -> Decoded {
        let (sites, origin_m) = (input.sites.to_vec(), input.origin_m);
        self.sites.borrow_mut().push(sites.len());
        let start = Instant::now();
        let decoded = Network::decode(&self.model, level, input);
        // Waits for it.
        let found: Vec<f32> = decoded.logit.clone().into_data().try_into_vec().unwrap();
        assert!(found.iter().all(|logit| logit.is_finite()));
        self.decoding_s
            .set(self.decoding_s.get() + start.elapsed().as_secs_f64());
        let size = self.room.size_m();
        let logit = sites.iter().map(|site| {
            let point = (site.as_vec3() * level.voxel_size_m() + origin_m).as_dvec3();
            let point = self.room_from_canonical.transform_point3(point).as_vec3();
            let center = Vec3::new(0.0, 0.0, 0.5 * size.z);
            let outside = ((point - center).abs() - 0.5 * size).max_element();
            let distance_m = match outside > 0.0 {
                true => -outside,
                false => self.room.distance(point),
            };
            match level {
                Level::Fine => (distance_m / 0.12 / 1.05).clamp(-0.95, 0.95).atanh(),
                // What is near in the truth of method 1.8: the band, dilated by a voxel.
                _ => 0.12 + level.voxel_size_m() - distance_m.abs(),
            }
        });
        let logit = TensorData::new(logit.collect::<Vec<f32>>(), [sites.len()]);
        Decoded {
            logit: Tensor::from_data(logit, &decoded.logit.device()),
            ..decoded
        }
    }
}

/// Notes when stages began.
#[derive(Default)]
struct Clock(Vec<(Stage, usize, Instant)>);

impl Sink for Clock {
    fn stage(&mut self, stage: Stage, total: usize) {
        self.0.push((stage, total, Instant::now()));
    }

    async fn checkpoint(&mut self) -> Flow {
        Flow::Continue
    }
}

fn main() {
    let wanted = std::env::args().nth(1);
    let (name, preset, widths) = match wanted.as_deref() {
        Some("medium") => ("medium", Preset::Medium, NetConfig::full()),
        Some("full") => ("full", Preset::Full, NetConfig::full()),
        _ => ("small", Preset::Small, NetConfig::small()),
    };
    let device = Device::flex();
    let scan = open(color_alone(|_, bytes| bytes));
    let (turn, shift) = sample().world_from_room();
    let scan_from_room = DAffine3::from_mat3_translation(turn.as_dmat3(), shift.as_dvec3());
    let network = Rigged {
        model: Ipdrecon::new(&widths, &device),
        room: Room::new(SEED),
        room_from_canonical: scan_from_room.inverse() * scan.scan_from_canonical(),
        sites: RefCell::default(),
        decoding_s: Cell::default(),
    };
    let config = NetworkConfig {
        reach_m: 3.0,
        ..preset.config()
    };
    let options = Options {
        depth: Some(DepthSource::Network(config)),
        ..Options::default()
    };
    let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
    let mut clock = Clock::default();
    let start = Instant::now();
    let run = recon::reconstruct(&scan, &plan, &network, &device, &mut clock);
    let outcome = pollster::block_on(run).unwrap();
    let end = Instant::now();
    println!(
        "{name}: {} keyframes on the processor\n",
        outcome.frames_fused
    );
    println!("| stage | steps | s |\n|---|---|---|");
    let ends = clock.0.iter().skip(1).map(|stage| stage.2).chain([end]);
    for ((stage, steps, begun), end) in clock.0.iter().zip(ends) {
        let seconds = (end - *begun).as_secs_f64();
        println!("| {stage:?} | {steps} | {seconds:.2} |");
    }
    println!(
        "\n{:.1} s in all, of which {:.1} s in the 3D networks; voxels of the levels {:?}, {} bricks of {} planned, {} MB planned on the device",
        (end - start).as_secs_f64(),
        network.decoding_s.get(),
        network.sites.borrow(),
        outcome.volume.brick_count(),
        plan.bricks,
        (plan.device_bytes + plan.network_bytes) >> 20,
    );
}
