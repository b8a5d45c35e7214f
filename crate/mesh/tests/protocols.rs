//! The three protocols where the answer is known: equal meshes, shifted ones, missing ones, unseen ones. And the same on
//! the ground truth of real scans.

use glam::{Affine3A, Quat, Vec3};
use mesh::camera::Pinhole;
use mesh::metrics::{Surface3d, compare_points};
use mesh::protocol::{self, View, Visibility};
use mesh::{Bounds, Mesh, ply};
use std::path::Path;

/// A square of 2 metres in the plane z = `height`, facing up, in 50 x 50 cells.
fn floor(height: f32) -> Mesh {
    const SIDE: u32 = 51;
    let place = |i: u32| i as f32 * 0.04 - 1.0;
    let cell = |i: u32| i % SIDE + 1 < SIDE && i / SIDE + 1 < SIDE;
    Mesh {
        positions: (0..SIDE * SIDE)
            .map(|i| Vec3::new(place(i % SIDE), place(i / SIDE), height))
            .collect(),
        triangles: (0..SIDE * SIDE)
            .filter(|&i| cell(i))
            .flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]])
            .collect(),
        ..Mesh::default()
    }
}

fn together(mut a: Mesh, b: Mesh) -> Mesh {
    let start = a.positions.len() as u32;
    a.positions.extend(b.positions);
    let moved = b.triangles.iter().map(|t| t.map(|index| index + start));
    a.triangles.extend(moved);
    a
}

/// A camera 2 metres above the floor's middle, looking straight down.
fn above() -> View {
    let camera = Pinhole {
        width: 80,
        height: 80,
        fx: 60.0,
        fy: 60.0,
        cx: 39.5,
        cy: 39.5,
    };
    let down = Quat::from_rotation_x(std::f32::consts::PI);
    View {
        camera,
        camera_from_world: Affine3A::from_rotation_translation(down, Vec3::new(0.0, 0.0, 2.0)),
    }
}

fn scores(pred: &Mesh, gt: &Mesh) -> [Surface3d; 3] {
    [
        protocol::plain(pred, gt, 20_000, 1),
        protocol::transformer_fusion(pred, gt, None, 1),
        protocol::vortx_compare(pred, gt),
    ]
}

#[test]
fn a_perfect_reconstruction_scores_one() {
    for score in scores(&floor(0.0), &floor(0.0)) {
        assert_eq!(score.f_score, 1.0, "{score:?}");
        assert!(score.chamfer_m < 0.01, "{score:?}");
    }
}

#[test]
fn four_centimetres_off_is_right_and_six_is_wrong() {
    // Vertices are 4 cm apart, so from above the middle of a cell the nearest is 4.9 cm away.
    for score in scores(&floor(0.04), &floor(0.0)) {
        assert_eq!(score.f_score, 1.0, "{score:?}");
        assert!((0.0399..0.045).contains(&score.chamfer_m), "{score:?}");
    }
    for score in scores(&floor(0.055), &floor(0.0)) {
        assert_eq!(
            (score.precision, score.recall, score.f_score),
            (0.0, 0.0, 0.0)
        );
    }
}

#[test]
fn nothing_predicted_finds_nothing() {
    let [plain, clipped, vortx] = scores(&Mesh::default(), &floor(0.0));
    for score in [plain, clipped, vortx] {
        assert_eq!(
            (score.precision, score.recall, score.f_score),
            (1.0, 0.0, 0.0)
        );
        assert_eq!(score.predicted_points, 0);
    }
    assert!(plain.chamfer_m.is_nan() && vortx.chamfer_m.is_nan());
    assert_eq!(clipped.chamfer_m, 1.0);
    let no_truth = compare_points(&[Vec3::ZERO], &[], 0.05, Some(1.0));
    assert_eq!(
        (no_truth.precision, no_truth.f_score, no_truth.accuracy_m),
        (0.0, 0.0, 1.0)
    );
}

#[test]
fn what_no_frame_observed_is_not_held_against_a_prediction() {
    let gt = floor(0.0);
    // Half a metre under the floor nobody looked.
    let pred = together(floor(0.0), floor(-0.5));
    let view = above();
    let depth_m = protocol::vortx_render(&gt, &view);
    let bounds = Bounds {
        min: Vec3::new(-1.2, -1.2, -1.0),
        max: Vec3::new(1.2, 1.2, 1.0),
    };
    let frames = std::iter::once((view.camera, view.camera_from_world, depth_m.clone()));
    let visibility = Visibility::from_depth(frames, bounds, 0.04, 0.12);
    assert!(
        visibility.visible(Vec3::new(0.1, 0.2, 0.0)),
        "on the surface"
    );
    assert!(
        visibility.visible(Vec3::new(0.1, 0.2, 0.9)),
        "in front of it"
    );
    assert!(!visibility.visible(Vec3::new(0.1, 0.2, -0.3)), "behind it");
    assert!(
        !visibility.visible(Vec3::new(1.15, 0.0, 0.0)),
        "where there was no depth"
    );
    assert!(
        !visibility.visible(Vec3::new(0.0, 0.0, 1.5)),
        "off the lattice"
    );

    let blamed = protocol::transformer_fusion(&pred, &gt, None, 1);
    assert!((blamed.precision - 0.5).abs() < 0.01, "{blamed:?}");
    let fair = protocol::transformer_fusion(&pred, &gt, Some(&visibility), 1);
    assert_eq!(fair.precision, 1.0, "{fair:?}");
    assert!(fair.predicted_points < blamed.predicted_points / 2 + 1000);

    // A stray vertex a thousand kilometres away makes the lattice vast, and no difference.
    let vast = Bounds {
        max: Vec3::splat(1e6),
        ..bounds
    };
    let frames = std::iter::once((view.camera, view.camera_from_world, depth_m.clone()));
    let stray = Visibility::from_depth(frames, vast, 0.04, 0.12);
    assert!(stray.visible(Vec3::new(0.1, 0.2, 0.0)));
    assert!(!stray.visible(Vec3::new(0.1, 0.2, -0.3)));
    assert!(!stray.visible(Vec3::splat(9e5)));

    // With nothing visible at all the scene is scored as if there were no mask.
    let blind = Visibility::from_depth(std::iter::empty(), bounds, 0.04, 0.12);
    assert_eq!(
        protocol::transformer_fusion(&pred, &gt, Some(&blind), 1),
        blamed
    );
}

#[test]
fn vortx_masks_directions_in_which_the_ground_truth_is_empty() {
    let view = above();
    let mut half = floor(0.0);
    half.triangles.truncate(half.triangles.len() / 2);
    let count = |depth_m: &[f32]| depth_m.iter().filter(|&&d| d > 0.0).count();
    let masked = protocol::vortx_masked_depths(&floor(0.3), &half, &view);
    // The prediction is nearer and looks larger: all of the half floor is before it, and nothing else stays.
    assert_eq!(count(&masked), count(&protocol::vortx_render(&half, &view)));
    assert_eq!(count(&masked), 60 * 30);
    assert!(masked.iter().all(|&d| d == 0.0 || (d - 1.7).abs() < 1e-5));
}

/// Ground truth of a real scan, where the scans are at hand.
fn real(name: &str) -> Option<Mesh> {
    let scans = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scans");
    let path = Path::new(scans).join(name).join("gt.ply");
    match std::fs::read(&path) {
        Ok(bytes) => match ply::read(&bytes) {
            Ok(mesh) => Some(mesh),
            Err(error) => panic!("{}: {error}", path.display()),
        },
        Err(_) => {
            println!("skipped: ../shared/scans/{name}/gt.ply is absent");
            None
        }
    }
}

#[test]
fn real_ground_truth_against_itself_and_shifted() {
    for (name, vertices, faces) in [
        ("livingroom", 33_979, 64_841),
        ("hololens", 87_720, 159_176),
    ] {
        let Some(gt) = real(name) else { continue };
        assert_eq!((gt.positions.len(), gt.triangles.len()), (vertices, faces));
        assert_eq!(gt.validate(), Ok(()));
        let itself = protocol::plain(&gt, &gt, 80_000, 1);
        assert!(
            itself.f_score > 0.998 && itself.chamfer_m < 0.02,
            "{name}: {itself:?}"
        );
        let mut shifted = gt.clone();
        shifted.positions.iter_mut().for_each(|p| p.x += 0.03);
        let near = protocol::plain(&shifted, &gt, 80_000, 1);
        assert!(
            near.f_score > 0.995 && near.chamfer_m > itself.chamfer_m + 0.003,
            "{near:?}"
        );
        shifted.positions.iter_mut().for_each(|p| p.x += 0.12);
        let far = protocol::plain(&shifted, &gt, 80_000, 1);
        assert!(far.f_score < 0.9, "{name}: {far:?}");
    }
}
