//! A walk through a room made by rule whose pictures and poses a test may spoil one by one, and how good the depth is that
//! comes of it, against the room itself.

use crate::common::{Recorder, open};
use burn::tensor::Device;
use glam::{Mat3, Quat, Vec3};
use recon::{DepthSource, Limits, Options, Outcome, RunError};
use scan::{MemorySource, Scan};
use std::{collections::BTreeMap, fmt::Write as _};
use stereo::{DepthMap, StereoConfig};
use synth::{Room, View};

/// Pictures of a whole walk of two turns, of which a test takes the first few: 10 degrees and 25 cm apart.
const WHOLE_WALK: usize = 72;
const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

/// One picture with what it was taken from and what the scan says it was taken from.
#[derive(Clone)]
pub struct Shot {
    /// Where it was taken.
    pub view: View,
    /// sRGB, row by row.
    pub rgb: Vec<[u8; 3]>,
    /// Distance along the optical axis in metres, exact, row by row.
    pub depth_m: Vec<f32>,
    /// The rotation in the scan's files, world from camera.
    pub told_rotation: Mat3,
    /// The place in the scan's files, in metres.
    pub told_position_m: Vec3,
}

impl Shot {
    fn new(room: &Room, view: View) -> Self {
        let frame = synth::render(room, &view);
        Self {
            view,
            rgb: frame.color,
            depth_m: frame.depth_m,
            told_rotation: view.rotation,
            told_position_m: view.position_m,
        }
    }

    /// Tells a pose that is off by `right_m` along the camera's right and by a turn of `degrees` about its own vertical.
    pub fn misplace(&mut self, right_m: f32, degrees: f32) {
        self.told_position_m += self.told_rotation.x_axis * right_m;
        self.told_rotation *= Mat3::from_quat(Quat::from_rotation_y(degrees.to_radians()));
    }

    /// Changes every channel of every pixel.
    pub fn expose(&mut self, change: impl Fn(usize, f32) -> f32) {
        for pixel in &mut self.rgb {
            for (channel, value) in pixel.iter_mut().enumerate() {
                *value = change(channel, f32::from(*value)).round().clamp(0.0, 255.0) as u8;
            }
        }
    }

    /// Mean over `length` pixels along x, as when the camera turns while the shutter is open.
    pub fn blur(&mut self, length: usize) {
        let (width, half) = (WIDTH as usize, length / 2);
        for row in self.rgb.chunks_exact_mut(width) {
            let sharp = row.to_vec();
            for (x, pixel) in row.iter_mut().enumerate() {
                let near = &sharp[x.saturating_sub(half)..(x + half + 1).min(width)];
                for (channel, value) in pixel.iter_mut().enumerate() {
                    let sum: usize = near.iter().map(|p| usize::from(p[channel])).sum();
                    *value = (sum / near.len()) as u8;
                }
            }
        }
    }

    /// One grey where `flat` says so of a point of the room, with a sensor's noise of `sigma` grey levels; `seed` makes
    /// the noise another one in each picture.
    pub fn paint(&mut self, sigma: f32, seed: usize, flat: impl Fn(Vec3) -> bool) {
        let mut noise = Noise::new(seed);
        for (i, pixel) in self.rgb.iter_mut().enumerate() {
            let (u, v) = (i as u32 % WIDTH, i as u32 / WIDTH);
            let ray = self.view.ray(u as f32, v as f32);
            if flat(self.view.position_m + ray * self.depth_m[i]) {
                *pixel = [(150.0 + sigma * noise.bell()).round() as u8; 3];
            }
        }
    }
}

/// Random numbers that are the same on every machine.
struct Noise(u64);

impl Noise {
    fn new(seed: usize) -> Self {
        Self(0x9E37_79B9_7F4A_7C15 ^ ((seed as u64 + 1) << 32))
    }

    /// Uniform in 0..1 (Marsaglia's xorshift64).
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Nearly normal, of variance 1: twelve uniform draws.
    fn bell(&mut self) -> f32 {
        (0..12).map(|_| self.unit()).sum::<f32>() - 6.0
    }
}

/// The pictures of a walk by the number in their name.
#[derive(Clone)]
pub struct Walk {
    pub room: Room,
    pub shots: BTreeMap<usize, Shot>,
}

impl Walk {
    /// The first `count` pictures of the walk through the room that `seed` names.
    pub fn new(seed: u64, count: usize) -> Self {
        let room = Room::new(seed);
        let views = synth::path(&room, WHOLE_WALK, WIDTH, HEIGHT);
        let shots = views[..count].iter().map(|&view| Shot::new(&room, view));
        let shots = shots.enumerate().collect();
        Self { room, shots }
    }

    /// The same with one picture changed.
    pub fn with(&self, number: usize, change: impl FnOnce(&mut Shot)) -> Self {
        let mut walk = self.clone();
        change(walk.shots.get_mut(&number).unwrap());
        walk
    }

    /// The same without one picture.
    pub fn without(&self, number: usize) -> Self {
        let mut walk = self.clone();
        walk.shots.remove(&number).unwrap();
        walk
    }

    /// The scan folder of it, in the room's own world.
    pub fn scan(&self) -> Scan {
        let mut files = Vec::new();
        for (number, shot) in &self.shots {
            let c = shot.view.camera;
            let k = format!("{} 0 {}\n0 {} {}\n0 0 1\n", c.fx, c.cx, c.fy, c.cy);
            files.push(("camera-intrinsics.txt".to_owned(), k.into_bytes()));
            let mut pose = String::new();
            for row in 0..3 {
                let r = shot.told_rotation.row(row);
                let t = shot.told_position_m[row];
                writeln!(pose, "{} {} {} {t}", r.x, r.y, r.z).unwrap();
            }
            pose.push_str("0 0 0 1\n");
            files.push((format!("frame-{number:06}.pose.txt"), pose.into_bytes()));
            files.push((format!("frame-{number:06}.color.png"), png(&shot.rgb)));
        }
        open(MemorySource::new(files))
    }

    /// Depth from colour, fused; on the CPU.
    pub fn run(&self, config: StereoConfig) -> Ran {
        let scan = self.scan();
        let options = Options {
            depth: Some(DepthSource::Stereo(config)),
            ..Options::default()
        };
        let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
        let mut sink = Recorder::default();
        let device = Device::flex();
        let run = recon::run(&scan, &plan, &device, &mut sink);
        let outcome = pollster::block_on(run);
        Ran {
            keyframes: plan.keyframes.len(),
            scan,
            outcome,
            maps: sink.maps,
            findings: sink.findings,
        }
    }

    /// Where a map was truly taken, at its own size, and the true depth there in metres.
    pub fn truth(&self, ran: &Ran, map: &DepthMap) -> (View, Vec<f32>) {
        let view = View {
            camera: map.camera,
            ..self.shots[&ran.number(map)].view
        };
        (view, synth::depth(&self.room, &view))
    }

    /// How good the kept depth of one map is where `of` says so of the true points.
    pub fn quality(&self, ran: &Ran, map: &DepthMap, of: impl Fn(Vec3) -> bool) -> Quality {
        let (view, truth_m) = self.truth(ran, map);
        let mut quality = Quality::default();
        for (i, (&z, &found)) in truth_m.iter().zip(&map.depth_m).enumerate() {
            let (u, v) = (i as u32 % view.camera.width, i as u32 / view.camera.width);
            if of(view.position_m + view.ray(u as f32, v as f32) * z) {
                quality.add(z, found);
            }
        }
        quality
    }

    /// The same over all maps but those of the frames in `but`.
    pub fn quality_but(&self, ran: &Ran, but: &[usize], of: impl Fn(Vec3) -> bool) -> Quality {
        let mut quality = Quality::default();
        for map in ran.maps.iter().filter(|m| !but.contains(&ran.number(m))) {
            quality.take(&self.quality(ran, map, &of));
        }
        quality
    }
}

/// What a run left.
pub struct Ran {
    pub scan: Scan,
    pub keyframes: usize,
    pub outcome: Result<Outcome, RunError>,
    pub maps: Vec<DepthMap>,
    pub findings: Vec<scan::Finding>,
}

impl Ran {
    /// The number in the name of a map's frame.
    pub fn number(&self, map: &DepthMap) -> usize {
        let name = &self.scan.frames()[map.frame].name;
        name.rsplit('-').next().unwrap().parse().unwrap()
    }

    /// The map of a numbered frame.
    pub fn map(&self, number: usize) -> Option<&DepthMap> {
        self.maps.iter().find(|map| self.number(map) == number)
    }

    /// Share of the mesh's vertices within 5 cm of the room's surface, and its area in square metres.
    pub fn mesh(&self, room: &Room) -> (f32, f64) {
        let volume = &self.outcome.as_ref().unwrap().volume;
        let mut mesh = pollster::block_on(volume.mesh()).unwrap();
        mesh.transform(&self.scan.scan_from_canonical());
        let near = |p: &&Vec3| room.distance(**p).abs() < 0.05;
        let right = mesh.positions.iter().filter(near).count();
        (right as f32 / mesh.positions.len() as f32, mesh.area())
    }
}

/// Counts behind figures of depth that was kept.
#[derive(Clone, Copy, Default)]
pub struct Quality {
    pixels: f64,
    kept: f64,
    right: f64,
    close: f64,
    relative: f64,
}

impl Quality {
    /// Counts a pixel; a depth of 0 is one that was not kept.
    pub fn add(&mut self, truth_m: f32, found_m: f32) {
        self.pixels += 1.0;
        if found_m != 0.0 {
            assert!(found_m.is_finite() && found_m > 0.0, "a depth of {found_m}");
            let error_m = f64::from((found_m - truth_m).abs());
            let z = f64::from(truth_m);
            self.kept += 1.0;
            self.relative += error_m / z;
            self.right += f64::from(u8::from(error_m < (0.05 * z).max(0.05)));
            let ratio = (found_m / truth_m).max(truth_m / found_m);
            self.close += f64::from(u8::from(ratio < 1.25));
        }
    }

    fn take(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.kept += other.kept;
        self.right += other.right;
        self.close += other.close;
        self.relative += other.relative;
    }

    /// Share of the pixels with a depth.
    pub fn coverage(&self) -> f64 {
        self.kept / self.pixels
    }

    /// Share of the kept depth within 5 % or 5 cm of the truth.
    pub fn precision(&self) -> f64 {
        self.right / self.kept
    }

    /// Mean of the error over the true depth, of what is kept.
    pub fn abs_rel(&self) -> f64 {
        self.relative / self.kept
    }

    /// Share of the kept depth within a factor of 1.25 of the truth.
    pub fn delta(&self) -> f64 {
        self.close / self.kept
    }
}

impl std::fmt::Display for Quality {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "AbsRel {:.4}, d<1.25 {:.4}, precision {:.4}, coverage {:.4}",
            self.abs_rel(),
            self.delta(),
            self.precision(),
            self.coverage()
        )
    }
}

fn png(rgb: &[[u8; 3]]) -> Vec<u8> {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, WIDTH, HEIGHT);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::NoCompression);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(rgb.as_flattened()).unwrap();
    writer.finish().unwrap();
    png
}
