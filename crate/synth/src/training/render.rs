//! Pictures of a training room in linear light: direct light with soft and hard shadows, one bounce, highlights.
//!
//! As in the sample's renderer, each pixel gathers along one of 64 directions and lights are jittered by one of 16
//! places; sums over the pixels around it make that smooth. Lights smaller than a hand cast hard shadows, which are not
//! smoothed.

use glam::Vec3;

use crate::path::View;
use crate::training::room::TrainingRoom;

/// Colour before the camera, and exact depth.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    pub width: usize,
    pub color: Vec<Vec3>,
    /// Along the optical axis in metres; 0 where a ray meets nothing.
    pub depth_m: Vec<f32>,
}

/// What the first ray of a pixel found.
#[derive(Clone, Copy, Default)]
struct Point {
    solid: u32,
    t: f32,
    at: Vec3,
    normal: Vec3,
    albedo: Vec3,
    dir: Vec3,
}

/// Light that arrives at a point, linear RGB.
#[derive(Clone, Copy, Default)]
pub(crate) struct Arriving {
    /// From small lights.
    pub crisp: Vec3,
    /// From large ones.
    pub soft: Vec3,
    /// What is mirrored to the eye, of a surface of gloss 1.
    pub shine: Vec3,
    /// From other surfaces.
    pub around: Vec3,
}

const AWAY_M: f32 = 1e-3;
const FAR_M: f32 = 100.0;
/// Half the side of the largest light that casts hard shadows.
const SMALL_M: f32 = 0.03;
/// Light weaker than this share of what else there is, is left out.
const FAINT: f32 = 0.01;
const BLOCK: usize = 8;

/// Draws what `view` sees.
pub(crate) fn trace(room: &TrainingRoom, view: &View) -> Linear {
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let mut points = Vec::with_capacity(width * height);
    let mut depth_m = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let ray = view.ray(u as f32, v as f32);
            let length = ray.length();
            let point = look(room, view, ray / length);
            depth_m.push(point.t / length);
            points.push(point);
        }
    }
    let probes = probes();
    let mut light: Vec<_> = (0..points.len())
        .map(|i| {
            let probe = &probes[i / width % BLOCK * BLOCK + i % width % BLOCK];
            arriving(room, &points[i], probe)
        })
        .collect();
    smooth(&points, &mut light, width);
    let mut color: Vec<_> = points
        .iter()
        .zip(&light)
        .map(|(point, light)| shade(room, point, light))
        .collect();
    soften_edges(room, view, &points, &light, &mut color);
    Linear {
        width,
        color,
        depth_m,
    }
}

/// Exact depth alone.
pub(crate) fn depth(room: &TrainingRoom, view: &View) -> Vec<f32> {
    let (width, height) = (view.camera.width, view.camera.height);
    (0..width * height)
        .map(|i| {
            let ray = view.ray((i % width) as f32, (i / width) as f32);
            let length = ray.length();
            let hit = room.scene.cast(view.position_m, ray / length, FAR_M);
            hit.map_or(0.0, |hit| hit.t / length)
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
    let solid = &room.scene.solids[hit.solid as usize];
    let at = origin + dir * hit.t;
    // A slanting surface spreads over more metres a pixel.
    let slant = (-dir.dot(hit.normal)).max(0.25);
    let pixel_m = hit.t / view.camera.fx as f32 / slant.sqrt();
    let local_normal = solid.axes.transpose_mul_vec3(hit.normal);
    let albedo = solid.look.colour(
        solid.to_local(at),
        local_normal,
        solid.shape.half_size(),
        pixel_m,
    );
    Point {
        solid: hit.solid,
        t: hit.t,
        at,
        normal: hit.normal,
        albedo,
        dir,
    }
}

/// One of the ways in which pixels gather light; 64 of them fill a block.
struct Probe {
    /// Direction over a surface whose normal is z, denser around it in proportion to the cosine.
    dir: Vec3,
    /// Place on a light, -1 to 1 both ways; 16 of them fill a quarter of a block.
    spot: [f32; 2],
}

fn probes() -> Vec<Probe> {
    const GOLDEN: f32 = 2.399_963;
    let count = BLOCK * BLOCK;
    (0..count)
        .map(|at| {
            let (x, y) = (at % BLOCK, at / BLOCK);
            // The ordered dither matrix of Bayer (1973), from the lowest bit of x and y upwards.
            let bits = |bit: usize| ((x ^ y) >> bit & 1) << 1 | y >> bit & 1;
            let index = bits(0) << 4 | bits(1) << 2 | bits(2);
            let quarter = bits(0) << 2 | bits(1);
            let share = (index as f32 + 0.5) / count as f32;
            let (sin, cos) = libm::sincosf(index as f32 * GOLDEN);
            let radius = share.sqrt();
            let mirrored = (quarter as u32).reverse_bits() >> 28;
            Probe {
                dir: Vec3::new(radius * cos, radius * sin, (1.0 - share).sqrt()),
                spot: [(quarter as f32 - 7.5) / 8.0, (mirrored as f32 - 7.5) / 8.0],
            }
        })
        .collect()
}

/// Light straight from the lights at `at`, just above a surface. `dir` comes from the eye.
pub(crate) fn direct(
    room: &TrainingRoom,
    at: Vec3,
    normal: Vec3,
    spot: [f32; 2],
    dir: Vec3,
    gloss: f32,
    enough: f32,
) -> Arriving {
    let mut sum = Arriving::default();
    for light in &room.lights {
        let spread = light.spread[0] * spot[0] + light.spread[1] * spot[1];
        let to = light.center + spread - at;
        let facing = if light.facing == Vec3::ZERO {
            1.0
        } else {
            -to.dot(light.facing)
        };
        let cosine = to.dot(normal);
        if facing <= 0.0 || cosine <= 0.0 {
            continue;
        }
        let square = to.length_squared();
        let away = square.sqrt();
        let given = if light.facing == Vec3::ZERO {
            1.0
        } else {
            0.15 + 0.85 * facing / away
        };
        let size = light.spread[0].length_squared() + light.spread[1].length_squared();
        let power = light.power * (given / (0.12 + 0.6 * size + square));
        let fall = power * (cosine / away);
        if fall.max_element() < enough || room.scene.blocked(at, to / away, away) {
            continue;
        }
        if size < SMALL_M * SMALL_M {
            sum.crisp += fall;
        } else {
            sum.soft += fall;
        }
        if gloss > 0.0 {
            // Blinn and Phong with exponent 64; a light seen at a low angle shines more.
            let half = (to / away - dir).normalize_or(normal);
            let mut h = half.dot(normal).max(0.0);
            for _ in 0..6 {
                h *= h;
            }
            let low = 1.0 + dir.dot(normal).clamp(-1.0, 0.0);
            sum.shine += power * (h * (0.5 + 2.0 * low * low));
        }
    }
    sum
}

/// Light at a pixel: straight from the lights, and from wherever one ray goes.
fn arriving(room: &TrainingRoom, point: &Point, probe: &Probe) -> Arriving {
    if point.t == 0.0 {
        return Arriving::default();
    }
    let origin = point.at + point.normal * AWAY_M;
    let solid = &room.scene.solids[point.solid as usize];
    let ambient = room.ambient_at(point.at);
    let enough = FAINT * ambient.max_element();
    let mut light = direct(
        room,
        origin,
        point.normal,
        probe.spot,
        point.dir,
        solid.look.gloss,
        enough,
    );
    let side = if point.normal.z.abs() < 0.9 {
        Vec3::Z
    } else {
        Vec3::X
    };
    let x = side.cross(point.normal).normalize_or(Vec3::X);
    let y = point.normal.cross(x);
    let dir = x * probe.dir.x + y * probe.dir.y + point.normal * probe.dir.z;
    light.around = match room.scene.cast(origin, dir, FAR_M) {
        Some(hit) => {
            let other = &room.scene.solids[hit.solid as usize].look;
            let tone = other.tones[0].lerp(other.tones[1], 0.5);
            let there = origin + dir * hit.t + hit.normal * AWAY_M;
            let ambient = room.ambient_at(there);
            tone * (strongest(room, there, hit.normal) + ambient)
        }
        None => ambient,
    };
    light
}

/// Light from the one lamp or window that would give most without shadows.
fn strongest(room: &TrainingRoom, at: Vec3, normal: Vec3) -> Vec3 {
    let mut best = (0.0, Vec3::ZERO, Vec3::ZERO);
    for light in &room.lights {
        let to = light.center - at;
        let facing = if light.facing == Vec3::ZERO {
            1.0
        } else {
            -to.dot(light.facing)
        };
        let cosine = to.dot(normal);
        if facing <= 0.0 || cosine <= 0.0 {
            continue;
        }
        let square = to.length_squared();
        let away = square.sqrt();
        let given = if light.facing == Vec3::ZERO {
            1.0
        } else {
            0.15 + 0.85 * facing / away
        };
        let size = light.spread[0].length_squared() + light.spread[1].length_squared();
        let fall = light.power * (given * cosine / away / (0.12 + 0.6 * size + square));
        if fall.element_sum() > best.0 {
            best = (fall.element_sum(), fall, to);
        }
    }
    let away = best.2.length();
    if best.0 == 0.0 || room.scene.blocked(at, best.2 / away, away) {
        return Vec3::ZERO;
    }
    best.1
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
                        sum.around += here.around;
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
                around: sum.around * share,
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

/// Casts three more rays where neighbours belong to different surfaces, with the light of the pixel next to it that
/// belongs to what the ray found.
fn soften_edges(
    room: &TrainingRoom,
    view: &View,
    points: &[Point],
    light: &[Arriving],
    color: &mut [Vec3],
) {
    let width = view.camera.width as usize;
    let sharp = color.to_vec();
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
                && (sharp[*k] - sharp[i]).abs().max_element()
                    > 0.04 * (0.1 + sharp[i].max_element())
        };
        if !around.iter().any(differs) {
            continue;
        }
        let mut sum = sharp[i];
        for (dx, dy) in [(0.375, 0.125), (-0.125, 0.375), (-0.25, -0.375)] {
            let dir = view.ray(u as f32 + dx, v as f32 + dy).normalize();
            let point = look(room, view, dir);
            let like = |k: &usize| {
                points[*k].solid == point.solid && points[*k].normal.dot(point.normal) > 0.8
            };
            let source = std::iter::once(i).chain(around).find(like).unwrap_or(i);
            sum += shade(room, &point, &light[source]);
        }
        color[i] = sum * 0.25;
    }
}
