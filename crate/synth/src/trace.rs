//! A frame of the room by ray casting: exact depth, and a colour with two soft lights, sky and bounced light.
//!
//! Light is gathered with one ray a pixel to each light and one to anywhere, in a repeating pattern of 64 directions,
//! and then averaged over the same surface, so that every pixel gets the sum of many directions for the price of one
//! (interleaved sampling, Keller and Heidrich 2001).

use glam::Vec3;

use crate::palette::to_srgb;
use crate::path::View;
use crate::point::{Point, soften_edges};
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
const EXPOSURE: f32 = 0.62;

/// Draws what `view` sees of `room`.
pub fn render(room: &Room, view: &View) -> Frame {
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let mut points = Vec::with_capacity(width * height);
    let mut depth_m = Vec::with_capacity(width * height);
    for_each_ray(view, |dir, length| {
        let point = look(room, view, dir);
        depth_m.push(point.t / length);
        points.push(point);
    });
    let probes = probes();
    let gathered: Vec<_> = (0..points.len())
        .map(|i| {
            gather(
                room,
                &points[i],
                &probes[i / width % BLOCK * BLOCK + i % width % BLOCK],
            )
        })
        .collect();
    // Quarters of a block first, then the four quarters: the whole block for 20 looks instead of 64.
    let quarters = average(&points, &gathered, width, BLOCK / 2, 1);
    let smooth = average(&points, &quarters, width, 2, BLOCK / 2);
    let mut linear: Vec<_> = points
        .iter()
        .zip(&smooth)
        .map(|(point, light)| shade(room, point, light))
        .collect();
    soften_edges(
        view,
        &points,
        &mut linear,
        |here, there| (there - here).abs().max_element() > 0.04,
        |dir| look(room, view, dir),
        |point, source| shade(room, point, &smooth[source]),
    );
    Frame {
        width: view.camera.width,
        height: view.camera.height,
        color: expose(&linear),
        depth_m,
    }
}

/// The depth of [`render`] alone, in metres along the optical axis, row by row from the top.
pub fn depth(room: &Room, view: &View) -> Vec<f32> {
    let mut depth_m = Vec::with_capacity(view.camera.width as usize * view.camera.height as usize);
    for_each_ray(view, |dir, length| {
        let t = room
            .scene
            .cast(view.position_m, dir, FAR_M)
            .map_or(0.0, |hit| hit.t);
        depth_m.push(t / length);
    });
    depth_m
}

/// Gives the unit direction of each pixel's ray, and its length where its part along the optical axis is 1.
fn for_each_ray(view: &View, mut visit: impl FnMut(Vec3, f32)) {
    for v in 0..view.camera.height {
        for u in 0..view.camera.width {
            let ray = view.ray(u as f32, v as f32);
            let length = ray.length();
            visit(ray / length, length);
        }
    }
}

fn look(room: &Room, view: &View, dir: Vec3) -> Point {
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
    Point {
        solid: hit.solid,
        t: hit.t,
        at,
        normal: hit.normal,
        albedo: solid.look.colour(
            solid.to_local(at),
            local_normal,
            solid.shape.half_size(),
            pixel_m,
        ),
        dir,
    }
}

/// One of the ways in which pixels gather light; 64 of them fill an 8 by 8 block.
struct Probe {
    /// Direction over a surface whose normal is z, denser around it in proportion to the cosine.
    dir: Vec3,
    /// Place on a light, -1 to 1 both ways.
    spot: [f32; 2],
}

const BLOCK: usize = 8;

/// The probes of a block, row by row, ordered so that its 4 by 4 quarters are spread evenly as well.
fn probes() -> Vec<Probe> {
    const GOLDEN: f32 = 2.399_963;
    let count = BLOCK * BLOCK;
    (0..count)
        .map(|at| {
            let (x, y) = (at % BLOCK, at / BLOCK);
            // The ordered dither matrix of Bayer (1973), from the lowest bit of x and y upwards.
            let bits = |bit: usize| ((x ^ y) >> bit & 1) << 1 | y >> bit & 1;
            let index = bits(0) << 4 | bits(1) << 2 | bits(2);
            let share = (index as f32 + 0.5) / count as f32;
            // Malley's method on a sunflower; Hammersley's points on the light.
            let (sin, cos) = libm::sincosf(index as f32 * GOLDEN);
            let radius = share.sqrt();
            let mirrored = (index as u32).reverse_bits() as f32 / 4_294_967_296.0;
            Probe {
                dir: Vec3::new(radius * cos, radius * sin, (1.0 - share).sqrt()),
                spot: [2.0 * share - 1.0, 2.0 * mirrored - 1.0],
            }
        })
        .collect()
}

/// One ray to a point of each light and one to anywhere.
fn gather(room: &Room, point: &Point, probe: &Probe) -> Gathered {
    let origin = point.at + point.normal * AWAY_M;
    let seen = |light: &Light| {
        let spot = light.center + light.spread[0] * probe.spot[0] + light.spread[1] * probe.spot[1];
        let to = spot - origin;
        let facing = light.facing == Vec3::ZERO || to.dot(light.facing) < 0.0;
        if !facing || to.dot(point.normal) <= 0.0 {
            return 0.0;
        }
        let away = to.length();
        if room.scene.blocked(origin, to / away, away) {
            0.0
        } else {
            1.0
        }
    };
    let side = if point.normal.z.abs() < 0.9 {
        Vec3::Z
    } else {
        Vec3::X
    };
    let x = side.cross(point.normal).normalize_or(Vec3::X);
    let y = point.normal.cross(x);
    let dir = x * probe.dir.x + y * probe.dir.y + point.normal * probe.dir.z;
    let around = match room.scene.cast(origin, dir, BOUNCE_REACH_M) {
        // What is near gives back the light of its own colour, and keeps the rest away.
        Some(hit) => {
            let near = 1.0 - hit.t / BOUNCE_REACH_M;
            let look = &room.scene.solids[hit.solid as usize].look;
            let tone = look.tones[0].lerp(look.tones[1], 0.5);
            let bounced = tone * (0.30 + 0.5 * look.glow);
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

/// Light from the rest of the room: a pale ceiling above, warm floor below.
fn surroundings(dir: Vec3) -> Vec3 {
    let up = 0.5 + 0.5 * dir.z;
    Vec3::new(0.30, 0.27, 0.23).lerp(Vec3::new(0.60, 0.60, 0.59), up)
}

/// Averages light over `taps` by `taps` pixels around each, `step` apart, as far as they belong to the same smooth
/// surface.
fn average(
    points: &[Point],
    gathered: &[Gathered],
    width: usize,
    taps: usize,
    step: usize,
) -> Vec<Gathered> {
    let height = points.len() / width;
    let span = taps * step;
    let start = |at: usize, size: usize| at.saturating_sub(span / 2).min(size.saturating_sub(span));
    let mut smooth = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let (u0, v0) = (start(i % width, width), start(i / width, height));
        let apart = 0.01 + 0.01 * point.t;
        let mut sum = Gathered::default();
        let mut count = 0.0f32;
        for v in (v0..height.min(v0 + span)).step_by(step) {
            for u in (u0..width.min(u0 + span)).step_by(step) {
                let other = &points[v * width + u];
                let same = other.normal.dot(point.normal) > 0.85
                    && (other.at - point.at).dot(point.normal).abs() < apart;
                if same {
                    let light = &gathered[v * width + u];
                    sum.window += light.window;
                    sum.lamp += light.lamp;
                    sum.around += light.around;
                    count += 1.0;
                }
            }
        }
        if count == 0.0 {
            smooth.push(gathered[i]);
            continue;
        }
        let share = 1.0 / count;
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
    let look = &room.scene.solids[point.solid as usize].look;
    let mut diffuse = light.around;
    let mut shine = Vec3::ZERO;
    for (source, seen) in [(&room.window, light.window), (&room.lamp, light.lamp)] {
        let to = source.center - point.at;
        let away = to.length().max(1e-3);
        let to = to / away;
        let given = if source.facing == Vec3::ZERO {
            1.0
        } else {
            0.25 + 0.75 * (-to.dot(source.facing)).max(0.0)
        };
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

/// Linear light to sRGB through a film curve (the ACES fit by Narkowicz, 2015).
fn expose(linear: &[Vec3]) -> Vec<[u8; 3]> {
    // Square roots spread the dark end of the table as the eye does.
    const STEPS: f32 = 1023.0;
    let table: Vec<u8> = (0..=STEPS as u32)
        .map(|i| i as f32 / STEPS)
        .map(|root| to_srgb(root * root))
        .collect();
    let channel = |x: f32| {
        let film = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
        table[(film.clamp(0.0, 1.0).sqrt() * STEPS + 0.5) as usize]
    };
    linear
        .iter()
        .map(|light| (*light * EXPOSURE).to_array().map(channel))
        .collect()
}
