//! The rasteriser against geometry that can be worked out by hand: places, depths, edges, sides and shading.

use glam::{Affine3A, Quat, Vec2, Vec3};
use mesh::camera::Pinhole;
use mesh::raster::{Cull, depth};
use mesh::{Mesh, sample::Uniform};

const CAMERA: Pinhole = Pinhole {
    width: 64,
    height: 48,
    fx: 60.0,
    fy: 58.0,
    cx: 31.3,
    cy: 23.8,
};

/// A quadrilateral from its corners, counter-clockwise.
fn quad(corners: [[f32; 3]; 4]) -> Mesh {
    Mesh {
        positions: corners.map(Vec3::from_array).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A wall of 2 x 2 metres at `z`, front towards the camera.
fn wall(z: f32) -> Mesh {
    quad([
        [-1.0, -1.0, z],
        [-1.0, 1.0, z],
        [1.0, 1.0, z],
        [1.0, -1.0, z],
    ])
}

fn seen(mesh: &Mesh, cull: Cull) -> Vec<f32> {
    depth(mesh, &CAMERA, &Affine3A::IDENTITY, cull, 0.05)
}

fn pixels() -> impl Iterator<Item = (usize, Vec2)> {
    let width = CAMERA.width as usize;
    (0..CAMERA.pixels()).map(move |i| (i, Vec2::new((i % width) as f32, (i / width) as f32)))
}

#[test]
fn a_wall_covers_exactly_the_pixels_whose_centres_it_hides() {
    let map = seen(&wall(2.5), Cull::Back);
    for (index, pixel) in pixels() {
        let point = CAMERA.ray(pixel) * 2.5;
        let hidden = point.x.abs() < 1.0 && point.y.abs() < 1.0;
        let expected = if hidden { 2.5 } else { 0.0 };
        assert!(
            (map[index] - expected).abs() < 1e-5,
            "{pixel}: {}",
            map[index]
        );
    }
}

#[test]
fn depth_is_right_in_perspective_also_where_the_floor_runs_under_the_camera() {
    // 1.2 m below, from 3 m behind the camera to 9 m before it: both triangles cross the near plane.
    let floor = quad([
        [-40.0, 1.2, -3.0],
        [-40.0, 1.2, 9.0],
        [40.0, 1.2, 9.0],
        [40.0, 1.2, -3.0],
    ]);
    let map = seen(&floor, Cull::None);
    for (index, pixel) in pixels() {
        let z = 1.2 / CAMERA.ray(pixel).y;
        let found = map[index];
        if (0.0..9.0).contains(&z) {
            // Where the depth found lies on the floor, in rows of the picture; corners are snapped to 1/256 pixel.
            let row = CAMERA.project(Vec3::new(0.0, 1.2, found)).y;
            assert!(
                (row - pixel.y).abs() < 1.0 / 256.0,
                "{pixel}: {found} for {z}"
            );
        } else {
            assert_eq!(found, 0.0, "{pixel}");
        }
    }
    assert!(map.iter().filter(|&&z| z > 0.0).count() > 500);
}

#[test]
fn the_nearer_surface_wins_and_what_is_too_near_is_cut() {
    let mut two = wall(2.0);
    let behind = wall(3.0);
    two.positions.extend(behind.positions);
    two.triangles.insert(0, [4, 5, 6]);
    two.triangles.push([4, 6, 7]);
    let middle = 24 * 64 + 31;
    assert_eq!(seen(&two, Cull::Back)[middle], 2.0);
    let from_farther = depth(&two, &CAMERA, &Affine3A::IDENTITY, Cull::Back, 2.5);
    assert!((from_farther[middle] - 3.0).abs() < 1e-6);
    let nothing = depth(&two, &CAMERA, &Affine3A::IDENTITY, Cull::Back, 3.5);
    assert!(nothing.iter().all(|&z| z == 0.0));
}

#[test]
fn culling_hides_backs_also_in_a_mirrored_picture() {
    let mut back = wall(2.0);
    back.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(seen(&back, Cull::Back).iter().all(|&z| z == 0.0));
    assert_eq!(seen(&back, Cull::None), seen(&wall(2.0), Cull::Back));
    // ICL-NUIM's camera: y up, fy negative.
    let mirrored = Pinhole {
        fy: -CAMERA.fy,
        ..CAMERA
    };
    let count = |mesh: &Mesh| {
        let map = depth(mesh, &mirrored, &Affine3A::IDENTITY, Cull::Back, 0.05);
        map.iter().filter(|&&z| z > 0.0).count()
    };
    assert!(count(&wall(2.0)) > 1000);
    assert_eq!(count(&back), 0);
}

/// A jittered sheet of small triangles that fills the view, turned about the optical axis.
fn sheet(angle: f32, seed: u64) -> Mesh {
    const SIDE: u32 = 90;
    let mut uniform = Uniform::new(seed);
    let mut jitter = || (uniform.next() as f32 - 0.5) * 0.9;
    let turn = Quat::from_rotation_z(angle);
    let mut sheet = Mesh::default();
    for i in 0..SIDE {
        for j in 0..SIDE {
            let place = Vec2::new(i as f32 + jitter(), j as f32 + jitter()) - SIDE as f32 / 2.0;
            sheet
                .positions
                .push(turn * (place * 0.03).extend(1.0 + 0.05 * jitter()));
        }
    }
    for i in 0..SIDE - 1 {
        for j in 0..SIDE - 1 {
            let a = i * SIDE + j;
            let [b, c, d] = [a + 1, a + SIDE + 1, a + SIDE];
            sheet.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    sheet
}

#[test]
fn triangles_that_share_edges_leave_no_crack() {
    for step in 0..12 {
        let map = seen(&sheet(step as f32 * 0.27, step), Cull::None);
        let holes = map.iter().filter(|&&z| z == 0.0).count();
        assert_eq!(holes, 0, "turned by {step} steps");
    }
}

#[test]
fn corners_on_pixel_centres_belong_to_exactly_one_neighbour() {
    // Unit focal length puts the corners of the two halves exactly on pixel centres.
    let camera = Pinhole {
        width: 12,
        height: 12,
        fx: 1.0,
        fy: 1.0,
        cx: 0.0,
        cy: 0.0,
    };
    let square = |left: f32, right: f32| {
        quad([
            [left, 2.0, 1.0],
            [left, 8.0, 1.0],
            [right, 8.0, 1.0],
            [right, 2.0, 1.0],
        ])
    };
    let covered = |mesh: &Mesh| -> Vec<usize> {
        let map = depth(mesh, &camera, &Affine3A::IDENTITY, Cull::Back, 0.05);
        (0..map.len()).filter(|&i| map[i] > 0.0).collect()
    };
    let (left, right) = (covered(&square(1.0, 5.0)), covered(&square(5.0, 11.0)));
    assert_eq!((left.len(), right.len()), (4 * 6, 6 * 6));
    assert!(left.iter().all(|pixel| !right.contains(pixel)));
    assert!(left.contains(&(2 * 12 + 1)), "the top left corner is in");
}
