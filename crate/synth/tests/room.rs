//! The room and its pictures agree with each other, for many seeds.

use glam::Vec3;
use mesh::nearest::PointIndex;
use synth::{CLEARANCE_M, Frame, Room, View, depth, path, render};

const SEEDS: std::ops::Range<u64> = 0..20;

fn small_path(room: &Room) -> Vec<View> {
    path(room, 36, 40, 30)
}

fn points<'a>(view: &'a View, depth_m: &'a [f32]) -> impl Iterator<Item = Vec3> + 'a {
    depth_m.iter().enumerate().map(|(i, z)| {
        let (u, v) = (i as u32 % view.camera.width, i as u32 / view.camera.width);
        view.position_m + view.ray(u as f32, v as f32) * *z
    })
}

/// FNV-1a over colour and depth bits.
fn fingerprint(frame: &Frame) -> u64 {
    let depth = frame.depth_m.iter().flat_map(|z| z.to_bits().to_le_bytes());
    let bytes = frame.color.iter().flatten().copied().chain(depth);
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    })
}

#[test]
fn depth_ends_on_the_surface() {
    for seed in SEEDS {
        let room = Room::new(seed);
        for view in small_path(&room).iter().step_by(6) {
            let worst = points(view, &depth(&room, view))
                .map(|p| room.distance(p).abs())
                .fold(0.0, f32::max);
            assert!(
                worst < 1e-3,
                "seed {seed}: a pixel's depth ends {worst} m off the surface"
            );
        }
    }
}

#[test]
fn depth_passes_through_nothing() {
    let room = Room::new(3);
    for view in small_path(&room).iter().step_by(5) {
        for p in points(view, &depth(&room, view)) {
            let way = p - view.position_m;
            for step in 1..40 {
                let gap = room.distance(view.position_m + way * (step as f32 / 40.0));
                assert!(
                    gap > -1e-3,
                    "a ray to {p} is {gap} m inside something on its way"
                );
            }
        }
    }
}

#[test]
fn the_walk_keeps_clear_and_sees_something_everywhere() {
    for seed in SEEDS {
        let room = Room::new(seed);
        for (i, view) in small_path(&room).iter().enumerate() {
            let gap = room.distance(view.position_m);
            assert!(
                gap >= CLEARANCE_M,
                "seed {seed}, view {i}: {gap} m from something"
            );
            let turned = view.rotation.transpose() * view.rotation - glam::Mat3::IDENTITY;
            assert!(
                turned.to_cols_array().iter().all(|v| v.abs() < 1e-5),
                "no rotation"
            );
            assert!(
                view.rotation.determinant() > 0.9,
                "seed {seed}, view {i}: mirrored"
            );

            let frame = render(&room, view);
            let mut sorted = frame.depth_m.clone();
            sorted.sort_by(f32::total_cmp);
            assert!(
                sorted[0] > 0.15 && sorted[sorted.len() - 1] < 8.0,
                "seed {seed}, view {i}"
            );
            let (near, far) = (sorted[sorted.len() / 20], sorted[sorted.len() * 19 / 20]);
            assert!(
                far - near > 0.4,
                "seed {seed}, view {i}: all of it {near} to {far} m away"
            );

            let greys: Vec<f32> = frame.color.iter().map(|c| f32::from(c[1])).collect();
            let mean = greys.iter().sum::<f32>() / greys.len() as f32;
            let spread =
                (greys.iter().map(|g| (g - mean).powi(2)).sum::<f32>() / greys.len() as f32).sqrt();
            assert!(
                (60.0..220.0).contains(&mean),
                "seed {seed}, view {i}: mean grey {mean}"
            );
            assert!(spread > 12.0, "seed {seed}, view {i}: grey spread {spread}");
        }
    }
}

#[test]
fn a_seed_names_the_same_picture_everywhere() {
    let picture = |seed| {
        let room = Room::new(seed);
        fingerprint(&render(&room, &path(&room, 4, 64, 48)[1]))
    };
    assert_eq!(
        picture(3),
        0x5E52_380F_A829_C11B,
        "found {:#018x}",
        picture(3)
    );
    assert_ne!(picture(3), picture(4));
}

#[test]
fn render_and_depth_agree() {
    let room = Room::new(5);
    let view = path(&room, 3, 80, 60)[0];
    assert_eq!(render(&room, &view).depth_m, depth(&room, &view));
}

#[test]
fn the_mesh_is_the_surface() {
    let room = Room::new(3);
    let mesh = room.mesh();
    assert!(mesh.triangles.len() > 50_000);
    let mut worst = 0.0f32;
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!((n.length() - 1.0).abs() < 1e-4, "normal {n} at {p}");
        let half = 0.5 * room.size_m() + 0.16;
        assert!(
            p.x.abs() < half.x && p.y.abs() < half.y,
            "{p} lies outside of the walls"
        );
        worst = worst.max(room.distance(*p));
    }
    assert!(worst < 1e-3, "a vertex hangs {worst} m in the air");
    // Cells of curved surfaces are flat: their middles may lie a little inside, and nothing may lie far inside.
    let deep = mesh
        .triangles
        .iter()
        .map(|t| room.distance(t.iter().map(|&i| mesh.positions[i as usize]).sum::<Vec3>() / 3.0))
        .fold(0.0, f32::min);
    assert!(
        deep > -5e-3,
        "a triangle's middle lies {deep} m inside something"
    );
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let facing = (b - a).cross(c - a).dot(mesh.normals[t[0] as usize]);
        assert!(
            facing > 0.0,
            "a triangle at {a} is turned away from its normal"
        );
    }
}

#[test]
fn distance_is_that_to_the_nearest_surface() {
    let room = Room::new(11);
    let tree = PointIndex::new(&mesh::sample::surface(&room.mesh(), 600_000, 2));
    let mut chance = mesh::sample::Uniform::new(5);
    let mut checked = 0;
    while checked < 2000 {
        let share = Vec3::from([(); 3].map(|()| chance.next() as f32)) - Vec3::new(0.5, 0.5, 0.0);
        let p = share * room.size_m();
        let (told, found) = (room.distance(p), tree.distance(p));
        if told > 0.05 {
            assert!(
                (told - found).abs() < 0.03,
                "{told} m told at {p}, {found} m to the mesh"
            );
            checked += 1;
        }
    }
}

#[test]
fn all_that_is_seen_is_in_the_mesh() {
    let room = Room::new(7);
    let mesh = room.mesh();
    let surface = mesh::sample::surface(&mesh, 400_000, 1);
    let tree = PointIndex::new(&surface);
    for view in small_path(&room).iter().step_by(4) {
        for p in points(view, &depth(&room, view)) {
            let away = tree.distance(p);
            assert!(away < 0.06, "{p} is seen, and {away} m from the mesh");
        }
    }
}
