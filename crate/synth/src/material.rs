//! More surfaces: what walls, floors and things are made of in the rooms to learn from.

use glam::{Vec2, Vec3};

use crate::random::{hash, hash_unit, noise};
use crate::texture::{Look, Pattern, stroke, unfold};

/// Linear RGB of the patterns that [`Look::colour`] leaves to this file; the same arguments, already scaled.
pub(crate) fn colour(look: &Look, p: Vec3, normal: Vec3, half: Vec3, pixel_m: f32) -> Vec3 {
    let [a, b, c] = look.tones;
    let seed = look.seed;
    let fine = |period: f32| (1.0 - pixel_m / period).max(0.0);
    let uneven = |amount: f32, scale: f32| 1.0 + amount * (noise(p * scale, seed) - 0.5);
    let flat = unfold(p, normal);
    match look.pattern {
        Pattern::Tiles => tiles(flat, pixel_m, look) * uneven(0.06, 3.0),
        Pattern::Bricks => bricks(flat, pixel_m, look) * uneven(0.25 * fine(0.05), 40.0),
        Pattern::Parquet => parquet(flat, pixel_m, look),
        Pattern::Panels => panels(flat, pixel_m, look),
        Pattern::Carpet => {
            let loops = noise(p * 210.0, seed) - 0.5;
            let worn = noise(p * 3.0, seed + 1) - 0.5;
            let fleck = step(noise(p * 60.0, seed + 2), 0.78) * fine(0.02);
            let pile = a.lerp(
                b,
                (0.5 + 0.8 * loops * fine(0.007) + 0.4 * worn).clamp(0.0, 1.0),
            );
            pile.lerp(c, 0.5 * fleck)
        }
        Pattern::Marble => marble(p, look, fine(0.04)),
        Pattern::Concrete => {
            let clouds = fractal(p * 1.3, seed) - 0.5;
            let pores = step(noise(p * 55.0, seed + 3), 0.83) * fine(0.03);
            let crack = (fractal(p * 0.9, seed + 4) - 0.5).abs();
            let line = stroke(crack * 0.6, 0.004, pixel_m) * step(noise(p * 0.7, seed + 5), 0.66);
            a * (1.0 + 0.7 * clouds) * (1.0 - 0.35 * pores) * (1.0 - 0.5 * line)
        }
        Pattern::Terrazzo => {
            let chip = |scale: f32, k: u32| {
                let v = noise(p * scale, seed + k);
                step(v, 0.68) * fine(2.0 / scale)
            };
            let stone = noise(p * 11.0, seed + 9);
            let mixed = if stone > 0.5 { b } else { c };
            a.lerp(mixed, chip(38.0, 0))
                .lerp(c, chip(65.0, 1))
                .lerp(b, chip(95.0, 2))
        }
        Pattern::Poster => poster(flat, unfold(half, normal), pixel_m, look),
        Pattern::Map => {
            let height = fractal(p * 4.0 / half.max_element().max(0.05), seed);
            let land = if height > 0.62 { c } else { b };
            let coast = stroke((height - 0.5) * 0.2, 0.004, pixel_m);
            let grid = (flat * 9.0 / half.max_element()).fract_gl();
            let line = if grid.min_element() < 0.04 { 0.2 } else { 0.0 };
            let ground = if height > 0.5 { land } else { a };
            ground * (0.85 + 0.3 * fractal(p * 30.0, seed + 1)) * (1.0 - 0.6 * coast) * (1.0 - line)
        }
        Pattern::Photo => photo(p, half, look),
        Pattern::Flowers => flowers(flat, pixel_m, look) * uneven(0.05, 3.0),
        Pattern::Bands => {
            let d = (flat.x / 0.18).rem_euclid(1.0) - 0.5;
            a.lerp(b, stroke(d * 0.18, 0.09, pixel_m)) * uneven(0.04, 3.0)
        }
        Pattern::Leather => {
            let crease = (noise(p * 90.0, seed) - 0.5).abs() * 2.0;
            a * (1.0 - 0.3 * (1.0 - crease) * fine(0.03)) * uneven(0.35, 7.0)
        }
        Pattern::Metal => {
            let scratch = noise(p * Vec3::new(6.0, 400.0, 400.0), seed) - 0.5;
            a * (1.0 + 0.3 * scratch * fine(0.02)) * uneven(0.2, 2.0)
        }
        Pattern::Books => books(p, normal, half, pixel_m, seed),
        Pattern::Folds => {
            let bend = 0.5 * noise(p * 2.5, seed);
            let wave = libm::sinf((flat.x * 1.0 + 0.25 * bend) * 55.0 + 6.0 * bend);
            let thread = noise(p * 170.0, seed) - 0.5;
            a.lerp(
                b,
                (0.5 + 0.4 * wave + 0.3 * thread * fine(0.012)).clamp(0.0, 1.0),
            )
        }
        _ => a,
    }
}

fn step(value: f32, edge: f32) -> f32 {
    ((value - edge) * 10.0).clamp(0.0, 1.0)
}

/// Four octaves of noise, 0 to 1.
fn fractal(p: Vec3, seed: u32) -> f32 {
    let mut sum = 0.0;
    let mut weight = 0.533;
    let mut q = p;
    for octave in 0..4 {
        sum += weight * noise(q, seed.wrapping_add(17 * octave));
        q = q * 2.03 + 0.37;
        weight *= 0.5;
    }
    sum
}

fn tiles(flat: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    let [a, b, joint] = look.tones;
    let kind = look.seed % 5;
    let side = match kind {
        0 | 1 => Vec2::splat(0.2),
        2 => Vec2::new(0.3, 0.15),
        3 => Vec2::new(0.6, 0.3),
        _ => Vec2::splat(0.1),
    };
    let row = (flat.y / side.y).floor();
    let shift = if kind == 2 || kind == 3 {
        0.5 * (row as i32).rem_euclid(2) as f32
    } else {
        0.0
    };
    let cell = Vec2::new(flat.x / side.x + shift, flat.y / side.y);
    let id = cell.floor();
    let inside = (cell - id).min(Vec2::ONE - (cell - id)) * side;
    let tone = if kind == 1 {
        ((id.x + id.y) as i32).rem_euclid(2) as f32
    } else {
        hash_unit(id.x as i32, id.y as i32, 3, look.seed)
    };
    let line = stroke(inside.min_element(), 0.007, pixel_m);
    let speck = noise(
        Vec3::new(flat.x * 30.0, flat.y * 30.0, tone * 9.0),
        look.seed,
    ) - 0.5;
    let glaze = a.lerp(b, tone) * (1.0 + 0.14 * speck * (1.0 - pixel_m / 0.06).max(0.0));
    glaze.lerp(joint, line)
}

fn bricks(flat: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    let [a, b, mortar] = look.tones;
    let side = Vec2::new(0.23, 0.073);
    let row = (flat.y / side.y).floor();
    let cell = Vec2::new(
        flat.x / side.x + 0.5 * (row as i32).rem_euclid(2) as f32,
        flat.y / side.y,
    );
    let id = cell.floor();
    let inside = (cell - id).min(Vec2::ONE - (cell - id)) * side;
    let tone = hash_unit(id.x as i32, id.y as i32, 5, look.seed);
    let ragged = 0.004 * noise(Vec3::new(flat.x * 70.0, flat.y * 70.0, 0.0), look.seed);
    a.lerp(b, tone).lerp(
        mortar,
        stroke(inside.min_element() - ragged, 0.011, pixel_m),
    )
}

fn grain(along: f32, across: f32, board: f32, pixel_m: f32, look: &Look) -> f32 {
    let q = Vec3::new(along, across, board);
    let bend = noise(q * Vec3::new(1.8, 11.0, 9.0), look.seed);
    let fibre = noise(q * Vec3::new(2.6, 80.0, 9.0) + bend * 2.5, look.seed + 1) - 0.5;
    0.3 * bend + 0.35 * fibre * (1.0 - pixel_m / 0.03).max(0.0)
}

fn parquet(flat: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    const SIDE_M: f32 = 0.36;
    const STRIPS: f32 = 5.0;
    let cell = flat / SIDE_M;
    let id = cell.floor();
    let place = (cell - id) * SIDE_M;
    let turned = ((id.x + id.y) as i32).rem_euclid(2) == 1;
    let (along, across) = if turned {
        (place.x, place.y)
    } else {
        (place.y, place.x)
    };
    let strip = (across / SIDE_M * STRIPS).floor();
    let beside = across - strip * SIDE_M / STRIPS;
    let board = hash_unit(id.x as i32, id.y as i32, strip as i32, look.seed);
    let gap = beside
        .min(SIDE_M / STRIPS - beside)
        .min(along)
        .min(SIDE_M - along);
    let share = 0.6 * board + grain(along, across, 7.0 * board + id.x, pixel_m, look);
    look.tones[0].lerp(look.tones[1], share) * (1.0 - 0.5 * stroke(gap, 0.004, pixel_m))
}

fn panels(flat: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    const WIDTH_M: f32 = 0.11;
    let board = (flat.x / WIDTH_M).floor();
    let beside = flat.x - board * WIDTH_M;
    let tone = hash_unit(board as i32, 0, 1, look.seed);
    let share = 0.4 * tone + grain(flat.y, beside, board, pixel_m, look);
    let groove = stroke(beside.min(WIDTH_M - beside), 0.01, pixel_m);
    look.tones[0].lerp(look.tones[1], share) * (1.0 - 0.55 * groove)
}

fn marble(p: Vec3, look: &Look, fine: f32) -> Vec3 {
    let [a, b, c] = look.tones;
    let warped = p * 1.7 + Vec3::splat(1.4 * fractal(p * 1.1, look.seed));
    let vein = |scale: f32, k: u32, width: f32| {
        let v = (fractal(warped * scale, look.seed + k) - 0.5).abs();
        (1.0 - v / width).max(0.0)
    };
    let clouds = 0.9 + 0.2 * fractal(p * 2.0, look.seed + 2);
    (a * clouds)
        .lerp(b, 0.75 * vein(1.0, 0, 0.035))
        .lerp(c, 0.6 * fine * vein(2.7, 5, 0.03))
}

fn flowers(flat: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    let [a, b, c] = look.tones;
    const CELL_M: f32 = 0.24;
    let cell = flat / CELL_M;
    let id = cell.floor();
    let pick = |k: i32| hash_unit(id.x as i32, id.y as i32, k, look.seed);
    let middle = Vec2::new(0.35 + 0.3 * pick(0), 0.35 + 0.3 * pick(1));
    let away = (cell - id - middle) * CELL_M;
    let radius = away.length();
    let angle = libm::atan2f(away.y, away.x);
    let petals = 0.045 * (0.6 + 0.5 * libm::sinf(5.0 * angle + 6.0 * pick(2)).abs());
    let bloom = ((petals - radius) / pixel_m.max(0.002) + 0.5).clamp(0.0, 1.0);
    let eye = ((0.013 - radius) / pixel_m.max(0.002) + 0.5).clamp(0.0, 1.0);
    // Stalks wind upwards through the cells.
    let bend = 0.2 * libm::sinf(flat.y * 19.0 + 3.0 * hash_unit(id.x as i32, 0, 9, look.seed));
    let stalk = stroke((cell.x - id.x - 0.5 - bend) * CELL_M, 0.008, pixel_m);
    let leaf_at = Vec2::new(
        cell.x - id.x - 0.5 - bend - 0.1,
        (cell.y * 2.0).rem_euclid(1.0) - 0.5,
    );
    let leaf = step(0.15 - (leaf_at * Vec2::new(1.6, 0.55)).length(), 0.0);
    let ground = a.lerp(b, 0.6 * stalk.max(0.8 * leaf));
    ground.lerp(c, bloom).lerp(b, eye)
}

fn poster(flat: Vec2, half: Vec2, pixel_m: f32, look: &Look) -> Vec3 {
    let [paper, ink, accent] = look.tones;
    let seed = look.seed;
    let uv = (flat / half.max(Vec2::splat(1e-3))) * 0.5 + 0.5;
    if uv.min_element() < 0.04 || uv.max_element() > 0.96 {
        return paper;
    }
    let split = 0.35 + 0.4 * hash_unit(1, 0, 0, seed);
    let top = !seed.is_multiple_of(3);
    let picture = if top { uv.y > split } else { uv.y < split };
    if picture {
        let v = fractal(Vec3::new(uv.x * 3.0, uv.y * 3.0, 1.0), seed);
        let disc = Vec2::new(
            0.25 + 0.5 * hash_unit(2, 0, 0, seed),
            if top { 0.8 } else { 0.25 },
        );
        if (uv - disc).length() < 0.08 + 0.14 * hash_unit(3, 0, 0, seed) {
            return accent * 1.1;
        }
        return if v > 0.55 {
            accent.lerp(ink, 0.4)
        } else {
            accent.lerp(paper, 0.5 * v)
        };
    }
    let lines = 8.0 + (seed % 9) as f32;
    let row = (uv.y * lines).floor();
    let title = hash(row as i32, 1, 1, seed).is_multiple_of(4);
    let tall = if title { 0.75 } else { 0.45 };
    let end = 0.55 + 0.4 * hash_unit(row as i32, 2, 2, seed);
    let written = (uv.y * lines).rem_euclid(1.0) < tall && uv.x > 0.1 && uv.x < end;
    let words = if title { 14.0 } else { 40.0 };
    let gap = hash((uv.x * words) as i32, row as i32, 3, seed).is_multiple_of(4);
    let sharp = (1.0 - pixel_m / 0.02).clamp(0.25, 1.0);
    if written && !gap {
        paper.lerp(ink, sharp)
    } else {
        paper
    }
}

/// Layers of noise under a horizon, with a few things that have an outline.
fn photo(p: Vec3, half: Vec3, look: &Look) -> Vec3 {
    let [a, b, c] = look.tones;
    let seed = look.seed;
    let q = Vec3::new(p.x, p.z, 0.3) / half.max_element().max(0.02);
    let horizon = 0.3 * (hash_unit(5, 0, 0, seed) - 0.5) + 0.35 * (fractal(q * 2.0, seed) - 0.5);
    let far = q.y > horizon;
    let base = if far {
        c.lerp(Vec3::splat(0.8), 0.4 + 0.4 * q.y)
    } else {
        b
    };
    let detail = fractal(q * if far { 3.0 } else { 9.0 }, seed + 1);
    let mut tone = base * (0.45 + 1.1 * detail);
    for i in 0..4 {
        let at = Vec2::new(hash_unit(i, 1, 0, seed), hash_unit(i, 2, 0, seed)) * 1.6 - 0.8;
        let size = Vec2::new(0.08, 0.1) + 0.22 * hash_unit(i, 3, 0, seed);
        let d = (Vec2::new(q.x, q.y) - at) / size;
        let inside = if i % 2 == 0 {
            d.length() < 1.0
        } else {
            d.abs().max_element() < 0.8
        };
        if inside {
            tone = a.lerp(c, 0.3 * i as f32) * (0.5 + 0.9 * fractal(q * 14.0, seed + 7));
        }
    }
    tone
}

fn books(p: Vec3, normal: Vec3, half: Vec3, pixel_m: f32, seed: u32) -> Vec3 {
    const WIDTH_M: f32 = 0.034;
    let slot = (p.x / WIDTH_M).floor();
    let edge = hash_unit(slot as i32, 0, 0, seed) * 0.5;
    let place = p.x / WIDTH_M - slot;
    let book = if place < edge { slot - 0.5 } else { slot } * 2.0;
    let pick = |k: i32| hash_unit(book as i32, k, 7, seed);
    if normal.z.abs() > 0.7 {
        return Vec3::new(0.72, 0.66, 0.52) * (0.8 + 0.2 * noise(p * 300.0, seed));
    }
    let gap = stroke((place - edge) * WIDTH_M, 0.003, pixel_m).max(stroke(
        place.min(1.0 - place) * WIDTH_M,
        0.003,
        pixel_m,
    ));
    let hue = Vec3::new(pick(1), pick(2), pick(3));
    let cover = (hue * hue * 0.75 + 0.02).lerp(Vec3::splat(hue.element_sum() * 0.25), pick(4));
    let z = p.z / half.z;
    let band = stroke((z.abs() - 0.3 - 0.5 * pick(5)) * half.z, 0.014, pixel_m);
    let short = z > 1.0 - 0.35 * pick(6);
    let tone = cover.lerp(Vec3::new(0.75, 0.68, 0.45), 0.8 * band) * (1.0 - 0.7 * gap);
    if short { Vec3::splat(0.02) } else { tone }
}
