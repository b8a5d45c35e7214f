//! A frame of the room by ray casting: exact depth, and a colour with two soft lights, sky and bounced light.
//!
//! Light is gathered with few rays a pixel in a 4 by 4 pattern of directions and then averaged over the same surface,
//! so that every pixel gets the sum of 16 directions for the price of one (interleaved sampling, Keller and
//! Heidrich 2001).

use glam::Vec3;

use crate::camera::Camera;
use crate::palette::to_srgb;
use crate::random::hash_unit;
use crate::room::{Light, Room};

/// One picture of the room.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// sRGB red, green, blue of each pixel, row by row from the top.
    pub color: Vec<[u8; 3]>,
    /// Distance along the optical axis in metres, row by row from the top; exact.
    pub depth_m: Vec<f32>,
}

/// What the first ray of a pixel found.
#[derive(Clone, Copy, Default)]
struct Point {
    solid: u32,
    /// Distance along the unit ray.
    t: f32,
    at: Vec3,
    normal: Vec3,
    /// Linear RGB of the surface.
    albedo: Vec3,
    /// Unit direction from the camera.
    dir: Vec3,
}

/// Light at a pixel before it is averaged: share of each light seen, and light from everywhere else.
#[derive(Clone, Copy, Default)]
struct Gathered {
    window: f32,
    lamp: f32,
    around: Vec3,
}

const BOUNCE_REACH_M: f32 = 1.6;
const AWAY_M: f32 = 1e-3;
const FAR_M: f32 = 100.0;

/// Draws what `camera` sees of `room`.
pub fn render(room: &Room, camera: &Camera) -> Frame {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut points = Vec::with_capacity(width * height);
    let mut depth_m = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let ray = camera.ray(u as f32, v as f32);
            let length = ray.length();
            let point = look(room, camera, ray / length);
            depth_m.push(point.t / length);
            points.push(point);
        }
    }
    let gathered: Vec<_> = (0..points.len())
        .map(|i| gather(room, &points[i], i % width % 4, i / width % 4))
        .collect();
    let smooth = average(&points, &gathered, width);
    let mut linear: Vec<_> = points
        .iter()
        .zip(&smooth)
        .map(|(point, light)| shade(room, point, light))
        .collect();
    soften_edges(room, camera, &points, &smooth, &mut linear);
    Frame {
        width: camera.width,
        height: camera.height,
        color: linear.into_iter().map(expose).collect(),
        depth_m,
    }
}

fn look(room: &Room, camera: &Camera, dir: Vec3) -> Point {
    let origin = camera.position_m;
    let Some(hit) = room.cast(origin, dir, FAR_M) else {
        return Point { dir, ..Point::default() };
    };
    let solid = &room.solids[hit.solid as usize];
    let at = origin + dir * hit.t;
    // A slanting surface spreads over more metres a pixel.
    let slant = (-dir.dot(hit.normal)).max(0.25);
    let pixel_m = hit.t / camera.focal_px / slant.sqrt();
    let local_normal = solid.axes.transpose_mul_vec3(hit.normal);
    Point {
        solid: hit.solid,
        t: hit.t,
        at,
        normal: hit.normal,
        albedo: solid
            .look
            .colour(solid.to_local(at), local_normal, solid.shape.half_size(), pixel_m),
        dir,
    }
}

/// One ray to a point of each light and one to anywhere, chosen by the pixel's place (`i`, `j`) in the 4 by 4 pattern.
fn gather(room: &Room, point: &Point, i: usize, j: usize) -> Gathered {
    let origin = point.at + point.normal * AWAY_M;
    // A Latin arrangement: neighbours in both directions get strata that lie far apart.
    let (a, b) = ((i + 2 * j) % 4, (j + 2 * (i / 2) + i) % 4);
    let seen = |light: &Light| {
        let spot = light.center
            + light.spread[0] * (0.5 * a as f32 - 0.75)
            + light.spread[1] * (0.5 * b as f32 - 0.75);
        let to = spot - origin;
        let facing = light.facing == Vec3::ZERO || to.dot(light.facing) < 0.0;
        if !facing || to.dot(point.normal) <= 0.0 {
            return 0.0;
        }
        let away = to.length();
        if room.blocked(origin, to / away, away) { 0.0 } else { 1.0 }
    };
    let dir = hemisphere(point.normal, i + 4 * j);
    let around = match room.cast(origin, dir, BOUNCE_REACH_M) {
        // What is near gives back the light of its own colour, and keeps the rest away.
        Some(hit) => {
            let near = 1.0 - hit.t / BOUNCE_REACH_M;
            let look = &room.solids[hit.solid as usize].look;
            let tone = look.tones[0].lerp(look.tones[1], 0.5);
            let bounced = tone * (0.34 + 0.5 * look.glow);
            surroundings(dir).lerp(bounced, near.sqrt())
        }
        None => surroundings(dir),
    };
    Gathered {
        window: seen(&room.window),
        lamp: seen(&room.lamp),
        around,
    }
}

/// One of 16 directions, denser around `normal` in proportion to its cosine.
fn hemisphere(normal: Vec3, index: usize) -> Vec3 {
    // Malley's method on a sunflower of 16 points.
    const GOLDEN: f32 = 2.399_963;
    let radius = ((index as f32 + 0.5) / 16.0).sqrt();
    let (sin, cos) = libm::sincosf(index as f32 * GOLDEN);
    let side = if normal.z.abs() < 0.9 { Vec3::Z } else { Vec3::X };
    let x = side.cross(normal).normalize_or(Vec3::X);
    let y = normal.cross(x);
    x * (radius * cos) + y * (radius * sin) + normal * (1.0 - radius * radius).sqrt()
}

/// Light from the rest of the room: a pale ceiling above, warm floor below.
fn surroundings(dir: Vec3) -> Vec3 {
    let up = 0.5 + 0.5 * dir.z;
    Vec3::new(0.30, 0.26, 0.22).lerp(Vec3::new(0.60, 0.61, 0.62), up)
}

/// Averages light over the 4 by 4 pixels around each, as far as they belong to the same smooth surface.
fn average(points: &[Point], gathered: &[Gathered], width: usize) -> Vec<Gathered> {
    let height = points.len() / width;
    let mut smooth = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let (u, v) = (i % width, i / width);
        let u0 = u.saturating_sub(2).min(width.saturating_sub(4));
        let v0 = v.saturating_sub(2).min(height.saturating_sub(4));
        let mut sum = Gathered::default();
        let mut count = 0.0f32;
        let apart = 0.01 + 0.008 * point.t;
        for row in v0..(v0 + 4).min(height) {
            for k in row * width + u0..row * width + (u0 + 4).min(width) {
                let other = &points[k];
                let same = other.normal.dot(point.normal) > 0.85
                    && (other.at - point.at).dot(point.normal).abs() < apart;
                if same {
                    let light = &gathered[k];
                    sum.window += light.window;
                    sum.lamp += light.lamp;
                    sum.around += light.around;
                    count += 1.0;
                }
            }
        }
        let share = 1.0 / count.max(1.0);
        smooth.push(Gathered {
            window: sum.window * share,
            lamp: sum.lamp * share,
            around: sum.around * share,
        });
    }
    smooth
}

/// Linear RGB that leaves `point` towards the camera.
fn shade(room: &Room, point: &Point, light: &Gathered) -> Vec3 {
    let look = &room.solids[point.solid as usize].look;
    let mut diffuse = light.around;
    let mut shine = Vec3::ZERO;
    for (source, seen) in [(&room.window, light.window), (&room.lamp, light.lamp)] {
        let to = source.center - point.at;
        let away = to.length().max(1e-3);
        let to = to / away;
        let given = if source.facing == Vec3::ZERO { 1.0 } else { 0.25 + 0.75 * (-to.dot(source.facing)).max(0.0) };
        let power = source.power * (seen * given / (0.6 + away * away));
        diffuse += power * to.dot(point.normal).max(0.0);
        if look.gloss > 0.0 {
            // Blinn and Phong with exponent 32.
            let half = (to - point.dir).normalize_or(point.normal);
            let mut h = half.dot(point.normal).max(0.0);
            for _ in 0..5 {
                h *= h;
            }
            shine += power * (h * look.gloss);
        }
    }
    point.albedo * (diffuse * (1.0 - look.glow) + look.glow) + 0.35 * shine
}

/// Casts three more rays where neighbours belong to different surfaces, with the light of the pixel next to it that
/// belongs to what the ray found.
fn soften_edges(room: &Room, camera: &Camera, points: &[Point], smooth: &[Gathered], linear: &mut [Vec3]) {
    let width = camera.width as usize;
    let sharp = linear.to_vec();
    for i in 0..points.len() {
        let (u, v) = (i % width, i / width);
        let mut around = [i; 4];
        for (slot, (k, inside)) in around.iter_mut().zip([
            (i.wrapping_sub(1), u > 0),
            (i + 1, u + 1 < width),
            (i.wrapping_sub(width), v > 0),
            (i + width, i + width < points.len()),
        ]) {
            if inside {
                *slot = k;
            }
        }
        let here = &points[i];
        let differs = |k: &usize| {
            let other = &points[*k];
            (other.solid != here.solid || other.normal.dot(here.normal) < 0.8)
                && (sharp[*k] - sharp[i]).abs().max_element() > 0.04
        };
        if !around.iter().any(differs) {
            continue;
        }
        let mut sum = sharp[i];
        for (dx, dy) in [(0.375, 0.125), (-0.125, 0.375), (-0.25, -0.375)] {
            let dir = camera.ray(u as f32 + dx, v as f32 + dy).normalize();
            let point = look(room, camera, dir);
            let like = |k: &usize| points[*k].solid == point.solid && points[*k].normal.dot(point.normal) > 0.8;
            let source = std::iter::once(i).chain(around).find(like).unwrap_or(i);
            sum += shade(room, &point, &smooth[source]);
        }
        linear[i] = sum * 0.25;
    }
}

/// Linear light to sRGB through a film curve (the ACES fit by Narkowicz, 2015).
fn expose(linear: Vec3) -> [u8; 3] {
    let x = linear * 0.62;
    let film = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
    film.to_array().map(to_srgb)
}

/// A number in `[0, 1)` for a pixel of a frame, for the sensor's noise.
pub(crate) fn pixel_chance(frame: usize, pixel: usize, draw: i32) -> f32 {
    hash_unit(pixel as i32, frame as i32, draw, 0x5EED)
}
