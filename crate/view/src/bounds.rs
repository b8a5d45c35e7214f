//! Boxes of bricks: what the camera frames, and which bricks are outside of the picture.

use glam::{IVec3, Mat4, Vec3, Vec4};
use mesh::Bounds;

/// The box of lattice brick `brick`: `brick * size ..= (brick + 1) * size`.
pub fn of_brick(brick: [i32; 3], brick_size_m: f32) -> Bounds {
    let min = Vec3::from_array(brick.map(|i| i as f32)) * brick_size_m;
    Bounds {
        min,
        max: min + brick_size_m,
    }
}

/// How far a brick's triangles may reach out of its box, as a share of its edge: marching cubes closes the gap to the
/// next brick within one voxel.
const OVERHANG: f32 = 0.15;

/// The box that holds all triangles of lattice brick `brick`.
pub fn reach_of_brick(brick: [i32; 3], brick_size_m: f32) -> Bounds {
    let exact = of_brick(brick, brick_size_m);
    Bounds {
        min: exact.min - OVERHANG * brick_size_m,
        max: exact.max + OVERHANG * brick_size_m,
    }
}

/// The box around all `bricks`; `None` of none.
pub fn of_bricks<'a>(
    bricks: impl IntoIterator<Item = &'a [i32; 3]>,
    brick_size_m: f32,
) -> Option<Bounds> {
    bricks
        .into_iter()
        .map(|&brick| of_brick(brick, brick_size_m))
        .reduce(|a, b| Bounds {
            min: a.min.min(b.min),
            max: a.max.max(b.max),
        })
}

/// Points that hold the bricks in between, for a camera to frame: in each of 26 directions a corner of the farthest
/// brick, but for the last 1.5 %, since a real scan has a few strays far outside. Tighter than a box, which a room that
/// stands askew fills badly. Empty of none.
pub fn outline<'a>(bricks: impl IntoIterator<Item = &'a [i32; 3]>, brick_size_m: f32) -> Vec<Vec3> {
    let bricks: Vec<IVec3> = bricks.into_iter().map(|&brick| brick.into()).collect();
    let stray = bricks.len() * 3 / 200;
    let directions = (0..27).map(|i| IVec3::new(i % 3, i / 3 % 3, i / 9) - 1);
    directions
        .filter(|&direction| direction != IVec3::ZERO)
        .filter_map(|direction| {
            let mut order = bricks.clone();
            order.sort_unstable_by_key(|brick| -brick.dot(direction));
            let center = order.get(stray)?.as_vec3() + 0.5;
            Some((center + direction.as_vec3() * 0.5) * brick_size_m)
        })
        .collect()
}

/// The eight corners.
pub fn corners(bounds: &Bounds) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let upper = |bit: usize| i >> bit & 1 == 1;
        Vec3::select(
            glam::BVec3::new(upper(0), upper(1), upper(2)),
            bounds.max,
            bounds.min,
        )
    })
}

/// Whether the box may be in the picture: false only when it lies wholly beyond one side plane or
/// behind the eye plane of `clip_from_world`.
pub fn may_be_seen(bounds: &Bounds, clip_from_world: &Mat4) -> bool {
    let center = bounds.center();
    let half = bounds.size() * 0.5;
    let [x, y, w] = [0, 1, 3].map(|row| clip_from_world.row(row));
    [w + x, w - x, w + y, w - y, w].iter().all(|plane: &Vec4| {
        let normal = plane.truncate();
        normal.dot(center) + plane.w + normal.abs().dot(half) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_join_and_bricks_sit_on_the_lattice() {
        let a = of_brick([-1, 0, 2], 0.5);
        assert_eq!(a.min, Vec3::new(-0.5, 0.0, 1.0));
        assert_eq!(a.max, Vec3::new(0.0, 0.5, 1.5));
        let both = of_bricks(&[[-1, 0, 2], [3, 0, 0]], 0.5).unwrap();
        assert_eq!(both.min, Vec3::new(-0.5, 0.0, 0.0));
        assert_eq!(both.max, Vec3::new(2.0, 0.5, 1.5));
        assert_eq!(of_bricks(&[], 0.5), None);
        let found = Bounds::of(&corners(&both)).unwrap();
        assert_eq!(found, both);
    }

    #[test]
    fn the_outline_is_the_box_of_a_full_room_without_strays() {
        let mut bricks: Vec<[i32; 3]> = (0..200).map(|i| [i % 10, i / 10 % 4, i / 40]).collect();
        let room = of_bricks(&bricks, 0.5);
        assert_eq!(Bounds::of(&outline(&bricks, 0.5)), room);
        bricks.extend([[90, 0, 0], [0, -70, 3]]);
        let framed = Bounds::of(&outline(&bricks, 0.5)).unwrap();
        assert!(framed.max.x <= 5.0 && framed.min.y >= 0.0, "{framed:?}");
        assert!(outline(&[], 0.5).is_empty());
    }

    #[test]
    fn the_outline_of_a_room_askew_leaves_the_boxs_corners_out() {
        // A diamond: |x| + |y| <= 10.
        let cells = (0..441_i32).map(|i| [i % 21 - 10, i / 21 - 10, 0]);
        let diamond: Vec<[i32; 3]> = cells.filter(|b| b[0].abs() + b[1].abs() <= 10).collect();
        for point in outline(&diamond, 1.0) {
            let reach = (point.x - 0.5).abs() + (point.y - 0.5).abs();
            assert!(reach <= 11.0, "{point}");
        }
    }

    #[test]
    fn only_boxes_beyond_the_picture_are_left_out() {
        let camera = crate::OrbitCamera {
            pivot_m: Vec3::ZERO,
            distance_m: 3.0,
            yaw_rad: 0.0,
            pitch_rad: 0.0,
            ..Default::default()
        };
        let clip = camera.clip_from_world(1.0);
        let seen = |x: f32, y: f32, z: f32| {
            let min = Vec3::new(x, y, z);
            may_be_seen(
                &Bounds {
                    min,
                    max: min + 0.1,
                },
                &clip,
            )
        };
        assert!(seen(0.0, 0.0, 0.0));
        // The picture is 2 * 3 * tan(0.45) = 2.9 m wide at the pivot.
        assert!(seen(0.0, 1.3, 0.0) && !seen(0.0, 1.6, 0.0));
        assert!(seen(0.0, -1.5, 0.0) && !seen(0.0, -1.8, 0.0));
        assert!(seen(0.0, 0.0, 1.3) && !seen(0.0, 0.0, 1.6));
        assert!(!seen(-3.5, 0.0, 0.0), "behind the eye");
        let around_the_eye = Bounds {
            min: Vec3::splat(-9.0),
            max: Vec3::splat(9.0),
        };
        assert!(may_be_seen(&around_the_eye, &clip));
    }
}
