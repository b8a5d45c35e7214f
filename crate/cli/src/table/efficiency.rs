//! The paper's Table 6: what a picture and what a piece of a room cost.

use super::{
    grid::Grid,
    layout::{Kind, Table},
    method::Method,
};
use crate::size::Size;
use burn::tensor::{Device, Tensor, TensorData};
use glam::{Affine3A, IVec3, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::{
    Ipdrecon, Level, View,
    fusion::{Pairs, Pooling},
    planes::Plane,
};
use serde_json::json;
use std::time::Instant;

/// The paper's pictures.
const SIZE: (u32, u32) = (640, 480);
/// Fine voxels along an edge of the piece: 1.6 m, the least multiple of four coarse voxels above the paper's 1.5 m.
const EDGE: i32 = 40;
const WARM_UP: usize = 2;
const RUNS: usize = 9;

/// Milliseconds of every network's parts on `device`.
pub fn table(
    methods: &[Method],
    views: &[usize],
    size: Option<Size>,
    device: &Device,
    device_name: &str,
) -> Table {
    let size = size.map_or(SIZE, |size| size.0);
    let mut head = vec![
        "".to_owned(),
        "picture (ms)".to_owned(),
        "pictures/s".to_owned(),
    ];
    head.extend(
        views
            .iter()
            .map(|views| format!("1.6 m, {views} views (ms)")),
    );
    let mut found = Vec::new();
    let mut figures = Vec::new();
    for method in methods {
        let mut row = vec![method.name.clone()];
        if let Some(network) = method.as_network() {
            let picture_ms = picture_ms(network, size, device);
            row.extend([
                format!("{picture_ms:.1}"),
                format!("{:.1}", 1e3 / picture_ms),
            ]);
            for &views in views {
                let piece_ms = piece_ms(network, size, views, device);
                row.push(format!("{piece_ms:.1}"));
                figures.push(json!({
                        "method": method.name, "picture_ms": picture_ms, "views": views, "piece_ms": piece_ms,
                    }));
            }
        }
        found.push(row);
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let note = format!(
        "Medians of {RUNS} runs after {WARM_UP}; results are read back in each. A picture of {}x{}: its feature planes (backbone, pyramid, PCE, ACM, IPSD), one at a \
         time. A piece of 1.6 m with everything occupied: back-projection, fusion of the views and the 3D networks of all three levels; {}; version {}, commit {}.",
        size.0,
        size.1,
        device_name,
        env!("CARGO_PKG_VERSION"),
        env!("IPDRECON_COMMIT"),
    );
    Table {
        kind: Kind::Efficiency.name(),
        grids: vec![Grid::new(&head, found)],
        notes: vec![note],
        cells: json!(figures),
    }
}

fn median_ms(mut run: impl FnMut()) -> f64 {
    for _ in 0..WARM_UP {
        run();
    }
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let started = Instant::now();
            run();
            started.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

/// Waits for a tensor by reading one of its numbers.
fn wait<const D: usize>(tensor: &Tensor<D>) {
    let first = tensor.clone().flatten::<1>(0, D - 1).narrow(0, 0, 1);
    drop(first.into_data());
}

/// Cameras on a circle around the piece that look at its middle.
fn around((width, height): (u32, u32), count: usize) -> Vec<View> {
    let camera = Pinhole {
        width,
        height,
        fx: 0.9 * width as f32,
        fy: 0.9 * width as f32,
        cx: 0.5 * (width as f32 - 1.0),
        cy: 0.5 * (height as f32 - 1.0),
    };
    let middle = Vec3::splat(0.5 * EDGE as f32 * Level::Fine.voxel_size_m());
    let place = |i: usize| {
        let angle = std::f32::consts::TAU * i as f32 / count as f32;
        let ahead = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let turn = Mat3::from_cols(ahead.cross(Vec3::Z), -Vec3::Z, ahead);
        View {
            camera,
            world_from_camera: Affine3A::from_mat3_translation(turn, middle - 2.5 * ahead),
        }
    };
    (0..count).map(place).collect()
}

fn images((width, height): (u32, u32), device: &Device) -> Tensor<4> {
    let (width, height) = (width as usize, height as usize);
    let values: Vec<f32> = (0..3 * width * height)
        .map(|i| (i * 7919 % 251) as f32)
        .collect();
    Tensor::from_data(TensorData::new(values, [1, 3, height, width]), device)
}

fn picture_ms(network: &Ipdrecon, size: (u32, u32), device: &Device) -> f64 {
    let images = images(size, device);
    let views = around(size, 1);
    median_ms(|| {
        for plane in network.planes(images.clone(), &views) {
            wait(&plane.base);
            plane.hidden.iter().for_each(wait);
        }
    })
}

fn piece_ms(network: &Ipdrecon, size: (u32, u32), count: usize, device: &Device) -> f64 {
    let one = network.planes(images(size, device), &around(size, 1));
    let planes = one.map(|plane| many(&plane, count));
    let views = around(size, count);
    median_ms(|| {
        let mut above = None;
        for level in Level::ALL {
            let edge = EDGE >> (2 - level as i32);
            let sites: Vec<IVec3> = (0..edge * edge * edge)
                .map(|i| IVec3::new(i % edge, i / edge % edge, i / (edge * edge)))
                .collect();
            let plane = &planes[level as usize];
            let [_, _, height, width] = plane.base.dims();
            let voxel_m = level.voxel_size_m();
            let pairs = Pairs::find(
                &sites,
                voxel_m,
                Vec3::ZERO,
                &views,
                [width, height],
                level.stride(),
            );
            let fused = network.fuse(level, plane, &pairs.on(device), Pooling::Softmax);
            let parents: Vec<i32> = sites.iter().map(|site| parent(*site, edge)).collect();
            let parents = Tensor::from_data(TensorData::from(parents.as_slice()), device);
            let from = above.as_ref().map(|decoded| (decoded, parents));
            let input = network.input(fused.features, from, None);
            above = Some(network.decode(level, input, &sites));
        }
        if let Some(decoded) = &above {
            wait(&decoded.logit);
        }
    })
}

/// The planes of one picture as those of `count`.
fn many(plane: &Plane, count: usize) -> Plane {
    let repeat = |planes: &Tensor<4>| planes.clone().repeat_dim(0, count);
    Plane {
        base: repeat(&plane.base),
        hidden: plane.hidden.as_ref().map(repeat),
        confidence: plane.confidence.as_ref().map(repeat),
    }
}

/// The row of the site above, in a box of half as many sites along an edge.
fn parent(site: IVec3, edge: i32) -> i32 {
    let above = site / 2;
    let edge = edge / 2;
    above.x + edge * (above.y + edge * above.z)
}
