//! The light that arrives at a surface: straight from lamps and windows, and by one bounce.

use glam::Vec3;

use crate::point::Point;
use crate::room::Light;
use crate::training::room::TrainingRoom;

/// Light that arrives at a point, linear RGB.
#[derive(Clone, Copy, Default)]
pub(crate) struct Arriving {
    /// From small lights.
    pub crisp: Vec3,
    /// From large ones.
    pub soft: Vec3,
    /// What is mirrored to the eye, of a surface of gloss 1.
    pub shine: Vec3,
    /// From other surfaces, and what that counts in an average: every other pixel only guesses.
    pub around: Vec3,
    pub certainty: f32,
}

pub(crate) const AWAY_M: f32 = 1e-3;
pub(crate) const FAR_M: f32 = 100.0;
/// Half the side of the largest light that casts hard shadows.
const SMALL_M: f32 = 0.03;
/// Light weaker than this share of what else there is, is left out.
const FAINT: f32 = 0.01;
/// What a bounced ray brings counts up to this many times the ambient light.
const BRIGHTEST: f32 = 4.0;
/// What the ambient light counts beside a ray's.
const GUESS: f32 = 1e-3;
/// Side of the square of pixels that gather light in different ways.
pub(crate) const BLOCK: usize = 8;

/// One of the ways in which pixels gather light.
pub(crate) struct Probe {
    /// Direction over a surface whose normal is z, denser around it in proportion to the cosine.
    pub dir: Vec3,
    /// Place on a light, -1 to 1 both ways; 16 of them fill a quarter of a block.
    pub spot: [f32; 2],
    /// Every other probe asks where its direction leads.
    pub bounces: bool,
}

/// The probes of a block, row by row.
pub(crate) fn probes() -> Vec<Probe> {
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
                bounces: (x + y).is_multiple_of(2),
                spot: [(quarter as f32 - 7.5) / 8.0, (mirrored as f32 - 7.5) / 8.0],
            }
        })
        .collect()
}

/// A light as a surface sees it that lies before it and that it shines on.
struct Sight {
    /// Distance in metres.
    away: f32,
    /// Of the angle to the normal, times `away`.
    cosine: f32,
    /// What it gives in this direction.
    given: f32,
    /// The square of its size.
    size: f32,
    /// By how much distance and size weaken it.
    spent: f32,
}

impl Sight {
    /// `to` leads from the surface to the light.
    fn new(light: &Light, to: Vec3, normal: Vec3) -> Option<Self> {
        let to_all_sides = light.facing == Vec3::ZERO;
        let facing = if to_all_sides {
            1.0
        } else {
            -to.dot(light.facing)
        };
        let cosine = to.dot(normal);
        if facing <= 0.0 || cosine <= 0.0 {
            return None;
        }
        let square = to.length_squared();
        let away = square.sqrt();
        let size = light.spread[0].length_squared() + light.spread[1].length_squared();
        Some(Self {
            away,
            cosine,
            given: if to_all_sides {
                1.0
            } else {
                0.15 + 0.85 * facing / away
            },
            size,
            spent: 0.12 + 0.6 * size + square,
        })
    }
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
        let Some(Sight {
            away,
            cosine,
            given,
            size,
            spent,
        }) = Sight::new(light, to, normal)
        else {
            continue;
        };
        let power = light.power * (given / spent);
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
pub(crate) fn arriving(room: &TrainingRoom, point: &Point, probe: &Probe) -> Arriving {
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
    (light.around, light.certainty) = (ambient, GUESS);
    if !probe.bounces {
        return light;
    }
    let side = if point.normal.z.abs() < 0.9 {
        Vec3::Z
    } else {
        Vec3::X
    };
    let x = side.cross(point.normal).normalize_or(Vec3::X);
    let y = point.normal.cross(x);
    let dir = x * probe.dir.x + y * probe.dir.y + point.normal * probe.dir.z;
    light.certainty = 1.0;
    light.around = match room.scene.cast(origin, dir, FAR_M) {
        Some(hit) => {
            let other = &room.scene.solids[hit.solid as usize].look;
            let tone = other.tones[0].lerp(other.tones[1], 0.5);
            let there = origin + dir * hit.t + hit.normal * AWAY_M;
            let back = room.ambient_at(there);
            let given = tone * (strongest(room, there, hit.normal) + back);
            // One bright spot beside a lamp or behind a door would show as blocks: one ray finds it and those of the
            // pixels around do not.
            given.min(Vec3::splat(BRIGHTEST * ambient.max_element()))
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
        let Some(Sight {
            away,
            cosine,
            given,
            spent,
            ..
        }) = Sight::new(light, to, normal)
        else {
            continue;
        };
        let fall = light.power * (given * cosine / away / spent);
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
