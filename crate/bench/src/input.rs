//! Pictures, cameras and voxels of a stated size, the same on every device.

use burn::tensor::{Device, Tensor, TensorData};
use glam::{Affine3A, IVec3, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::{Level, View, planes::Plane};

/// Fine voxels along an edge of the piece of a room: 1.6 m, the least multiple of four coarse voxels above the paper's 1.5 m.
pub const EDGE: i32 = 40;

/// `7919 i` modulo 251, without the product, which 32 bits would not hold.
fn remainder(i: usize) -> f32 {
    (i % 251 * 7919 % 251) as f32
}

/// One picture `[1, 3, height, width]` of numbers from 0 to 250.
pub fn image((width, height): (u32, u32), device: &Device) -> Tensor<4> {
    let (width, height) = (width as usize, height as usize);
    let values: Vec<f32> = (0..3 * width * height).map(remainder).collect();
    Tensor::from_data(TensorData::new(values, [1, 3, height, width]), device)
}

/// `count` cameras on a circle around the piece that look at its middle.
pub fn around((width, height): (u32, u32), count: usize, edge: i32) -> Vec<View> {
    let camera = Pinhole {
        width,
        height,
        fx: 0.9 * width as f32,
        fy: 0.9 * width as f32,
        cx: 0.5 * (width as f32 - 1.0),
        cy: 0.5 * (height as f32 - 1.0),
    };
    let middle = Vec3::splat(0.5 * edge as f32 * Level::Fine.voxel_size_m());
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

/// The planes of one picture as those of `count`.
pub fn many(plane: &Plane, count: usize) -> Plane {
    let repeat = |planes: &Tensor<4>| planes.clone().repeat_dim(0, count);
    Plane {
        base: repeat(&plane.base),
        hidden: plane.hidden.as_ref().map(repeat),
        confidence: plane.confidence.as_ref().map(repeat),
    }
}

/// All sites of a cube of `edge` sites.
pub fn cube(edge: i32) -> Vec<IVec3> {
    (0..edge * edge * edge)
        .map(|i| IVec3::new(i % edge, i / edge % edge, i / (edge * edge)))
        .collect()
}

/// The row of the site above, in a cube of half as many sites along its edge.
pub fn parent(site: IVec3, edge: i32) -> i32 {
    let above = site / 2;
    let edge = edge / 2;
    above.x + edge * (above.y + edge * above.z)
}

/// Numbers between -0.5 and 0.5.
pub fn numbers<const D: usize>(shape: [usize; D], device: &Device) -> Tensor<D> {
    let count = shape.iter().product::<usize>();
    let values: Vec<f32> = (0..count).map(|i| remainder(i) / 251.0 - 0.5).collect();
    Tensor::from_data(TensorData::new(values, shape), device)
}
