//! Shelves, racks, cupboards and drawers.

use crate::builder::{Builder, Place};
use crate::texture::{Look, Pattern};
use crate::training::colors;
use crate::training::pieces::{clutter, open_box, tables::metal};

/// An open shelf of any grid, with or without a back, filled more or less.
pub(crate) fn shelf(b: &mut Builder, at: &Place, size: [f32; 3], full: f32) {
    let [width, depth, height] = size;
    let wood = b.wood();
    let thick = b.random.range(0.016, 0.04);
    let middle = at.at(0.0, -0.5 * depth, 0.0);
    let columns = ((width / b.random.range(0.35, 1.0)) as u32).max(1);
    let rows = ((height / b.random.range(0.28, 0.45)) as u32).max(1);
    if b.random.chance(0.6) {
        b.block(
            &at.at(0.0, -0.005, 0.5 * height),
            [width, 0.01, height],
            0.0,
            wood,
        );
    }
    for i in 0..=columns {
        let x = (width - thick) * (i as f32 / columns as f32 - 0.5);
        b.block(
            &middle.at(x, 0.0, 0.5 * height),
            [thick, depth, height],
            0.002,
            wood,
        );
    }
    let foot = b.random.pick(&[0.0, 0.06]);
    let step = (height - thick - foot) / rows as f32;
    let cell = width / columns as f32 - thick;
    for row in 0..=rows {
        let z = foot + 0.5 * thick + step * row as f32;
        b.block(
            &middle.at(0.0, 0.0, z),
            [width - thick, depth, thick],
            0.0,
            wood,
        );
        for column in 0..columns {
            let x = (width - thick) * ((column as f32 + 0.5) / columns as f32 - 0.5);
            let floor = middle.at(x, 0.0, z + 0.5 * thick);
            let room = if row == rows { 0.35 } else { step - thick };
            let share = if row == rows { 0.4 * full } else { full };
            if b.random.chance(share) {
                compartment(b, &floor, [cell, depth, room]);
            }
        }
    }
}

/// What is in one compartment.
fn compartment(b: &mut Builder, at: &Place, [width, depth, height]: [f32; 3]) {
    match b.random.below(8) {
        0 => {
            let look = storage_look(b);
            let size = [0.9 * width.min(0.4), 0.85 * depth, 0.8 * height.min(0.3)];
            b.block(&at.at(0.0, -0.02, 0.5 * size[2]), size, 0.012, look);
        }
        1 => {
            let look = storage_look(b);
            open_box(
                b,
                at,
                [0.85 * width.min(0.45), 0.8 * depth, 0.55 * height],
                0.012,
                look,
            );
        }
        2 | 3 => {
            // A row of books, drawn rather than built.
            let high = height * b.random.range(0.55, 0.9);
            let long = width * b.random.range(0.4, 0.95);
            let look = Look::new(Pattern::Books, [b.palette.accents[0]; 3]);
            let slide = 0.5 * (width - long) * b.random.pick(&[-1.0, 1.0]);
            b.block(
                &at.at(slide, -0.02, 0.5 * high),
                [long, 0.75 * depth, high],
                0.0,
                look,
            );
        }
        4 => books(b, at, [width, depth, height]),
        _ => clutter::cover(b, at, [width, 0.8 * depth], 0.6),
    }
}

/// Single books side by side, some leaning.
fn books(b: &mut Builder, at: &Place, [width, depth, height]: [f32; 3]) {
    let mut x = -0.5 * width;
    let end = width * b.random.range(-0.1, 0.5);
    let tall = b.random.range(0.6, 0.85) * height.min(0.36);
    while x < end - 0.06 {
        let thick = b.random.range(0.015, 0.055);
        let size = [
            thick,
            b.random.range(0.6, 0.85) * depth,
            tall * b.random.range(0.75, 1.1),
        ];
        let look = crate::things::spine(b);
        let lean = if b.random.chance(0.1) { 0.15 } else { 0.0 };
        b.block(
            &at.at(x + 0.5 * thick + 0.3 * lean * size[2], -0.02, 0.5 * size[2])
                .roll(lean),
            size,
            0.0,
            look,
        );
        x += thick + 0.002 + 0.5 * lean * size[2];
    }
}

fn storage_look(b: &mut Builder) -> Look {
    let tone = colors::tone(&mut b.random);
    let pattern = b.random.pick(&[
        Pattern::Wicker,
        Pattern::Weave,
        Pattern::Plain,
        Pattern::Cardboard,
        Pattern::Blank,
    ]);
    Look::new(pattern, [tone * 0.7, tone, tone])
}

/// A metal rack: posts and boards.
pub(crate) fn rack(b: &mut Builder, at: &Place, size: [f32; 3], full: f32) {
    let [width, depth, height] = size;
    let frame = metal(b);
    let board = if b.random.chance(0.5) {
        frame
    } else {
        b.wood()
    };
    let middle = at.at(0.0, -0.5 * depth, 0.0);
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let post = middle.at(
            x * (0.5 * width - 0.015),
            y * (0.5 * depth - 0.015),
            0.5 * height,
        );
        b.block(&post, [0.03, 0.03, height], 0.0, frame);
    }
    let rows = 2 + b.random.below(4);
    for row in 0..rows {
        let z = 0.12 + (height - 0.16) * row as f32 / (rows - 1) as f32;
        b.block(&middle.at(0.0, 0.0, z), [width, depth, 0.025], 0.0, board);
        let mut x = -0.5 * width + 0.05;
        while x < 0.5 * width - 0.3 {
            let each = b.random.range(0.25, 0.5).min(0.5 * width - x);
            if b.random.chance(full) {
                let on = middle.at(x + 0.5 * each, 0.0, z + 0.0125);
                compartment(b, &on, [each - 0.03, depth, 0.36]);
            }
            x += each;
        }
    }
}

/// A cupboard with doors, or drawers, or both; low ones carry things.
pub(crate) fn cupboard(b: &mut Builder, at: &Place, size: [f32; 3], full: f32) {
    let [width, depth, height] = size;
    let body = b.wood();
    if b.random.chance(0.3) {
        colors::vary(b);
    }
    let front = b.wood();
    let knob = metal(b);
    let foot = b.random.pick(&[0.0, 0.05, 0.12]);
    let middle = at.at(0.0, -0.5 * depth, 0.0);
    b.block(
        &middle.at(0.0, 0.0, 0.5 * (height + foot)),
        [width, depth, height - foot],
        0.005,
        body,
    );
    if foot > 0.0 {
        super::legs(
            b,
            &middle,
            [0.5 * width - 0.05, 0.5 * depth - 0.05],
            foot + 0.01,
            0.035,
            body,
        );
    }
    let columns = ((width / b.random.range(0.35, 0.65)) as u32).max(1);
    let drawers = height < 1.3 && b.random.chance(0.5);
    let rows = if drawers {
        ((height / 0.22) as u32).max(2)
    } else {
        1 + b.random.below(2)
    };
    let cell = [width / columns as f32, (height - foot) / rows as f32];
    let bar = b.random.chance(0.5);
    for column in 0..columns {
        for row in 0..rows {
            let x = width * ((column as f32 + 0.5) / columns as f32 - 0.5);
            let z = foot + cell[1] * (row as f32 + 0.5);
            let leaf = at.at(x, -depth - 0.008, z);
            b.block(
                &leaf,
                [cell[0] - 0.012, 0.018, cell[1] - 0.012],
                0.003,
                front,
            );
            let side = if column % 2 == 0 { 1.0 } else { -1.0 };
            let grip = if drawers {
                leaf.at(0.0, -0.025, 0.2 * cell[1])
            } else {
                leaf.at(
                    side * (0.5 * cell[0] - 0.05),
                    -0.025,
                    (0.9 - z).clamp(-0.4 * cell[1], 0.4 * cell[1]),
                )
            };
            match (bar, drawers) {
                (true, true) => b.block(&grip, [0.12, 0.02, 0.012], 0.004, knob),
                (true, false) => b.block(&grip, [0.012, 0.02, 0.14], 0.004, knob),
                _ => b.ball(&grip, 0.014, knob),
            }
        }
    }
    if height < 1.5 {
        clutter::cover(
            b,
            &middle.at(0.0, 0.0, height),
            [width - 0.06, depth - 0.06],
            full,
        );
    } else if b.random.chance(0.3) {
        let look = storage_look(b);
        let box_size = [0.5 * width.min(0.9), 0.7 * depth, 0.22];
        b.block(
            &middle.at(0.1 * width, 0.0, height + 0.11),
            box_size,
            0.01,
            look,
        );
    }
}

/// A board on the wall with things on it; `at` is the middle of its back at its height.
pub(crate) fn wall_board(b: &mut Builder, at: &Place, width: f32) {
    let look = b.wood();
    let depth = b.random.range(0.15, 0.26);
    b.block(
        &at.at(0.0, -0.5 * depth, 0.0),
        [width, depth, 0.025],
        0.003,
        look,
    );
    clutter::cover(
        b,
        &at.at(0.0, -0.5 * depth, 0.0125),
        [width - 0.04, depth - 0.04],
        0.8,
    );
}
