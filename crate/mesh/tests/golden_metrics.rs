//! Sampling, rendering, metrics and protocols against numbers from NumPy and SciPy (tests/reference/metrics.py).

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use mesh::camera::Pinhole;
use mesh::metrics::{Depth2d, Surface3d, compare_points, depth, depth_2d, robustness};
use mesh::protocol::{self, View, Visibility};
use mesh::raster::{self, Cull};
use mesh::{Bounds, Mesh, sample};
use serde_json::Value;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../../tests/golden/metrics.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn floats(value: &Value) -> Vec<f32> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|v| number(v) as f32).collect()
}

fn points(value: &Value) -> Vec<Vec3> {
    let rows = value.as_array().unwrap().iter();
    rows.map(|row| Vec3::from_slice(&floats(row))).collect()
}

fn stored_mesh(value: &Value) -> Mesh {
    let triangles = value["triangles"].as_array().unwrap().iter();
    Mesh {
        positions: points(&value["positions"]),
        triangles: triangles
            .map(|row| [0, 1, 2].map(|k| row[k].as_u64().unwrap() as u32))
            .collect(),
        ..Mesh::default()
    }
}

fn stored_view(value: &Value) -> View {
    let k = |name: &str| number(&value["camera"][name]) as f32;
    let rows = &value["camera_from_world"];
    let column = |c: usize| Vec3A::from_array([0, 1, 2].map(|r| number(&rows[r][c]) as f32));
    View {
        camera: Pinhole {
            width: k("width") as u32,
            height: k("height") as u32,
            fx: k("fx"),
            fy: k("fy"),
            cx: k("cx"),
            cy: k("cy"),
        },
        camera_from_world: Affine3A {
            matrix3: Mat3A::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        },
    }
}

/// `share_tolerance`: which share of points may fall on the other side of a threshold by f32 rounding.
fn assert_surface(found: &Surface3d, expected: &Value, share_tolerance: f64) {
    let found = serde_json::to_value(found).unwrap();
    for (name, expected) in expected.as_object().unwrap() {
        let tolerance = match name.as_str() {
            "precision" | "recall" | "f_score" => share_tolerance,
            "predicted_points" | "ground_truth_points" => share_tolerance * number(expected),
            _ => 2e-6 + share_tolerance,
        };
        let (found, expected) = (number(&found[name]), number(expected));
        assert!(
            (found - expected).abs() <= tolerance,
            "{name}: expected {expected}, found {found}"
        );
    }
}

#[test]
fn sampling_draws_the_documented_points() {
    let golden = golden();
    let seed = golden["seed"].as_u64().unwrap();
    let mut uniform = sample::Uniform::new(seed);
    for expected in golden["uniforms"].as_array().unwrap() {
        assert_eq!(uniform.next(), number(expected));
    }
    let drawn = sample::surface(&stored_mesh(&golden["pred"]), 5, seed);
    for (found, expected) in drawn.iter().zip(points(&golden["samples"])) {
        assert!(found.distance(expected) < 1e-6, "{found} {expected}");
    }
}

#[test]
fn surface_metrics_agree() {
    let golden = golden();
    let (pred, gt) = (stored_mesh(&golden["pred"]), stored_mesh(&golden["gt"]));
    let clipped = compare_points(&pred.positions, &gt.positions, 0.05, Some(1.0));
    assert_surface(&clipped, &golden["vertices_clipped"], 1e-12);
}

#[test]
fn protocols_agree() {
    let golden = golden();
    let (pred, gt) = (stored_mesh(&golden["pred"]), stored_mesh(&golden["gt"]));
    let seed = golden["seed"].as_u64().unwrap();

    let plain = protocol::plain(&pred, &gt, 2000, seed);
    assert_surface(&plain, &golden["plain_2000"], 1e-12);

    let everywhere = protocol::transformer_fusion(&pred, &gt, None, seed);
    assert_surface(&everywhere, &golden["transformer_fusion"], 1e-5);
    let seen = protocol::transformer_fusion(&pred, &gt, Some(&visibility(&golden)), seed);
    assert_surface(&seen, &golden["transformer_fusion_visible"], 1e-4);

    let cloud = |mesh: &Mesh, seed| Mesh {
        positions: sample::surface(mesh, 2000, seed),
        ..Mesh::default()
    };
    let vortx = protocol::vortx_compare(&cloud(&pred, seed), &cloud(&gt, seed + 1));
    assert_surface(&vortx, &golden["vortx"], 1e-12);
}

fn visibility(golden: &Value) -> Visibility {
    let expected = &golden["visibility"];
    let frames = golden["views"].as_array().unwrap().iter().map(|value| {
        let view = stored_view(value);
        let depth_m = floats(&value["depth_m"]);
        (view.camera, view.camera_from_world, depth_m)
    });
    let corner = |name: &str| Vec3::from_slice(&floats(&expected[name]));
    let bounds = Bounds {
        min: corner("min"),
        max: corner("max"),
    };
    let [voxel_m, behind_m] = ["voxel_m", "behind_m"].map(|name| number(&expected[name]) as f32);
    Visibility::from_depth(frames, bounds, voxel_m, behind_m)
}

#[test]
fn visibility_agrees_at_every_probe() {
    let golden = golden();
    let (expected, found) = (&golden["visibility"], visibility(&golden));
    // A point or two may lie on the edge of a pixel.
    let count = number(&expected["observed_points"]);
    assert!((found.observed_points() as f64 - count).abs() <= 2.0);
    let answers = floats(&expected["visible"]);
    for (probe, answer) in points(&expected["probes"]).into_iter().zip(answers) {
        assert_eq!(found.visible(probe), answer == 1.0, "{probe}");
    }
}

/// Rays through silhouettes may go either way by rounding; everything else must agree.
fn assert_depth(found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    let differing = found
        .iter()
        .zip(expected)
        .filter(|(f, e)| (*f - *e).abs() > 1e-3);
    let differing = differing.count();
    assert!(
        differing <= 2,
        "{differing} of {} pixels differ",
        found.len()
    );
}

#[test]
fn rendered_depth_agrees_with_ray_casting() {
    let golden = golden();
    let (pred, gt) = (stored_mesh(&golden["pred"]), stored_mesh(&golden["gt"]));
    let views = golden["views"].as_array().unwrap();
    for value in views {
        let found = protocol::vortx_render(&gt, &stored_view(value));
        let expected = floats(&value["depth_m"]);
        assert!(expected.iter().filter(|&&d| d > 0.0).count() > 100);
        assert_depth(&found, &expected);
    }
    let view = stored_view(&views[0]);
    let (camera, pose) = (&view.camera, &view.camera_from_world);
    let both_sides = raster::depth(&pred, camera, pose, Cull::None, 0.05);
    assert_depth(&both_sides, &floats(&golden["pred_depth_both_sides_m"]));

    // The mask keeps the prediction where the ground truth is seen, and nothing else.
    let masked = protocol::vortx_masked_depths(&pred, &gt, &view);
    let raw = protocol::vortx_render(&pred, &view);
    let truth = protocol::vortx_render(&gt, &view);
    for ((masked, raw), truth) in masked.iter().zip(&raw).zip(&truth) {
        assert_eq!(*masked, if *truth > 0.0 { *raw } else { 0.0 });
    }
    assert_ne!(masked, raw);
}

fn assert_depth_figures(found: &Depth2d, expected: &Value) {
    let found = serde_json::to_value(found).unwrap();
    for (name, expected) in expected.as_object().unwrap() {
        let (found, expected) = (number(&found[name]), number(expected));
        let both_unknown = found.is_nan() && expected.is_nan();
        assert!(
            both_unknown || (found - expected).abs() < 1e-6,
            "{name}: expected {expected}, found {found}"
        );
    }
}

#[test]
fn depth_metrics_agree_and_their_mean_skips_what_is_unknown() {
    let golden = golden();
    let mut frames = Vec::new();
    for map in golden["depth_maps"].as_array().unwrap() {
        let found = depth_2d(&floats(&map["pred"]), &floats(&map["gt"])).unwrap();
        assert_depth_figures(&found, &map["expected"]);
        frames.push(found);
    }
    assert!(frames.iter().any(|frame| frame.abs_rel.is_nan()));
    let mean = depth::mean(&frames).unwrap();
    assert_depth_figures(&mean, &golden["depth_mean"]);

    assert_eq!(
        depth_2d(&[1.0], &[1.0, 1.0]),
        None,
        "maps of different size"
    );
    assert_eq!(depth::mean(&[]), None);
}

#[test]
fn stability_figures_of_the_papers_table_5() {
    use robustness::{Deviation, coefficient_of_variation as variation};
    for (method, row) in golden()["robustness"].as_object().unwrap() {
        let metrics = ["precision", "recall", "f_score"].map(|name| {
            let values = row[name].as_array().unwrap().iter();
            values.map(number).collect::<Vec<f64>>()
        });
        let [_, _, f] = &metrics;
        let few_and_many = metrics.each_ref().map(|values| (values[0], values[2]));
        let found = [
            ("cv_sample", variation(f, Deviation::Sample)),
            ("cv_population", variation(f, Deviation::Population)),
            ("retention_f", robustness::performance_retention(f[0], f[2])),
            (
                "mean_retention",
                robustness::mean_performance_retention(&few_and_many),
            ),
            ("max_drop", robustness::max_drop(f[0], f[2])),
            (
                "stability_index",
                robustness::stability_index(&metrics.each_ref().map(Vec::as_slice)),
            ),
        ];
        for (name, found) in found {
            let expected = number(&row[name]);
            assert!(
                (found - expected).abs() < 1e-12,
                "{method} {name}: {found} {expected}"
            );
        }
    }
}
