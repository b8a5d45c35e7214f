//! Puts single pieces where there is room for them.

use std::f32::consts::{PI, TAU};

use crate::builder::{Builder, Place};
use crate::room::Light;
use crate::seating;
use crate::training::furnish::Mood;
use crate::training::pieces::{fixtures, kitchen, lamps, sleep, storage, tables};
use crate::training::site::Site;
use crate::training::wishes::Piece::{self, *};

/// Finds a place for a piece and builds it there; without a place nothing happens.
pub(crate) fn put(
    b: &mut Builder,
    site: &mut Site,
    piece: Piece,
    mood: Mood,
    lights: &mut Vec<Light>,
) {
    let full = (mood.full * b.random.range(0.6, 1.3)).min(0.95);
    let tall = site.space.height;
    match piece {
        Sofa | OldSofa => {
            let (width, depth) = (b.random.range(1.4, 2.7), b.random.range(0.8, 1.05));
            if let Some(at) = site.at_wall(&mut b.random, [width, depth, 0.95], 0.5) {
                if piece == OldSofa {
                    let seats = if width > 1.9 { 3 } else { 2 };
                    seating::sofa(b, &at, width, seats, b.palette.sofa);
                } else {
                    sleep::sofa(b, &at, width, depth);
                }
            }
        }
        Armchair => {
            let turn = b.random.range(0.0, TAU);
            if let Some(at) = site.on_floor(&mut b.random, [0.95, 0.95], turn, 0.1) {
                let (width, depth) = (b.random.range(0.65, 0.9), b.random.range(0.7, 0.9));
                sleep::sofa(b, &at.at(0.0, 0.5 * depth, 0.0), width, depth);
            }
        }
        Shelf | Bookcase => {
            let size = [
                b.random.range(0.4, 2.2),
                b.random.range(0.22, 0.42),
                b.random.range(0.6, 2.2_f32.min(tall - 0.3)),
            ];
            let old = piece == Bookcase;
            let size = if old {
                [size[0].clamp(0.7, 1.3), 0.32, 2.1]
            } else {
                size
            };
            if let Some(at) = site.at_wall(&mut b.random, size, 0.3) {
                if old {
                    let height = b.random.range(1.5, 2.0);
                    crate::furniture::shelf(b, &at, size[0], height);
                } else {
                    storage::shelf(b, &at, size, full);
                }
            }
        }
        Rack => {
            let size = [
                b.random.range(0.7, 1.8),
                b.random.range(0.3, 0.5),
                b.random.range(1.2, 2.1),
            ];
            if let Some(at) = site.at_wall(&mut b.random, size, 0.3) {
                storage::rack(b, &at, size, full);
            }
        }
        Wardrobe | Cupboard => {
            let size = if piece == Wardrobe {
                [
                    b.random.range(0.6, 2.4),
                    b.random.range(0.5, 0.65),
                    b.random.range(1.7, 2.25_f32.min(tall - 0.1)),
                ]
            } else {
                [
                    b.random.range(0.4, 1.8),
                    b.random.range(0.35, 0.55),
                    b.random.range(0.5, 1.4),
                ]
            };
            if let Some(at) = site.at_wall(&mut b.random, size, 0.35) {
                storage::cupboard(b, &at, size, full);
            }
        }
        Sideboard => {
            let width = b.random.range(1.2, 1.7);
            if let Some(at) = site.at_wall(&mut b.random, [width, 0.46, 0.8], 0.3) {
                crate::furniture::sideboard(b, &at, width);
            }
        }
        Workplace => {
            let width = b.random.range(1.0, 1.9);
            if let Some(at) = site.at_wall(&mut b.random, [width, 1.35, 0.74], 0.1) {
                tables::workplace(b, &at, width, full);
                desk_lamp(b, &at.at(0.42 * width, -0.25, 0.745), mood, lights);
            }
        }
        Bed => {
            let width = b.random.pick(&[0.9, 1.0, 1.4, 1.6, 1.8]);
            if let Some(at) = site.at_wall(&mut b.random, [width + 0.1, 2.15, 0.7], 0.2) {
                sleep::bed(b, &at, width);
                if let Some(beside) = site.at_wall(&mut b.random, [0.45, 0.4, 0.55], 0.0) {
                    storage::cupboard(b, &beside, [0.45, 0.38, 0.5], 0.2);
                    desk_lamp(b, &beside.at(0.0, -0.2, 0.5), mood, lights);
                }
            }
        }
        KitchenRow => {
            let above = b.random.chance(0.75);
            let height = if above { 2.1 } else { 0.95 };
            for width in [b.random.range(2.4, 4.2), 2.4, 1.8, 1.2] {
                if let Some(at) = site.at_wall(&mut b.random, [width, 0.64, height], 0.5) {
                    kitchen::row(b, &at, width, above, 0.7 * full);
                    break;
                }
            }
        }
        Fridge => {
            let height = b.random.range(0.85, 2.0);
            if let Some(at) = site.at_wall(&mut b.random, [0.62, 0.68, height], 0.4) {
                kitchen::fridge(b, &at, height);
            }
        }
        Washer => {
            if let Some(at) = site.at_wall(&mut b.random, [0.62, 0.64, 0.86], 0.3) {
                kitchen::washer(b, &at);
            }
        }
        Media => {
            let width = b.random.range(1.1, 2.0);
            if let Some(at) = site.at_wall(&mut b.random, [width, 0.44, 1.2], 0.5) {
                fixtures::media(b, &at, width, full);
            }
        }
        WallTable => {
            let size = [
                b.random.range(0.8, 2.2),
                b.random.range(0.4, 0.75),
                b.random.range(0.72, 0.95),
            ];
            if let Some(at) = site.at_wall(&mut b.random, size, 0.3) {
                tables::table(b, &at.at(0.0, -0.5 * size[1], 0.0), size, full);
            }
        }
        Dining => dining(b, site, full),
        LowTable | MiddleBench => {
            let low = piece == LowTable;
            let height = if low {
                b.random.range(0.3, 0.48)
            } else {
                b.random.range(0.75, 0.95)
            };
            let size = [b.random.range(0.5, 1.4), b.random.range(0.45, 0.8), height];
            let turn = if b.random.chance(0.6) {
                0.0
            } else {
                b.random.range(-0.6, 0.6)
            };
            if let Some(at) = site.on_floor(&mut b.random, [size[0], size[1]], turn, 0.25) {
                if low && b.random.chance(0.6) {
                    fixtures::rug(b, &at, [size[0] + 0.9, size[1] + 0.9]);
                }
                tables::table(
                    b,
                    &at.at(0.0, 0.0, if low { 0.01 } else { 0.0 }),
                    size,
                    full,
                );
            }
        }
        Basin => {
            if let Some(at) = site.at_wall(&mut b.random, [0.64, 0.5, 1.9], 0.4) {
                kitchen::basin(b, &at);
            }
        }
        Toilet => {
            if let Some(at) = site.at_wall(&mut b.random, [0.6, 0.66, 0.8], 0.3) {
                kitchen::toilet(b, &at);
            }
        }
        Tub => {
            if let Some(at) = site.at_wall(&mut b.random, [1.7, 1.15, 0.6], 0.1) {
                kitchen::tub(b, &at, 1.66);
            }
        }
        Plant => {
            let scale = b.random.range(0.5, 1.25);
            if let Some(at) = site.on_floor(&mut b.random, [0.6, 0.6], 0.0, 0.0) {
                crate::things::plant(b, &at, scale);
            }
        }
        FloorLamp => {
            let height = b.random.range(1.2, 1.8);
            if let Some(at) = site.on_floor(&mut b.random, [0.45, 0.45], 0.0, 0.0) {
                let on = if b.random.chance(0.6) {
                    mood.lamps
                } else {
                    0.0
                };
                let light = lamps::standing_lamp(b, &at, height, on, lamps::warmth_like(mood.tint));
                if on > 0.0 {
                    lights.push(light);
                }
            }
        }
        Thin => {
            if let Some(at) = site.at_wall(&mut b.random, [1.75, 0.7, 1.8], 0.1) {
                fixtures::thin_thing(b, &at.at(0.0, -0.38, 0.0));
            }
        }
        Drying => {
            let turn = b.random.range(0.0, PI);
            if let Some(at) = site.on_floor(&mut b.random, [1.2, 0.6], turn, 0.15) {
                fixtures::drying_rack(b, &at);
            }
        }
        Column => {
            // A column in a small room leaves nowhere to stand.
            let side = if site.space.floor_m2() > 14.0 {
                0.5
            } else {
                9.0
            };
            if let Some(at) = site.on_floor(&mut b.random, [side; 2], 0.0, 0.7) {
                fixtures::column(b, &at, tall);
            }
        }
        Chair => {
            let turn = b.random.range(0.0, TAU);
            if let Some(at) = site.on_floor(&mut b.random, [0.55, 0.55], turn, 0.05) {
                tables::chair(b, &at);
            }
        }
    }
}

fn desk_lamp(b: &mut Builder, at: &Place, mood: Mood, lights: &mut Vec<Light>) {
    if !b.random.chance(0.45) {
        return;
    }
    let on = if b.random.chance(0.5) {
        mood.lamps
    } else {
        0.0
    };
    let height = b.random.range(0.28, 0.5);
    let light = lamps::standing_lamp(b, at, height, on, lamps::warmth_like(mood.tint));
    if on > 0.0 {
        lights.push(light);
    }
}

/// A table with chairs around it, some pulled out.
fn dining(b: &mut Builder, site: &mut Site, full: f32) {
    let round = b.random.chance(0.3);
    let width = if round {
        b.random.range(0.8, 1.3)
    } else {
        b.random.range(0.9, 2.2)
    };
    let depth = if round {
        width
    } else {
        b.random.range(0.7, 1.0)
    };
    let turn = if b.random.chance(0.6) {
        0.0
    } else {
        b.random.range(0.0, PI)
    };
    let Some(at) = site.on_floor(&mut b.random, [width + 0.5, depth + 0.9], turn, 0.1) else {
        return;
    };
    let height = b.random.range(0.72, 0.78);
    tables::table(b, &at, [width, depth, height], 0.6 * full);
    let seats = ((width / 0.62) as u32).max(1);
    for side in [-1.0f32, 1.0] {
        for i in 0..seats {
            if !b.random.chance(0.85) {
                continue;
            }
            let x = width * ((i as f32 + 0.5) / seats as f32 - 0.5);
            let out = b.random.range(-0.12, 0.22);
            let spot = at.at(x, side * (0.5 * depth + out), 0.0);
            let askew = b.random.range(-0.3, 0.3) * b.random.unit();
            // A chair looks to its -y, and the table is on that side.
            let facing = if side > 0.0 { 0.0 } else { PI };
            tables::chair(b, &spot.turn(facing + askew));
        }
    }
}
