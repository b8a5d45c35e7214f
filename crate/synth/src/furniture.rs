//! Tables, shelves and cabinets, with what stands on them.

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::texture::{Look, Pattern};
use crate::things;

/// A rectangular or round coffee table around the origin.
pub(crate) fn coffee_table(b: &mut Builder, at: &Place) {
    let wood = b.wood();
    let top = 0.42;
    if b.random.chance(0.5) {
        b.drum(
            &at.at(0.0, 0.0, top - 0.02),
            [0.45, 0.46],
            0.04,
            0.012,
            wood,
        );
        for i in 0..4 {
            let leg = at.turn(0.785 + i as f32 * std::f32::consts::FRAC_PI_2);
            b.rod(
                &leg,
                [0.0, -0.22, top - 0.04],
                [0.0, -0.36, 0.0],
                [0.028, 0.016],
                wood,
            );
        }
    } else {
        b.block(&at.at(0.0, 0.0, top - 0.02), [1.08, 0.6, 0.04], 0.01, wood);
        b.block(&at.at(0.0, 0.0, 0.14), [0.96, 0.5, 0.022], 0.006, wood);
        for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            b.block(
                &at.at(x * 0.48, y * 0.24, 0.2),
                [0.045, 0.045, 0.4],
                0.004,
                wood,
            );
        }
        things::stack(b, &at.at(0.22, 0.02, 0.151), 3);
    }
    let height = things::stack(b, &at.at(-0.2, 0.08, top), 3);
    if b.random.chance(0.5) {
        things::mug(b, &at.at(-0.19, 0.08, top + height));
    }
    things::bowl(b, &at.at(0.17, 0.1, top));
    things::mug(b, &at.at(0.1, -0.18, top).turn(0.7));
}

/// A desk against y = 0 for someone sitting on the -y side.
pub(crate) fn desk(b: &mut Builder, at: &Place, width: f32) {
    let wood = b.wood();
    let white = Look::plain(srgb(0xE9E6DF)).gloss(0.2);
    let knob = Look::plain(srgb(0x8D8478)).gloss(0.6);
    let top = 0.74;
    b.block(
        &at.at(0.0, -0.34, top - 0.016),
        [width, 0.66, 0.032],
        0.006,
        wood,
    );
    for y in [-0.06, -0.62] {
        b.rod(
            at,
            [0.5 * width - 0.08, y, top - 0.03],
            [0.5 * width - 0.04, y, 0.0],
            [0.026, 0.017],
            wood,
        );
    }
    // A block of drawers carries the left side.
    let left = at.at(-0.5 * width + 0.21, 0.0, 0.0);
    b.block(
        &left.at(0.0, -0.34, 0.5 * top - 0.016),
        [0.38, 0.58, top - 0.034],
        0.004,
        white,
    );
    for i in 0..3 {
        let z = 0.14 + 0.225 * i as f32;
        b.block(&left.at(0.0, -0.635, z), [0.35, 0.022, 0.205], 0.006, wood);
        b.block(
            &left.at(0.0, -0.656, z + 0.04),
            [0.11, 0.022, 0.014],
            0.006,
            knob,
        );
    }
    desk_top(b, &at.at(0.0, 0.0, top), width);
}

fn desk_top(b: &mut Builder, top: &Place, width: f32) {
    let dark = Look::plain(srgb(0x2B2D30)).gloss(0.35);
    let screen = Look::new(
        Pattern::Screen,
        [srgb(0x1D2B3A), srgb(0xC9D6E2), srgb(0x58B0C9)],
    )
    .glow(0.9);
    let monitor = top.at(0.05, -0.16, 0.0).turn(0.08);
    b.block(
        &monitor.at(0.0, 0.0, 0.008),
        [0.24, 0.18, 0.016],
        0.005,
        dark,
    );
    b.rod(
        &monitor,
        [0.0, 0.03, 0.01],
        [0.0, 0.03, 0.22],
        [0.02, 0.02],
        dark,
    );
    b.block(
        &monitor.at(0.0, 0.0, 0.34),
        [0.62, 0.035, 0.37],
        0.008,
        dark,
    );
    b.block(
        &monitor.at(0.0, -0.0175, 0.343),
        [0.595, 0.003, 0.335],
        0.0,
        screen,
    );
    let keys = Look::new(
        Pattern::Wicker,
        [srgb(0xB9BBBD), srgb(0xE6E7E7), srgb(0xE6E7E7)],
    );
    b.block(
        &top.at(0.03, -0.46, 0.011).turn(0.05),
        [0.42, 0.13, 0.022],
        0.006,
        keys,
    );
    b.block(&top.at(0.33, -0.45, 0.015), [0.06, 0.1, 0.03], 0.014, dark);
    things::mug(b, &top.at(-0.36, -0.42, 0.0).turn(2.0));
    things::stack(b, &top.at(-0.5 * width + 0.2, -0.2, 0.0), 4);
    let pot = things::spine(b).tones[0];
    let pens = top.at(0.5 * width - 0.12, -0.3, 0.0);
    b.drum(
        &pens.at(0.0, 0.0, 0.05),
        [0.038, 0.042],
        0.1,
        0.004,
        Look::plain(pot),
    );
    for i in 0..5 {
        let tone = b.accent();
        let pen = pens.turn(i as f32 * 1.25).at(0.0, -0.015, 0.06).lean(0.16);
        b.rod(
            &pen,
            [0.0; 3],
            [0.0, 0.0, 0.12],
            [0.006, 0.005],
            Look::plain(tone).gloss(0.3),
        );
    }
    let paper = Look::plain(srgb(0xF4F1E8));
    b.block(
        &top.at(-0.3, -0.55, 0.003).turn(-0.2),
        [0.21, 0.15, 0.006],
        0.0,
        paper,
    );
}

/// An open shelf with its back against y = 0, filled with books and things.
pub(crate) fn shelf(b: &mut Builder, at: &Place, width: f32, height: f32) {
    let wood = b.wood();
    let [dark, light] = b.palette.wood;
    let back = Look::new(Pattern::Wood, [dark * 0.75, light * 0.75, light]);
    let (depth, board) = (0.31, 0.026);
    for side in [-1.0, 1.0] {
        b.block(
            &at.at(side * 0.5 * (width - board), -0.5 * depth, 0.5 * height),
            [board, depth, height],
            0.003,
            wood,
        );
    }
    b.block(
        &at.at(0.0, -0.008, 0.5 * height),
        [width - board, 0.016, height],
        0.0,
        back,
    );
    let floors = 5;
    let step = (height - 0.08 - board) / floors as f32;
    for i in 0..=floors {
        let z = 0.07 + step * i as f32;
        b.block(
            &at.at(0.0, -0.5 * depth, z),
            [width - 2.0 * board, depth - 0.004, board],
            0.003,
            wood,
        );
        if i < floors {
            let floor = at.at(0.0, 0.0, z + 0.5 * board);
            fill(b, &floor, 0.5 * width - board - 0.012, step - board, depth);
        }
    }
    b.block(
        &at.at(0.0, -0.5 * depth + 0.02, 0.03),
        [width - 2.0 * board, depth - 0.04, 0.06],
        0.0,
        back,
    );
    things::vase(
        b,
        &at.at(-0.28 * width, -0.16, 0.083 + step * floors as f32),
        0.26,
    );
}

/// Fills one board from left to right with rows of books and, between them, single things.
fn fill(b: &mut Builder, at: &Place, reach: f32, height: f32, depth: f32) {
    let mut x = -reach;
    while x < reach - 0.12 {
        let end = (x + b.random.range(0.28, 0.5)).min(reach);
        let tall = b.random.range(0.68, 0.86) * height;
        while x < end - 0.05 {
            let thick = b.random.range(0.022, 0.05);
            let size = [
                thick,
                b.random.range(0.17, 0.22),
                (tall * b.random.range(0.82, 1.05)).min(height - 0.02),
            ];
            let look = things::spine(b);
            let y = -depth + 0.02 + 0.5 * size[1] + b.random.range(0.0, 0.025);
            b.block(&at.at(x + 0.5 * thick, y, 0.5 * size[2]), size, 0.0, look);
            x += thick + 0.0015;
        }
        let gap = b.random.range(0.14, 0.24);
        if x + gap > reach {
            break;
        }
        let middle = at.at(x + 0.5 * gap, -0.5 * depth, 0.0);
        match b.random.below(5) {
            0 => things::vase(b, &middle, 0.75 * height),
            1 => {
                let look = b.cloth(b.palette.sofa);
                let side = gap - 0.03;
                b.block(
                    &middle.at(0.0, 0.0, 0.45 * height),
                    [side, 0.22, 0.9 * height],
                    0.012,
                    look,
                );
            }
            2 => {
                let tone = b.accent();
                let globe =
                    Look::new(Pattern::Speckle, [srgb(0x4C86A8), tone, srgb(0x86A85C)]).gloss(0.4);
                let radius = 0.4 * gap.min(0.8 * height);
                b.drum(
                    &middle.at(0.0, 0.0, 0.012),
                    [0.05, 0.04],
                    0.024,
                    0.003,
                    b.wood(),
                );
                b.ball(&middle.at(0.0, 0.0, 0.02 + radius), radius, globe);
            }
            3 => {
                things::stack(b, &middle.turn(1.45), 3);
            }
            _ => things::picture(b, &middle.at(0.0, 0.06, 0.1).lean(-0.15), gap - 0.02, 0.19),
        }
        x += gap;
    }
}

/// A low cabinet on legs against y = 0, with things on it and a lamp; gives the place of the lamp's light.
pub(crate) fn sideboard(b: &mut Builder, at: &Place, width: f32) {
    let wood = b.wood();
    let [dark, light] = b.palette.wood;
    let front = Look::new(Pattern::Wood, [dark.lerp(light, 0.3), light * 1.05, light]).gloss(0.15);
    let knob = Look::plain(srgb(0xC2A25C)).gloss(0.8);
    let (depth, low, high) = (0.42, 0.16, 0.74);
    for x in [-1.0, 1.0] {
        for y in [-0.06, -depth + 0.06] {
            b.rod(
                at,
                [x * (0.5 * width - 0.12), y, low],
                [x * (0.5 * width - 0.07), y, 0.0],
                [0.024, 0.014],
                wood,
            );
        }
    }
    b.block(
        &at.at(0.0, -0.5 * depth, 0.5 * (low + high)),
        [width, depth, high - low],
        0.008,
        wood,
    );
    let doors = (width / 0.45) as u32;
    let each = (width - 0.04) / doors as f32;
    for i in 0..doors {
        let x = -0.5 * width + 0.02 + (i as f32 + 0.5) * each;
        b.block(
            &at.at(x, -depth - 0.006, 0.5 * (low + high)),
            [each - 0.014, 0.02, high - low - 0.05],
            0.005,
            front,
        );
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        b.ball(
            &at.at(x + side * (0.5 * each - 0.06), -depth - 0.024, 0.5),
            0.016,
            knob,
        );
    }
    let top = at.at(0.0, -0.5 * depth, high);
    things::flowers(b, &top.at(-0.36 * width, 0.02, 0.0));
    things::stack(b, &top.at(-0.12 * width, -0.03, 0.0), 4);
    let box_look = Look::new(
        Pattern::Wicker,
        [srgb(0x9A7448), srgb(0xD6B27F), srgb(0xD6B27F)],
    );
    b.block(
        &top.at(0.12 * width, 0.0, 0.085),
        [0.3, 0.24, 0.17],
        0.012,
        box_look,
    );
    things::plant(b, &top.at(0.38 * width, 0.0, 0.0), 0.42);
}

/// A small round table of `height` around the origin.
pub(crate) fn side_table(b: &mut Builder, at: &Place, height: f32) {
    let wood = b.wood();
    b.drum(
        &at.at(0.0, 0.0, height - 0.015),
        [0.22, 0.22],
        0.03,
        0.008,
        wood,
    );
    for i in 0..3 {
        let leg = at.turn(i as f32 * std::f32::consts::TAU / 3.0);
        b.rod(
            &leg,
            [0.0, -0.08, height - 0.03],
            [0.0, -0.19, 0.0],
            [0.018, 0.013],
            wood,
        );
    }
    things::mug(b, &at.at(0.08, -0.07, height));
    let books = at.at(-0.05, 0.03, height);
    things::stack(b, &books, 2);
}
