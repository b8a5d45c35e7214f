//! Crops and their views show one and the same place, however they are turned and mirrored: the surface in the truth
//! lies where the depth maps say, and looks alike in all views.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use glam::{Affine3A, Quat, Vec2, Vec3};
use net::sample::Sample;
use train::data::crop::{Crop, CropChance};
use train::data::{Augment, SampleOptions, Sampler};
use train::random::Random;

/// Where the distance changes its sign between a fine point and its neighbour along an axis, in metres.
fn surface(sample: &Sample) -> Vec<Vec3> {
    let [nx, ny, nz] = sample.truth.size[2];
    let tsdf = &sample.truth.tsdf;
    let strides = [1, nx, nx * ny];
    let mut points = Vec::new();
    for i in 0..tsdf.len() {
        let site = [i % nx, i / nx % ny, i / (nx * ny)];
        for axis in 0..3 {
            if site[axis] + 1 == [nx, ny, nz][axis] {
                continue;
            }
            let (a, b) = (tsdf[i], tsdf[i + strides[axis]]);
            // From 1 to -1 there is no surface but the border of what was seen.
            if a * b < 0.0 && (a - b).abs() < 1.0 {
                let mut place = Vec3::from_array(site.map(|n| n as f32));
                place[axis] += a / (a - b);
                points.push(place * 0.04);
            }
        }
    }
    points
}

/// Depth of `point` in view `v`, the pixel it falls on, and what was measured there.
fn look(sample: &Sample, v: usize, point: Vec3) -> Option<(f32, Vec2, f32)> {
    let view = &sample.views[v];
    let local = view.world_from_camera.inverse().transform_point3(point);
    if local.z <= 0.1 {
        return None;
    }
    let pixel = view.camera.project(local);
    let (w, h) = (view.camera.width as usize, view.camera.height as usize);
    let (x, y) = (pixel.x.round(), pixel.y.round());
    if x < 0.0 || y < 0.0 || x >= w as f32 || y >= h as f32 {
        return None;
    }
    let measured = sample.depth_m[(v * h + y as usize) * w + x as usize];
    Some((local.z, pixel, measured))
}

/// A fine voxel and a half: pixels are coarse where a surface is seen at a slant.
const NEAR_M: f32 = 0.06;

/// How many looks at points of the surface end there, and how many go through it; how many points were looked at so,
/// and how many there are.
#[derive(Default)]
struct Looks {
    end: usize,
    through: usize,
    seen: usize,
    points: usize,
}

impl Looks {
    fn add(&mut self, sample: &Sample) {
        for point in surface(sample) {
            let mut seen = false;
            for v in 0..sample.views.len() {
                let Some((z, _, measured)) = look(sample, v, point) else {
                    continue;
                };
                // What stands before the point says nothing of it.
                if measured > z - NEAR_M {
                    let ends = measured < z + NEAR_M;
                    seen |= ends;
                    self.end += usize::from(ends);
                    self.through += usize::from(!ends);
                }
            }
            self.seen += usize::from(seen);
            self.points += 1;
        }
    }

    fn check(&self, what: &str) {
        assert!(self.points > 2000, "{what}: {} points", self.points);
        let end = self.end as f32 / (self.end + self.through) as f32;
        assert!(
            end > 0.9,
            "{what}: {end} of the looks end at the surface, the others go through it"
        );
        let seen = self.seen as f32 / self.points as f32;
        assert!(seen > 0.4, "{what}: {seen} of the surface was seen");
        println!("{what}: {end} end, {seen} seen, {} points", self.points);
    }
}

fn options(seed: u64, rotate: bool, mirror: bool) -> SampleOptions {
    let plain = common::plain(seed);
    SampleOptions {
        augment: Augment {
            rotate,
            mirror,
            ..plain.augment
        },
        ..plain
    }
}

#[test]
fn truth_lies_where_the_depth_maps_say() {
    let set = common::rooms(2, 40, 320, 240);
    for (rotate, mirror) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut sampler = Sampler::new(set.clone(), options(5, rotate, mirror));
        let mut looks = Looks::default();
        for number in 0..8 {
            let sample = sampler.sample(number).unwrap();
            looks.add(&sample);
            for view in &sample.views {
                let linear = view.world_from_camera.matrix3;
                let determinant = linear.determinant();
                assert!(
                    (determinant - 1.0).abs() < 1e-4,
                    "a camera that is no camera: {determinant}"
                );
                let up = view.world_from_camera.matrix3.y_axis;
                assert!(up.z < 0.5, "image down is not up in the world: {up}");
            }
        }
        looks.check(&format!("turned {rotate}, mirrored {mirror}"));
    }
}

#[test]
fn a_mirrored_camera_sees_the_mirrored_picture() {
    let camera = mesh::camera::Pinhole {
        width: 160,
        height: 120,
        fx: 130.0,
        fy: 128.0,
        cx: 70.25,
        cy: 61.5,
    };
    let flipped = mesh::camera::Pinhole {
        cx: 159.0 - camera.cx,
        ..camera
    };
    let pose = Affine3A::from_rotation_translation(
        Quat::from_euler(glam::EulerRot::XYZ, 1.9, 0.3, 0.7),
        Vec3::new(0.5, -1.0, 1.5),
    );
    let chance = CropChance {
        rotate: true,
        mirror: true,
    };
    let mut mirrored = 0;
    for index in 0..20 {
        let anchor = pose.transform_point3(Vec3::new(0.2, 0.1, 2.0));
        let crop = Crop::draw([48, 48, 32], anchor, chance, &mut Random::new(1, index));
        let inside = crop.crop_from_world.transform_point3(anchor);
        let last = Vec3::new(46.0, 46.0, 30.0) * 0.04 + 1e-4;
        assert!(inside.cmpge(Vec3::splat(0.04 - 1e-4)).all() && inside.cmple(last).all());
        for local in [Vec3::new(0.3, -0.2, 1.5), Vec3::new(-0.9, 0.4, 3.0)] {
            let before = camera.project(local);
            let in_crop = crop.crop_from_world * pose;
            let point = crop
                .pose(pose)
                .inverse()
                .transform_point3(in_crop.transform_point3(local));
            let after = if crop.mirrored { flipped } else { camera }.project(point);
            let expected = if crop.mirrored {
                159.0 - before.x
            } else {
                before.x
            };
            assert!(
                (after - Vec2::new(expected, before.y)).length() < 1e-3,
                "{after} from {before}"
            );
        }
        mirrored += usize::from(crop.mirrored);
    }
    assert!((4..=16).contains(&mirrored), "{mirrored}");
}

#[test]
fn pictures_of_another_shape_are_cut_with_the_right_camera() {
    for (width, height) in [(400, 200), (200, 300)] {
        let set = common::rooms(1, 40, width, height);
        let mut sampler = Sampler::new(set, options(2, true, true));
        let mut looks = Looks::default();
        for number in 0..8 {
            looks.add(&sampler.sample(number).unwrap());
        }
        looks.check(&format!("{width}x{height}"));
    }
}

#[test]
fn half_of_the_samples_are_mirrored_and_turned_to_all_sides() {
    let set = common::rooms(1, 20, 80, 60);
    let mut sampler = Sampler::new(set.clone(), options(3, true, true));
    let mut turned = Sampler::new(set, options(3, true, false));
    let mut mirrored = 0;
    let mut quarters = [0; 4];
    for number in 0..60 {
        let (sample, same) = (
            sampler.sample(number).unwrap(),
            turned.sample(number).unwrap(),
        );
        mirrored += usize::from(sample.images != same.images);
        let x = same.views[0].world_from_camera.matrix3.x_axis;
        quarters[usize::from(x.x > 0.0) + 2 * usize::from(x.y > 0.0)] += 1;
    }
    assert!((18..=42).contains(&mirrored), "{mirrored} of 60 mirrored");
    assert!(quarters.iter().all(|&n| n > 4), "{quarters:?}");
}

/// The colour of view `v` at a pixel, the mean of three channels, between pixels.
fn grey(sample: &Sample, v: usize, at: Vec2) -> Option<f32> {
    let (w, h) = (
        sample.views[v].camera.width as usize,
        sample.views[v].camera.height as usize,
    );
    let low = at.floor();
    if low.x < 0.0 || low.y < 0.0 || low.x + 1.0 >= w as f32 || low.y + 1.0 >= h as f32 {
        return None;
    }
    let share = at - low;
    let pixel = |x: usize, y: usize| {
        (0..3)
            .map(|c| sample.images[((v * 3 + c) * h + y) * w + x])
            .sum::<f32>()
            / 3.0
    };
    let (x, y) = (low.x as usize, low.y as usize);
    let row = |y| pixel(x, y) * (1.0 - share.x) + pixel(x + 1, y) * share.x;
    Some(row(y) * (1.0 - share.y) + row(y + 1) * share.y)
}

/// Correlation of what two views show of the same points; views are shifted by `shift` pixels against the truth.
fn likeness(sample: &Sample, shift: f32) -> f32 {
    let mut pairs: Vec<(f32, f32)> = Vec::new();
    for point in surface(sample) {
        let looks = (0..sample.views.len()).filter_map(|v| {
            let (z, pixel, measured) = look(sample, v, point)?;
            ((measured - z).abs() < 0.03).then_some(())?;
            grey(sample, v, pixel + Vec2::new(shift * (v % 2) as f32, 0.0))
        });
        let looks: Vec<f32> = looks.collect();
        pairs.extend(looks.windows(2).map(|pair| (pair[0], pair[1])));
    }
    let n = pairs.len() as f32;
    assert!(n > 300.0, "{n} pairs");
    let mean = |of: &dyn Fn(&(f32, f32)) -> f32| pairs.iter().map(of).sum::<f32>() / n;
    let (a, b) = (mean(&|p| p.0), mean(&|p| p.1));
    let ab = mean(&|p| (p.0 - a) * (p.1 - b));
    ab / (mean(&|p| (p.0 - a).powi(2)) * mean(&|p| (p.1 - b).powi(2))).sqrt()
}

#[test]
fn a_point_looks_alike_in_all_views() {
    let set = common::rooms(1, 40, 320, 240);
    let mut sampler = Sampler::new(set, options(11, true, true));
    let (mut right, mut shifted) = (0.0, 0.0);
    for number in 0..6 {
        let sample = sampler.sample(number).unwrap();
        right += likeness(&sample, 0.0) / 6.0;
        shifted += likeness(&sample, 4.0) / 6.0;
    }
    assert!(right > 0.9, "correlation {right}");
    assert!(
        shifted < right - 0.02,
        "{shifted} where pictures are four pixels off, {right} where not"
    );
}

#[test]
fn levels_follow_the_fine_truth() {
    let set = common::rooms(1, 30, 160, 120);
    let mut sampler = Sampler::new(set, options(1, true, true));
    let truth = sampler.sample(0).unwrap().truth;
    assert_eq!(truth.size, [[12, 12, 8], [24, 24, 16], [48, 48, 32]]);
    for level in 0..3 {
        let [nx, ny, nz] = truth.size[level];
        assert_eq!(truth.occupied[level].len(), nx * ny * nz);
        assert_eq!(truth.supervised[level].len(), nx * ny * nz);
        let both = truth.occupied[level].iter().zip(&truth.supervised[level]);
        assert!(both.clone().all(|(occupied, known)| *known || !occupied));
        let share =
            truth.occupied[level].iter().filter(|o| **o).count() as f32 / (nx * ny * nz) as f32;
        assert!(
            share > 0.005 && share < 0.8,
            "level {level}: {share} occupied"
        );
    }
    // Every occupied fine point has an occupied medium and coarse one around it: descent cannot lose it.
    let [nx, ny, _] = truth.size[2];
    for (i, _) in truth.occupied[2].iter().enumerate().filter(|(_, o)| **o) {
        let site = [i % nx, i / nx % ny, i / (nx * ny)];
        for (level, by) in [(1, 2), (0, 4)] {
            let [mx, my, _] = truth.size[level];
            let [x, y, z] = site.map(|n| n / by);
            assert!(
                truth.occupied[level][x + mx * (y + my * z)],
                "{site:?} has no parent at level {level}"
            );
        }
    }
}

#[test]
fn pose_noise_is_as_large_as_asked() {
    let set = common::rooms(1, 30, 80, 60);
    let noisy = SampleOptions {
        augment: Augment {
            pose_noise_m: 0.02,
            pose_noise_deg: 1.0,
            ..options(4, true, true).augment
        },
        ..options(4, true, true)
    };
    let mut clean = Sampler::new(set.clone(), options(4, true, true));
    let mut noisy = Sampler::new(set, noisy);
    let (mut shift, mut turn, mut count) = (0.0, 0.0, 0.0);
    for number in 0..10 {
        let (a, b) = (clean.sample(number).unwrap(), noisy.sample(number).unwrap());
        for (a, b) in a.views.iter().zip(&b.views) {
            let off = a.world_from_camera.inverse() * b.world_from_camera;
            shift += off.translation.length_squared();
            turn += glam::Quat::from_mat3a(&off.matrix3)
                .to_scaled_axis()
                .length_squared();
            count += 3.0;
        }
    }
    let (shift_m, turn_deg) = ((shift / count).sqrt(), (turn / count).sqrt().to_degrees());
    assert!((0.014..0.026).contains(&shift_m), "{shift_m} m");
    assert!((0.7..1.3).contains(&turn_deg), "{turn_deg} degrees");
}
