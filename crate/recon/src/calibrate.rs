//! How fast a device is at the two kinds of work that a run has: fusing views into a volume, and arithmetic.

use crate::plan::{MATCH, SURFACE};
use burn::{
    Tensor,
    tensor::{DType, Device, TensorData},
};
use glam::{Affine3A, DAffine3, DVec3, IVec3, Vec3};
use mesh::camera::Pinhole;
use net::{decode::maps::submanifold, ops::sparse_conv::sparse_conv};
use scan::Camera;
use stereo::{Recipe, sweep::sweep, view::View};
use volume::{BRICK_VOXELS, DepthView, VolumeConfig};

/// A piece of work is repeated until that takes so long, so that starting it does not count, but no more often than this.
const LONG_ENOUGH_S: f64 = 0.01;
const REPEATS: usize = 256;
/// Then it is timed so often, and the best time counts.
const TRIES: usize = 3;

/// The arithmetic: a sparse convolution of the network's, over a slab of so many voxels along each axis, from so many channels to
/// as many.
const SLAB: IVec3 = IVec3::new(40, 40, 4);
const CHANNELS: usize = 16;
const TAPS: usize = 27;

/// The comparison.
const PICTURE: (u32, u32) = (96, 64);
const PLANES: usize = 32;
const SOURCES: usize = 4;

/// The view: a wall, at this distance.
const WALL_M: f32 = 2.0;
const CAMERA: Pinhole = Pinhole {
    width: 64,
    height: 48,
    fx: 64.0,
    fy: 64.0,
    cx: 31.5,
    cy: 23.5,
};

/// Lattice points a second that `device` fuses a view into; `None` for a device that fails, of which the run will say why. `now_s`
/// is a clock.
pub async fn fusing_rate(device: &Device, now_s: impl Fn() -> f64) -> Option<f64> {
    let depth_m = vec![WALL_M; CAMERA.width as usize * CAMERA.height as usize];
    let rgb = vec![128; depth_m.len() * 3];
    let view = DepthView {
        depth_m: &depth_m,
        depth_camera: CAMERA,
        confidence: None,
        color: Some((&rgb, CAMERA)),
        world_from_camera: Affine3A::IDENTITY,
    };
    let mut volume = VolumeConfig::new(0.04).init(device).ok()?;
    let mut points = 0.0;
    let mut fuse = async |repeats: usize| {
        for _ in 0..repeats {
            volume.integrate(&view).ok()?;
        }
        let bricks = volume.take_changed(usize::MAX, Vec3::ZERO);
        points = (bricks.len() * BRICK_VOXELS) as f64;
        // The number of triangles is read back: all of it is done by then.
        volume.extract(&bricks).await.ok()
    };
    let (repeats, seconds) = repeated(now_s, &mut fuse).await?;
    Some(points * (repeats as f64 + SURFACE) / seconds)
}

/// Operations a second of `device`, as [`crate::Work`] counts them. `None` for a device that fails, of which the run will say why. `now_s`
/// is a clock.
///
/// On a processor it is stereo's sweep that is timed: most of a run's time goes there, and from one kind of processor to another, a
/// browser's among them, the rest gains or loses about as much. On a GPU it is a convolution.
pub async fn arithmetic_rate(device: &Device, now_s: impl Fn() -> f64) -> Option<f64> {
    match *device == Device::flex() {
        true => sweep_rate(now_s).await,
        false => convolution_rate(device, now_s).await,
    }
}

/// Pictures of noise, compared over so many planes.
async fn sweep_rate(now_s: impl Fn() -> f64) -> Option<f64> {
    let (width, height) = PICTURE;
    let camera = Camera {
        width,
        height,
        fx: f64::from(width),
        fy: f64::from(width),
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
    };
    let pixels = width as usize * height as usize;
    let view = |index: usize| View {
        camera,
        pose: DAffine3::from_translation(DVec3::X * 0.1 * index as f64),
        gray: (0..pixels)
            .map(|p| ((p * 7919 + index) % 251) as f32)
            .collect(),
    };
    let views: [View; 1 + SOURCES] = std::array::from_fn(view);
    let sources: Vec<&View> = views[1..].iter().collect();
    let planes: Vec<f32> = (0..PLANES).map(|plane| 0.2 + plane as f32 * 0.05).collect();
    let config = Recipe::default().sweep;
    let mut compare = async |repeats: usize| {
        for _ in 0..repeats {
            sweep(&views[0], &sources, None, &planes, &config);
        }
        Some(())
    };
    let (repeats, seconds) = repeated(now_s, &mut compare).await?;
    Some((pixels * PLANES * SOURCES * repeats) as f64 * MATCH / seconds)
}

async fn convolution_rate(device: &Device, now_s: impl Fn() -> f64) -> Option<f64> {
    let sites: Vec<IVec3> = (0..SLAB.element_product())
        .map(|i| IVec3::new(i % SLAB.x, i / SLAB.x % SLAB.y, i / (SLAB.x * SLAB.y)))
        .collect();
    let map = submanifold(&sites, device);
    let filled = |shape: [usize; 2]| {
        let values = vec![0.01f32; shape[0] * shape[1]];
        Tensor::<2>::from_data(TensorData::new(values, shape), (device, DType::F32))
    };
    let features = filled([sites.len(), CHANNELS]);
    let weight = filled([TAPS * CHANNELS, CHANNELS]).reshape([TAPS, CHANNELS, CHANNELS]);
    let mut convolve = async |repeats: usize| {
        let mut rows = features.clone();
        for _ in 0..repeats {
            rows = sparse_conv(rows, weight.clone(), &map);
        }
        rows.slice([0..1, 0..1]).into_data_async().await.ok()
    };
    let (repeats, seconds) = repeated(now_s, &mut convolve).await?;
    // Voxels at the slab's faces have fewer than 27 neighbours.
    let edges = SLAB.as_dvec3().to_array().map(|edge| 3.0 * edge - 2.0);
    let pairs: f64 = edges.iter().product();
    Some(2.0 * pairs * (CHANNELS * CHANNELS * repeats) as f64 / seconds)
}

/// How often a piece of work was repeated, and the seconds that took at best: what else the machine does comes and goes.
async fn repeated<T>(
    now_s: impl Fn() -> f64,
    work: &mut impl AsyncFnMut(usize) -> Option<T>,
) -> Option<(usize, f64)> {
    // The first time kernels are compiled and memory is taken.
    work(1).await?;
    let mut repeats = 1;
    let mut best_s = f64::INFINITY;
    let mut tries = 0;
    while tries < TRIES {
        let start_s = now_s();
        work(repeats).await?;
        let seconds = (now_s() - start_s).max(1e-6);
        if seconds < LONG_ENOUGH_S && repeats < REPEATS && tries == 0 {
            repeats *= 4;
            continue;
        }
        best_s = best_s.min(seconds);
        tries += 1;
    }
    Some((repeats, best_s))
}
