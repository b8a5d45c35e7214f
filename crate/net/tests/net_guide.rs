//! Stereo's depth at voxels: what the network is given, and what its word is weighed against.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use glam::{Affine3A, IVec3, Vec3};
use mesh::camera::Pinhole;
use net::View;
use net::guide::{Guidance, guide_at, surface_at};
use net::sample::GuideMap;

const CAMERA: Pinhole = Pinhole {
    width: 40,
    height: 30,
    fx: 30.0,
    fy: 30.0,
    cx: 19.5,
    cy: 14.5,
};

fn map(camera: Pinhole, depth_m: f32, confidence: f32) -> GuideMap {
    GuideMap {
        view: View {
            camera,
            world_from_camera: Affine3A::IDENTITY,
        },
        depth_m: vec![depth_m; camera.pixels()],
        confidence: vec![confidence; camera.pixels()],
    }
}

/// A wall at 2 m seen by one camera, another at 2.03 m seen by a second at the same place; voxels of 4 cm, so 12 cm of
/// truncation.
#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn the_guide_is_the_mean_of_truncated_distances() {
    let maps = [map(CAMERA, 2.0, 0.2), map(CAMERA, 2.03, 0.6)];
    let site = |z: i32| IVec3::new(0, 0, z);
    let sites = [25, 49, 52, 53, 60, -5].map(site);
    let said: Vec<[f32; 2]> = guide_at(&sites, 0.04, Vec3::ZERO, &maps)
        .into_iter()
        .map(Guidance::channels)
        .collect();
    let blend = |near: f32, far: f32| (0.2 * near + 0.6 * far) / 0.8;
    let expected = [
        [1.0, 0.8],
        [blend(0.04 / 0.12, 0.07 / 0.12), 0.8],
        [blend(-0.08 / 0.12, -0.05 / 0.12), 0.8],
        // 12 cm behind the nearer wall is the last that it speaks of; rounding decides, so look at the next.
        said[3],
        [0.0, 0.0],
        [0.0, 0.0],
    ];
    let error = common::relative_error(said.as_flattened(), expected.as_flattened());
    assert!(error < 1e-4, "relative error {error}: {said:?}");
    assert!((0.6..=0.8).contains(&said[3][1]));
    let sure = [map(CAMERA, 2.0, 0.9), map(CAMERA, 2.0, 0.9)];
    let said = guide_at(&[site(50), IVec3::new(500, 0, 50)], 0.04, Vec3::ZERO, &sure);
    let [distance, weight] = said[0].channels();
    assert!(
        distance.abs() < 1e-4 && weight == 1.0,
        "the weight is cut at 1: {said:?}"
    );
    assert_eq!(said[1], Guidance::default(), "no camera sees it");
}

/// A map at 3 m has a quarter of the word of one within 1.5 m where surfaces are weighed; the network is given both alike.
#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn near_maps_say_more_of_where_the_surface_is() {
    let (near, far) = (map(CAMERA, 1.0, 0.8), map(CAMERA, 3.0, 0.8));
    let site = |z: i32| [IVec3::new(0, 0, z)];
    let weight = |says: Vec<Guidance>| says[0].weight;
    let both = [near, far];
    assert!((weight(guide_at(&site(24), 0.04, Vec3::ZERO, &both)) - 1.6).abs() < 1e-5);
    assert!((weight(surface_at(&site(24), 0.04, Vec3::ZERO, &both)) - 1.0).abs() < 1e-5);
    // 4 cm before the near wall, and far from the other: a third of truncation against all of it.
    let says = surface_at(&site(24), 0.04, Vec3::ZERO, &both)[0];
    let expected = (0.8 * 0.04 / 0.12 + 0.2) / 1.0;
    assert!((says.distance - expected).abs() < 1e-3, "{says:?}");
}

/// Three certain maps count as much as the network, and none leaves its word as it is.
#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn many_sure_maps_draw_the_network_to_them() {
    let says = |distance, weight| Guidance { distance, weight };
    assert_eq!(says(0.0, 0.0).mean_with(-0.3), -0.3);
    assert!((says(0.5, 3.0).mean_with(-0.3) - 0.1).abs() < 1e-6);
    assert!((says(0.5, 600.0).mean_with(-0.3) - 0.5).abs() < 0.01);
}
