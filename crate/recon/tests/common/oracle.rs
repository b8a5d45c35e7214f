//! A network that knows the room: it stands in for the real one.
#![allow(dead_code)]

use crate::common::{Recorder, SEED, sample};
use burn::{
    Tensor,
    tensor::{Device, TensorData},
};
use glam::{DAffine3, IVec3, Vec3};
use mesh::Mesh;
use net::{View, model::Decoded};
use recon::{
    DepthSource, Input, Level, Limits, Network, NetworkConfig, Options, Outcome, RunError, Seen,
};
use scan::Scan;
use std::cell::RefCell;
use synth::Room;
use volume::VolumeConfig;

const TRUNCATION_M: f32 = 0.12;

/// Knows the room, and remembers what it was asked.
pub struct Oracle {
    pub room: Room,
    pub room_from_canonical: DAffine3,
    /// Level, views and sites of every block.
    pub blocks: RefCell<Vec<(Level, usize, usize)>>,
    /// Coarse sites that fewer than two of their views see, and cameras of all blocks of that level.
    pub lonely: RefCell<usize>,
    pub cameras: RefCell<Vec<Vec3>>,
    /// Says that there is nothing at all.
    pub empty: bool,
    /// Wants stereo's depth.
    pub guided: bool,
    /// Says that every surface is so much nearer than it is, in metres.
    pub off_m: f32,
    pub device: Device,
}

impl Oracle {
    pub fn new(scan: &Scan) -> Self {
        let (turn, shift) = sample().world_from_room();
        let scan_from_room = DAffine3::from_mat3_translation(turn.as_dmat3(), shift.as_dvec3());
        Self {
            room: Room::new(SEED),
            room_from_canonical: scan_from_room.inverse() * scan.scan_from_canonical(),
            blocks: RefCell::default(),
            lonely: RefCell::default(),
            cameras: RefCell::default(),
            empty: false,
            guided: false,
            off_m: 0.0,
            device: Device::flex(),
        }
    }

    /// Free space outside the walls does not count.
    fn distance_m(&self, point: Vec3) -> f32 {
        let point = self.room_from_canonical.transform_point3(point.as_dvec3());
        let point = point.as_vec3();
        let size = self.room.size_m();
        let center = Vec3::new(0.0, 0.0, 0.5 * size.z);
        let outside = ((point - center).abs() - 0.5 * size).max_element();
        if outside > 0.0 {
            return -outside;
        }
        self.room.distance(point)
    }

    /// The best that voxels of 4 cm can do: its distances at every lattice point of the room.
    pub fn everywhere(&self) -> Mesh {
        let mut volume = VolumeConfig::uniform(0.04).init(&self.device).unwrap();
        let near = |brick: &IVec3| {
            let center = (brick.as_vec3() + 0.5) * volume.brick_size_m();
            self.distance_m(center).abs() < 0.5
        };
        let all = (0..57 * 57 * 57).map(|i| IVec3::new(i % 57, i / 57 % 57, i / 57 / 57) - 28);
        let bricks: Vec<IVec3> = all.filter(near).collect();
        volume
            .fill(&bricks, |point| Some((self.distance_m(point), [0; 3])))
            .unwrap();
        pollster::block_on(volume.mesh()).unwrap()
    }

    fn column(&self, values: Vec<f32>) -> Tensor<2> {
        let rows = values.len();
        Tensor::from_data(TensorData::new(values, [rows, 1]), &self.device)
    }
}

pub fn sees(view: &View, point: Vec3) -> bool {
    let point = view.world_from_camera.inverse().transform_point3(point);
    let (width, height) = (view.camera.width as f32, view.camera.height as f32);
    let pixel = view.camera.project(point);
    let inside = pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < width && pixel.y < height;
    point.z > 0.0 && point.z < 3.0 && inside
}

/// A site's place as one number that a child can check its parent by.
fn mark(site: IVec3) -> f32 {
    (site.x + 211 * site.y + 211 * 211 * site.z).rem_euclid(65_521) as f32
}

impl Network for Oracle {
    /// How many pictures.
    type Plane = usize;

    fn planes(&self, images: Tensor<4>, views: &[View]) -> [usize; 3] {
        let [count, channels, height, width] = images.dims();
        assert_eq!((count, channels), (views.len(), 3));
        let camera = views[0].camera;
        assert_eq!(
            [width, height],
            [camera.width as usize, camera.height as usize]
        );
        let brightest = images.max().into_scalar::<f32>();
        assert!((100.0..=255.0).contains(&brightest), "0 to 255, not 0 to 1");
        [count; 3]
    }

    fn stack(&self, planes: &[&usize]) -> usize {
        planes.iter().copied().sum()
    }

    fn fuse(
        &self,
        level: Level,
        plane: &usize,
        views: &[View],
        sites: &[IVec3],
        origin_m: Vec3,
    ) -> (Tensor<2>, Option<Seen>) {
        assert_eq!(*plane, views.len());
        if level == Level::Coarse {
            let points = sites
                .iter()
                .map(|site| site.as_vec3() * level.voxel_size_m() + origin_m);
            let lonely = points.filter(|&p| views.iter().filter(|view| sees(view, p)).count() < 2);
            *self.lonely.borrow_mut() += lonely.count();
            let cameras = views.iter().map(View::position_m);
            self.cameras.borrow_mut().extend(cameras);
        }
        self.blocks
            .borrow_mut()
            .push((level, views.len(), sites.len()));
        // As far as it goes: two views of everything, half sure.
        let seen = (level == Level::Fine).then(|| Seen {
            views: vec![2; sites.len()],
            confidence: Some(Tensor::full([sites.len()], 0.5, &self.device)),
        });
        let marks = sites.iter().map(|&site| mark(site)).collect();
        (self.column(marks), seen)
    }

    fn device(&self) -> Device {
        self.device.clone()
    }

    fn row_bytes(&self, _: Level) -> usize {
        size_of::<f32>()
    }

    fn guided(&self) -> bool {
        self.guided
    }

    fn decode(&self, level: Level, input: Input<'_>) -> Decoded {
        let numbers = |tensor: Tensor<2>| tensor.into_data().try_into_vec::<f32>().unwrap();
        let marks: Vec<f32> = input.sites.iter().map(|&site| mark(site)).collect();
        assert_eq!(numbers(input.fused), marks, "what views say of the site");
        assert_eq!(input.above.is_some(), level != Level::Coarse);
        if let Some((above, rows)) = input.above {
            let features = numbers(above.features.clone().select(0, rows.clone()));
            let parents = input
                .sites
                .iter()
                .map(|site| site.div_euclid(IVec3::splat(2)));
            assert_eq!(features, parents.map(mark).collect::<Vec<f32>>());
            let least = above.logit.clone().select(0, rows).min();
            assert!(least.into_scalar::<f32>() > 0.0, "an occupied parent");
        }
        let place = |site: &IVec3| site.as_vec3() * level.voxel_size_m() + input.origin_m;
        let distances = input.sites.iter().map(|site| self.distance_m(place(site)));
        let logit = |distance_m: f32| match level {
            Level::Fine => (distance_m / TRUNCATION_M / 1.05)
                .clamp(-0.95, 0.95)
                .atanh(),
            _ if self.empty => -1.0,
            // A child may lie anywhere from its parent to the next one.
            _ => TRUNCATION_M + 2.0 * level.voxel_size_m() - distance_m.abs(),
        };
        let logits = distances.map(|d| logit(d - self.off_m)).collect();
        Decoded {
            features: self.column(marks),
            logit: self.column(logits).squeeze_dim(1),
        }
    }
}

pub fn config() -> NetworkConfig {
    NetworkConfig {
        size: (160, 120),
        views_a_tile: 12,
        reach_m: 3.0,
        ..NetworkConfig::default()
    }
}

pub fn options(config: NetworkConfig) -> Options {
    Options {
        depth: Some(DepthSource::Network(config)),
        ..Options::default()
    }
}

pub fn run_with(
    scan: &Scan,
    config: NetworkConfig,
    oracle: &Oracle,
    sink: &mut Recorder,
) -> Result<Outcome, RunError> {
    let plan = recon::plan(scan, &Limits::default(), options(config)).unwrap();
    let device = Device::flex();
    pollster::block_on(recon::reconstruct(scan, &plan, oracle, &device, sink))
}

pub fn mesh_of(outcome: &Outcome) -> Mesh {
    pollster::block_on(outcome.volume.mesh()).unwrap()
}
