//! The whole network with all of its parts, against tests/reference/net_model.py.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::tensor::{Device, Int, Tensor, TensorData};
use common::{digests::Digests, filled, numbers};
use glam::{Affine3A, EulerRot, IVec3, Quat, Vec3, ivec3};
use mesh::camera::Pinhole;
use net::fusion::{Pairs, Pooling};
use net::{Ipdrecon, Level, NetConfig, View, decode};

const WIDTH: usize = 72;
const HEIGHT: usize = 56;

fn config() -> NetConfig {
    NetConfig {
        backbone: [8, 6, 10, 12, 20],
        pyramid: 20,
        planes: [24, 16, 8],
        unet: [4, 3, 2],
        matching: true,
        guide: true,
        ..NetConfig::full()
    }
}

fn views() -> Vec<View> {
    let camera = Pinhole {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        fx: 64.0,
        fy: 66.0,
        cx: 35.0,
        cy: 28.5,
    };
    let view = |(yaw, pitch, roll)| View {
        camera,
        world_from_camera: Affine3A::from_rotation_translation(
            Quat::from_euler(EulerRot::ZYX, yaw, pitch, roll),
            Vec3::new(yaw, pitch, roll),
        ),
    };
    [(0.3, 0.2, -0.1), (-1.1, 0.4, 0.7)].map(view).to_vec()
}

on_each_device! {
    async fn whole_network_is_the_reference_s(device: Device) {
        check(filled(Ipdrecon::new(&config(), &device)), 1e-4, &device).await;
    }
}

/// Of the weights only the digits that 16 bits hold.
#[cfg(not(target_family = "wasm"))]
#[test]
fn weights_in_16_bit_are_the_reference_s_to_a_hundredth() {
    let device = Device::flex();
    let model = filled(Ipdrecon::new(&config(), &device));
    let bytes = net::weights::save(&model, net::weights::Precision::F16).unwrap();
    let model = net::weights::load(&bytes, &device).unwrap();
    pollster::block_on(check(model, 1e-2, &device));
}

async fn check(model: Ipdrecon, tolerance: f32, device: &Device) {
    let golden = Digests::read(
        include_str!("../../../tests/golden/net_model.json"),
        tolerance,
    );
    let views = views();
    let shape = [views.len(), 3, HEIGHT, WIDTH];
    let images = numbers("images", shape.iter().product(), 127.0);
    let images = TensorData::new(images.iter().map(|v| v + 127.5).collect(), shape);
    let planes = model.planes(Tensor::from_data(images, device), &views);

    let mut sites: Vec<IVec3> = (0..210).map(|i| ivec3(i % 7, i / 7 % 6, i / 42)).collect();
    let mut above = None;
    for level in Level::ALL {
        let l = level as usize;
        let plane = &planes[l];
        let [_, _, height, width] = plane.base.dims();
        let origin_m = Vec3::new(-0.7, -0.5, 0.9);
        let stride = level.stride();
        let pairs = Pairs::find(
            &sites,
            level.voxel_size_m(),
            origin_m,
            &views,
            [width, height],
            stride,
        );
        let fused = model.fuse(level, plane, &pairs.on(device), Pooling::Softmax);
        golden
            .assert(&format!("fused.{l}"), fused.features.clone())
            .await;
        golden
            .assert(&format!("occupancy.{l}"), fused.occupancy)
            .await;

        let guide = numbers(&format!("guide.{l}"), 2 * sites.len(), 1.0);
        let guide = Tensor::from_data(TensorData::new(guide, [sites.len(), 2]), device);
        let from = above
            .as_ref()
            .map(|(decoded, parent): &(_, Tensor<1, Int>)| (decoded, parent.clone()));
        let input = model.input(fused.features, from, Some(guide));
        let decoded = model.decode(level, input, &sites);
        golden
            .assert(&format!("features.{l}"), decoded.features.clone())
            .await;
        golden
            .assert(&format!("logit.{l}"), decoded.logit.clone())
            .await;

        // A fixed rule instead of the logits' sign, which rounding might turn.
        let kept = |row: &i32| (sites[*row as usize] * ivec3(1, 2, 3)).element_sum() % 4 == 0;
        let rows: Vec<i32> = (0..sites.len() as i32).filter(kept).collect();
        let parents: Vec<IVec3> = rows.iter().map(|row| sites[*row as usize]).collect();
        let parent: Vec<i32> = rows.iter().flat_map(|row| [*row; 8]).collect();
        sites = decode::children(&parents);
        above = Some((decoded, Tensor::from_data(parent.as_slice(), device)));
    }
}
