//! The rasteriser against geometry that can be worked out by hand: places, depths, edges, sides and shading.

use glam::{Affine3A, Quat, Vec2, Vec3};
use mesh::camera::Pinhole;
use mesh::raster::{Cull, Style, depth, shaded};
use mesh::{Mesh, sample::Uniform};

const CAMERA: Pinhole = Pinhole {
    width: 64,
    height: 48,
    fx: 60.0,
    fy: 58.0,
    cx: 31.3,
    cy: 23.8,
};
const BACKGROUND: [u8; 4] = [9, 8, 7, 6];

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

fn picture(mesh: &Mesh, style: Style) -> Vec<[u8; 4]> {
    let bytes = shaded(mesh, &CAMERA, &Affine3A::IDENTITY, style, BACKGROUND);
    bytes.as_chunks().0.to_vec()
}

/// The pixel at (column, row).
fn at(picture: &[[u8; 4]], column: usize, row: usize) -> [u8; 4] {
    picture[row * CAMERA.width as usize + column]
}

#[test]
fn colours_are_blended_and_lit_from_the_camera() {
    let mut mesh = wall(2.5);
    mesh.colors = vec![[255, 0, 0], [255, 0, 0], [0, 0, 255], [0, 0, 255]];
    let lit = picture(&mesh, Style::Color);
    assert_eq!(at(&lit, 0, 0), BACKGROUND);
    let [left, middle, right] = [9, 31, 54].map(|column| at(&lit, column, 24));
    assert!(left[0] > 200 && left[2] < 20, "{left:?}");
    assert!(right[2] > 200 && right[0] < 20, "{right:?}");
    assert!(
        middle[0].abs_diff(128) < 6 && middle[2].abs_diff(128) < 6,
        "{middle:?}"
    );
    assert_eq!(middle[3], 255);

    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let from_behind = at(&picture(&mesh, Style::Color), 9, 24);
    assert!(from_behind[0] < left[0] / 3 * 2, "{from_behind:?}");
}

#[test]
fn without_colours_the_surface_is_grey_and_darker_where_it_turns_away() {
    let facing = at(&picture(&wall(2.5), Style::Color), 31, 24);
    assert!(facing[0] > 190 && facing[0] == facing[1] && facing[1] == facing[2]);
    let slanted = quad([
        [-1.0, -1.0, 0.5],
        [-1.0, 1.0, 0.5],
        [1.0, 1.0, 4.5],
        [1.0, -1.0, 4.5],
    ]);
    let turned_away = at(&picture(&slanted, Style::Color), 31, 24);
    assert!(turned_away[0] < facing[0] - 30, "{turned_away:?}");
}

#[test]
fn normals_come_from_the_vertices_or_else_from_the_triangle() {
    let mut mesh = wall(2.5);
    let flat = at(&picture(&mesh, Style::Normal), 31, 24);
    assert_eq!(flat, [128, 128, 0, 255], "towards the camera is -z");
    mesh.normals = vec![Vec3::X; 4];
    assert_eq!(
        at(&picture(&mesh, Style::Normal), 31, 24),
        [255, 128, 128, 255]
    );
}

#[test]
fn depth_style_runs_from_near_to_far() {
    let slanted = quad([
        [-2.0, -1.0, 1.0],
        [-2.0, 1.0, 1.0],
        [2.0, 1.0, 4.0],
        [2.0, -1.0, 4.0],
    ]);
    let map = picture(&slanted, Style::Depth);
    let row: Vec<[u8; 4]> = (0..64).map(|column| at(&map, column, 24)).collect();
    let drawn: Vec<_> = row
        .into_iter()
        .filter(|&pixel| pixel != BACKGROUND)
        .collect();
    let (near, far) = (drawn[0], drawn[drawn.len() - 1]);
    assert!(near[0] > 240 && near[1] > 215, "near is yellow: {near:?}");
    assert!(
        far[0] < 80 && far[1] < 30 && far[2] > 70,
        "far is violet: {far:?}"
    );
}

#[test]
fn wireframe_draws_the_edges_and_only_them() {
    let lines = picture(&wall(2.5), Style::Wireframe);
    // The diagonal runs from the top left to the bottom right corner; the wall is 48 x 46.4 pixels.
    let on_diagonal = at(&lines, 31, 24)[0].min(at(&lines, 32, 24)[0]);
    let beside = at(&lines, 20, 35)[0];
    assert!(on_diagonal < 100 && beside > 180, "{on_diagonal} {beside}");
    let dark = lines
        .iter()
        .filter(|pixel| pixel[3] == 255 && pixel[0] < 100)
        .count();
    assert!((80..400).contains(&dark), "{dark} dark pixels");
}

#[test]
fn wireframe_of_tiny_triangles_stays_legible() {
    // About one pixel each: full lines would leave nothing but black.
    let lines = picture(&sheet(0.3, 1), Style::Wireframe);
    let mean = lines.iter().map(|pixel| f32::from(pixel[0])).sum::<f32>() / lines.len() as f32;
    assert!(mean > 100.0, "{mean}");
}
