//! Pictures of a training room in linear light: direct light with soft and hard shadows, one bounce, highlights.
//!
//! As in the sample's renderer, each pixel gathers along one of 64 directions and lights are jittered by one of 16
//! places; sums over the pixels around it make that smooth. Lights smaller than a hand cast hard shadows, which are not
//! smoothed.

use glam::Vec3;

use crate::path::View;
use crate::point::{Point, soften_edges};
use crate::training::light::{Arriving, BLOCK, FAR_M, arriving, probes};
use crate::training::room::TrainingRoom;

/// Colour before the camera, and exact depth.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    pub width: usize,
    pub color: Vec<Vec3>,
    /// Along the optical axis in metres; 0 where a ray meets nothing.
    pub depth_m: Vec<f32>,
}

/// Draws what `view` sees.
pub(crate) fn trace(room: &TrainingRoom, view: &View) -> Linear {
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let mut points = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            points.push(look(room, view, view.ray(u as f32, v as f32).normalize()));
        }
    }
    let probes = probes();
    let light = (0..points.len())
        .map(|i| {
            let probe = &probes[i / width % BLOCK * BLOCK + i % width % BLOCK];
            arriving(room, &points[i], probe)
        })
        .collect();
    finish(room, view, &points, light)
}

/// The picture, once rays have told what they met and what light is there.
pub(crate) fn finish(
    room: &TrainingRoom,
    view: &View,
    points: &[Point],
    mut light: Vec<Arriving>,
) -> Linear {
    let width = view.camera.width as usize;
    smooth(points, &mut light, width);
    let mut color: Vec<_> = points
        .iter()
        .zip(&light)
        .map(|(point, light)| shade(room, point, light))
        .collect();
    soften_edges(
        view,
        points,
        &mut color,
        |here, there| (there - here).abs().max_element() > 0.04 * (0.1 + here.max_element()),
        |dir| look(room, view, dir),
        |point, source| shade(room, point, &light[source]),
    );
    let depth = |(i, point): (usize, &Point)| {
        point.t / view.ray((i % width) as f32, (i / width) as f32).length()
    };
    Linear {
        width,
        color,
        depth_m: points.iter().enumerate().map(depth).collect(),
    }
}

/// Exact depth alone.
pub(crate) fn depth(room: &TrainingRoom, view: &View) -> Vec<f32> {
    let (width, height) = (view.camera.width, view.camera.height);
    (0..width * height)
        .map(|i| {
            let ray = view.ray((i % width) as f32, (i / width) as f32);
            let hit = room.scene.cast(view.position_m, ray.normalize(), FAR_M);
            hit.map_or(0.0, |hit| hit.t / ray.length())
        })
        .collect()
}

fn look(room: &TrainingRoom, view: &View, dir: Vec3) -> Point {
    let origin = view.position_m;
    let Some(hit) = room.scene.cast(origin, dir, FAR_M) else {
        return Point {
            dir,
            ..Point::default()
        };
    };
    let mut point = Point {
        solid: hit.solid,
        t: hit.t,
        at: origin + dir * hit.t,
        normal: hit.normal,
        albedo: Vec3::ZERO,
        dir,
    };
    paint(room, view, &mut point);
    point
}

/// Finds the albedo of a point.
pub(crate) fn paint(room: &TrainingRoom, view: &View, point: &mut Point) {
    let solid = &room.scene.solids[point.solid as usize];
    // A slanting surface spreads over more metres a pixel.
    let slant = (-point.dir.dot(point.normal)).max(0.25);
    let pixel_m = point.t / view.camera.fx as f32 / slant.sqrt();
    let normal = solid.axes.transpose_mul_vec3(point.normal);
    let at = solid.to_local(point.at);
    point.albedo = solid
        .look
        .colour(at, normal, solid.shape.half_size(), pixel_m);
}

/// Averages soft light over 4 by 4 pixels and the bounce over 8 by 8, as far as they belong to one smooth surface.
fn smooth(points: &[Point], light: &mut [Arriving], width: usize) {
    let soft = average(points, light, width, 4, 1);
    let quarters = average(points, light, width, 4, 1);
    let around = average(points, &quarters, width, 2, 4);
    for ((light, soft), around) in light.iter_mut().zip(&soft).zip(&around) {
        light.soft = soft.soft;
        light.shine = soft.shine;
        light.around = around.around;
    }
}

fn average(
    points: &[Point],
    light: &[Arriving],
    width: usize,
    taps: usize,
    step: usize,
) -> Vec<Arriving> {
    let height = points.len() / width;
    let span = taps * step;
    let start = |at: usize, size: usize| at.saturating_sub(span / 2).min(size.saturating_sub(span));
    points
        .iter()
        .enumerate()
        .map(|(i, point)| {
            let (u0, v0) = (start(i % width, width), start(i / width, height));
            let apart = 0.01 + 0.01 * point.t;
            let mut sum = Arriving::default();
            let mut count = 0.0f32;
            for v in (v0..height.min(v0 + span)).step_by(step) {
                for u in (u0..width.min(u0 + span)).step_by(step) {
                    let other = &points[v * width + u];
                    let same = other.normal.dot(point.normal) > 0.85
                        && (other.at - point.at).dot(point.normal).abs() < apart;
                    if same {
                        let here = &light[v * width + u];
                        sum.soft += here.soft;
                        sum.shine += here.shine;
                        sum.around += here.around * here.certainty;
                        sum.certainty += here.certainty;
                        count += 1.0;
                    }
                }
            }
            if count == 0.0 {
                return light[i];
            }
            let share = 1.0 / count;
            Arriving {
                crisp: light[i].crisp,
                soft: sum.soft * share,
                shine: sum.shine * share,
                around: sum.around / sum.certainty.max(1e-6),
                certainty: sum.certainty,
            }
        })
        .collect()
}

/// Linear RGB that leaves `point` towards the camera.
fn shade(room: &TrainingRoom, point: &Point, light: &Arriving) -> Vec3 {
    if point.t == 0.0 {
        return Vec3::ZERO;
    }
    let look = &room.scene.solids[point.solid as usize].look;
    let diffuse = light.crisp + light.soft + light.around;
    point.albedo * (diffuse + look.glow) + light.shine * (0.35 * look.gloss)
}
