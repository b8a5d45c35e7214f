//! A furnished room from a seed: which things, where, and what can be asked of the result.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::scene::Scene;
use crate::shell::{Opening, door, floor_and_ceiling, wall, window};
use crate::texture::{Look, Pattern};
use crate::{furniture, seating, things};

/// A living room in metres: floor at z = 0, Z up, the origin in the middle of the floor.
#[derive(Clone, Debug)]
pub struct Room {
    pub(crate) scene: Scene,
    pub(crate) size_m: Vec3,
    pub(crate) window: Light,
    pub(crate) lamp: Light,
}

/// Something flat that shines; [`Light::facing`] is zero for one that shines to all sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    pub center: Vec3,
    /// Half of its extent in two directions.
    pub spread: [Vec3; 2],
    pub facing: Vec3,
    /// Linear RGB.
    pub power: Vec3,
}

impl Room {
    /// The room that `seed` names: the same on every machine.
    pub fn new(seed: u64) -> Self {
        let mut b = Builder::new(seed);
        let size = Vec3::new(
            b.random.range(4.7, 5.6),
            b.random.range(4.0, 4.6),
            b.random.range(2.5, 2.7),
        );
        // One layout, turned by quarters and mirrored; quarters keep walls along the axes.
        let quarter = b.random.below(4);
        let mirror = if b.random.chance(0.5) { -1.0 } else { 1.0 };
        let room = Place {
            origin: Vec3::ZERO,
            axes: Mat3::from_diagonal(Vec3::new(mirror, 1.0, 1.0)),
        }
        .quarter(quarter);
        let (window, lamp) = furnish(&mut b, &room, size);
        Self {
            scene: Scene::new(b.solids),
            size_m: if quarter.is_multiple_of(2) {
                size
            } else {
                Vec3::new(size.y, size.x, size.z)
            },
            window,
            lamp,
        }
    }

    /// Width along x, depth along y and height between the inner faces of walls, floor and ceiling, in metres.
    pub fn size_m(&self) -> Vec3 {
        self.size_m
    }

    /// Signed distance in metres from `point` to the nearest surface: positive in free space, where it is exact.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.scene.distance(point)
    }
}

/// Window to the north, sofa to the south, shelf to the east, door and desk to the west; gives the two lights.
fn furnish(b: &mut Builder, room: &Place, size: Vec3) -> (Light, Light) {
    let (hx, hy) = (0.5 * size.x, 0.5 * size.y);
    let north = room.at(0.0, hy, 0.0);
    let east = room.quarter(3).at(0.0, hx, 0.0);
    let south = room.quarter(2).at(0.0, hy, 0.0);
    let west = room.quarter(1).at(0.0, hx, 0.0);

    floor_and_ceiling(b, room, size);
    let paint = Look::new(Pattern::Plaster, [b.palette.wall; 3]);
    let [ground, motif] = b.palette.accent_wall;
    let pattern = b
        .random
        .pick(&[Pattern::Plaster, Pattern::Wallpaper, Pattern::Wallpaper]);
    let accent = Look::new(pattern, [ground, motif, motif]);
    let glass = Opening {
        x: b.random.range(-0.25, 0.25),
        width: b.random.range(1.6, 1.9),
        sill: 0.88,
        height: 1.25,
    };
    // Seen from inside, the west wall's right is north.
    let way = Opening {
        x: -hy + 0.75,
        width: 0.86,
        sill: 0.0,
        height: 2.02,
    };
    wall(b, &north, size.x, size.z, Some(glass), paint);
    wall(b, &east, size.y, size.z, None, paint);
    wall(b, &south, size.x, size.z, None, accent);
    wall(b, &west, size.y, size.z, Some(way), paint);
    window(b, &north, glass);
    door(b, &west, way);

    let lamp = south_side(b, &south, hx);
    east_side(b, &east, hy);
    west_side(b, &west, hy);
    north_corners(b, room, hx, hy);
    middle(b, room, hy);

    let window = Light {
        center: north.point([glass.x, -0.03, glass.sill + 0.5 * glass.height]),
        spread: [
            north.axes.x_axis * 0.42 * glass.width,
            north.axes.z_axis * 0.42 * glass.height,
        ],
        facing: -north.axes.y_axis,
        power: Vec3::new(7.0, 7.0, 7.0),
    };
    let lamp = Light {
        center: lamp,
        spread: [Vec3::X * 0.12, Vec3::Z * 0.1],
        facing: Vec3::ZERO,
        power: Vec3::new(1.5, 1.12, 0.72),
    };
    (window, lamp)
}

/// Sofa with pictures above, a lamp on one side and a small table on the other. Gives the place of the lamp.
fn south_side(b: &mut Builder, south: &Place, hx: f32) -> Vec3 {
    let shift = b.random.range(-0.15, 0.15);
    let seats = 2 + b.random.below(2);
    let width = if seats == 3 { 2.15 } else { 1.8 };
    seating::sofa(
        b,
        &south.at(shift, -0.03, 0.0),
        width,
        seats,
        b.palette.sofa,
    );
    let side = 0.5 * width + 0.3;
    let lamp = things::lamp(b, &south.at((shift + side).min(hx - 0.3), -0.38, 0.0), 1.5);
    furniture::side_table(b, &south.at(shift - side, -0.4, 0.0), 0.52);
    let gallery: &[(f32, f32, f32, f32)] = match b.random.below(3) {
        0 => &[(0.0, 1.62, 1.05, 0.7)],
        1 => &[(-0.42, 1.6, 0.52, 0.68), (0.42, 1.6, 0.52, 0.68)],
        _ => &[
            (-0.66, 1.6, 0.44, 0.56),
            (0.0, 1.66, 0.62, 0.72),
            (0.66, 1.6, 0.44, 0.56),
        ],
    };
    for &(x, z, w, h) in gallery {
        things::picture(b, &south.at(shift + x, 0.0, z), w, h);
    }
    lamp
}

/// Book shelf, sideboard and what hangs above it.
fn east_side(b: &mut Builder, east: &Place, hy: f32) {
    let width = b.random.range(1.0, 1.25);
    let height = b.random.range(1.85, 2.05);
    // The right of the east wall is south: the shelf stands towards the window.
    let left = -hy + 0.5 + 0.5 * width;
    furniture::shelf(b, &east.at(left, -0.015, 0.0), width, height);
    let cabinet = 1.45;
    let from = left + 0.5 * width + 0.12 + 0.5 * cabinet;
    furniture::sideboard(b, &east.at(from, -0.02, 0.0), cabinet);
    if b.random.chance(0.5) {
        things::clock(b, &east.at(from - 0.35, 0.0, 1.75));
        things::picture(b, &east.at(from + 0.28, 0.0, 1.58), 0.5, 0.62);
    } else {
        things::picture(b, &east.at(from, 0.0, 1.6), 0.85, 0.6);
    }
}

/// Desk with a chair on the window's side of the door, cartons or a basket beside it.
fn west_side(b: &mut Builder, west: &Place, hy: f32) {
    let width = b.random.range(1.25, 1.4);
    let x = hy - 0.62 - 0.5 * width;
    furniture::desk(b, &west.at(x, -0.02, 0.0), width);
    let turn = b.random.range(-0.5, 0.5);
    // A chair looks to its -y; the desk is on its +y side.
    let seat = west.at(x + 0.05, -0.82, 0.0).turn(PI + turn);
    if b.random.chance(0.5) {
        seating::chair(b, &seat);
    } else {
        seating::office_chair(b, &seat);
    }
    things::picture(b, &west.at(x + 0.1, 0.0, 1.72), 0.6, 0.44);
    let bin = Look::plain(srgb(0x565B5F)).gloss(0.3);
    b.drum(
        &west.at(x + 0.5 * width - 0.18, -0.3, 0.15),
        [0.1, 0.13],
        0.3,
        0.004,
        bin,
    );
}

fn north_corners(b: &mut Builder, room: &Place, hx: f32, hy: f32) {
    things::plant(b, &room.at(-hx + 0.36, hy - 0.42, 0.0), 1.15);
    if b.random.chance(0.5) {
        things::cartons(b, &room.at(hx - 0.75, hy - 0.45, 0.0));
    } else {
        things::basket(b, &room.at(hx - 0.72, hy - 0.42, 0.0));
    }
}

/// Rug, coffee table, and a seat towards the window.
fn middle(b: &mut Builder, room: &Place, hy: f32) {
    let rug = Look::new(Pattern::Rug, b.palette.rug);
    let turn = b.random.range(-0.05, 0.05);
    let center = room.at(0.0, -hy + 1.72, 0.0);
    b.block(
        &center.at(0.0, -0.05, 0.006).turn(turn),
        [2.5, 1.6, 0.014],
        0.005,
        rug,
    );
    furniture::coffee_table(b, &center.at(0.0, -0.12, 0.013).turn(turn));
    let tone = b.accent();
    if b.random.chance(0.55) {
        let at = center.at(0.8, 1.05, 0.0).turn(-0.6);
        let pale = tone.lerp(Vec3::splat(0.5), 0.15);
        seating::sofa(b, &at, 0.86, 1, [pale * 0.75, pale]);
    } else {
        seating::pouf(b, &center.at(0.85, 0.62, 0.013));
        seating::pouf(b, &center.at(-0.5, 0.85, 0.0));
    }
}
