//! Floor plans: one to three rooms, some L-shaped, joined by openings. The floor is z = 0.

use glam::Vec2;

use crate::builder::Place;
use crate::random::Random;
use crate::shell::Opening;
use crate::training::colors::weighted;
use crate::training::walls::{Joint, walls_of};

/// Half the thickness of a wall: each room brings the half on its side.
pub(crate) const HALF_WALL_M: f32 = 0.11;

/// A rectangle of floor, lower and upper corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub low: Vec2,
    pub high: Vec2,
}

impl Area {
    pub fn around(points: impl IntoIterator<Item = Vec2>) -> Self {
        let start = Self {
            low: Vec2::INFINITY,
            high: Vec2::NEG_INFINITY,
        };
        points.into_iter().fold(start, |area, p| Self {
            low: area.low.min(p),
            high: area.high.max(p),
        })
    }

    pub fn size(&self) -> Vec2 {
        self.high - self.low
    }

    pub fn grown(&self, by: f32) -> Self {
        Self {
            low: self.low - by,
            high: self.high + by,
        }
    }

    pub fn holds(&self, p: Vec2) -> bool {
        p.cmpge(self.low).all() && p.cmple(self.high).all()
    }

    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmplt(other.high).all() && other.low.cmplt(self.high).all()
    }
}

/// What a room is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    Living,
    Bedroom,
    Kitchen,
    Dining,
    Office,
    Store,
    Hall,
    Bath,
    Bare,
}

/// A room: its floor is the union of its areas, which touch.
#[derive(Clone, Debug)]
pub(crate) struct Space {
    pub areas: Vec<Area>,
    pub height: f32,
    pub usage: Use,
}

impl Space {
    pub fn holds(&self, p: Vec2) -> bool {
        self.areas.iter().any(|area| area.holds(p))
    }

    pub fn bounds(&self) -> Area {
        Area::around(self.areas.iter().flat_map(|area| [area.low, area.high]))
    }

    pub fn floor_m2(&self) -> f32 {
        self.areas
            .iter()
            .map(|area| area.size().x * area.size().y)
            .sum()
    }
}

/// What fills a hole in a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filling {
    Window,
    Door,
    /// A way into another room.
    Passage,
}

/// One straight piece of a room's wall. Its place has x along it, y outwards, the inner face at y = 0, the origin in
/// the middle at the floor.
#[derive(Clone, Debug)]
pub(crate) struct Wall {
    pub space: usize,
    pub place: Place,
    pub length: f32,
    pub height: f32,
    /// Whether the left and right ends are outer corners.
    pub convex: [bool; 2],
    pub holes: Vec<(Opening, Filling)>,
}

/// The rooms and their walls.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub spaces: Vec<Space>,
    pub walls: Vec<Wall>,
    /// Middles of passages on the floor, with the direction through them.
    pub gates: Vec<(Vec2, Vec2)>,
}

impl Plan {
    pub fn new(r: &mut Random) -> Self {
        let mut spaces = vec![main_space(r)];
        let more = weighted(r, &[(0, 50), (1, 30), (2, 20)]).unwrap_or(0);
        let mut joints = Vec::new();
        for _ in 0..more {
            for _ in 0..8 {
                if let Some((space, joint)) = neighbour(r, &spaces) {
                    joints.push(joint);
                    spaces.push(space);
                    break;
                }
            }
        }
        let mut walls: Vec<_> = (0..spaces.len())
            .flat_map(|i| walls_of(&spaces, i))
            .collect();
        for joint in &joints {
            let top = spaces[joint.spaces[0]]
                .height
                .min(spaces[joint.spaces[1]].height)
                - 0.12;
            for wall in &mut walls {
                joint.cut(wall, top);
            }
        }
        let gates = joints
            .iter()
            .map(|joint| (joint.middle, joint.through))
            .collect();
        let mut plan = Self {
            spaces,
            walls,
            gates,
        };
        plan.cut_windows_and_doors(r);
        plan
    }

    pub fn bounds(&self) -> Area {
        Area::around(self.spaces.iter().flat_map(|space| {
            let bounds = space.bounds();
            [bounds.low, bounds.high]
        }))
    }

    fn cut_windows_and_doors(&mut self, r: &mut Random) {
        let outside: Vec<bool> = self
            .walls
            .iter()
            .map(|wall| self.faces_outside(wall))
            .collect();
        for (wall, outside) in self.walls.iter_mut().zip(outside) {
            if !wall.holes.is_empty() || wall.length < 1.2 {
                continue;
            }
            if outside && r.chance(0.4) {
                windows(r, wall);
            } else if r.chance(0.35) {
                let width = r.range(0.75, 1.0);
                let reach = 0.5 * wall.length - 0.5 * width - 0.12;
                let x = r.range(-reach, reach);
                let height = r.range(1.95, 2.12).min(wall.height - 0.15);
                wall.holes.push((
                    Opening {
                        x,
                        width,
                        sill: 0.0,
                        height,
                    },
                    Filling::Door,
                ));
            }
        }
    }

    fn faces_outside(&self, wall: &Wall) -> bool {
        let reach = 0.5 * wall.length;
        [-reach, 0.0, reach].iter().all(|&x| {
            let p = wall.place.point([x, 0.5, 0.0]).truncate();
            !self.spaces.iter().any(|space| space.holds(p))
        })
    }
}

fn windows(r: &mut Random, wall: &mut Wall) {
    let french = r.chance(0.12);
    let (sill, top) = if french {
        (0.06, r.range(2.0, 2.2))
    } else {
        (r.range(0.4, 1.1), r.range(1.9, 2.35))
    };
    let height = top.min(wall.height - 0.2) - sill;
    let count = if wall.length > 3.0 {
        1 + r.below(2 + (wall.length / 3.0) as u32)
    } else {
        1
    };
    let each = wall.length / count as f32;
    let width = r.range(0.6, 2.2).min(each - 0.5);
    if width < 0.5 {
        return;
    }
    let slide = 0.5 * (each - width - 0.3);
    let shift = r.range(-slide.max(0.0), slide.max(0.01));
    for i in 0..count {
        let x = -0.5 * wall.length + (i as f32 + 0.5) * each + shift;
        wall.holes.push((
            Opening {
                x,
                width,
                sill,
                height,
            },
            Filling::Window,
        ));
    }
}

fn usage(r: &mut Random) -> Use {
    let kinds = [
        (Use::Living, 26),
        (Use::Bedroom, 16),
        (Use::Kitchen, 14),
        (Use::Dining, 8),
        (Use::Office, 14),
        (Use::Store, 8),
        (Use::Bath, 5),
        (Use::Bare, 5),
    ];
    weighted(r, &kinds).unwrap_or(Use::Living)
}

fn main_space(r: &mut Random) -> Space {
    // The product of two draws makes small rooms the usual ones.
    let side = |r: &mut Random| 3.0 + 6.0 * r.unit() * r.range(0.25, 1.0);
    let (mut x, mut y) = (side(r), side(r));
    if x * y > 50.0 {
        let shrink = (50.0 / (x * y)).sqrt();
        (x, y) = ((x * shrink).max(3.0), (y * shrink).max(3.0));
    }
    let usage = usage(r);
    let height = if r.chance(0.8) {
        r.range(2.3, 2.8)
    } else {
        r.range(2.8, 3.6)
    };
    let whole = Area {
        low: Vec2::new(-0.5 * x, -0.5 * y),
        high: Vec2::new(0.5 * x, 0.5 * y),
    };
    let areas = if x.min(y) > 3.6 && r.chance(0.3) {
        notched(r, whole)
    } else {
        vec![whole]
    };
    Space {
        areas,
        height,
        usage,
    }
}

/// Cuts a corner off.
fn notched(r: &mut Random, whole: Area) -> Vec<Area> {
    let size = whole.size();
    let cut = Vec2::new(r.range(1.0, size.x - 2.0), r.range(1.0, size.y - 2.0));
    let (right, top) = (r.chance(0.5), r.chance(0.5));
    let (near, far) = if top {
        (whole.low.y, whole.high.y - cut.y)
    } else {
        (whole.low.y + cut.y, whole.high.y)
    };
    let full = Area {
        low: Vec2::new(whole.low.x, near),
        high: Vec2::new(whole.high.x, far),
    };
    let (left_x, right_x) = if right {
        (whole.low.x, whole.high.x - cut.x)
    } else {
        (whole.low.x + cut.x, whole.high.x)
    };
    let (low_y, high_y) = if top {
        (far, whole.high.y)
    } else {
        (whole.low.y, near)
    };
    vec![
        full,
        Area {
            low: Vec2::new(left_x, low_y),
            high: Vec2::new(right_x, high_y),
        },
    ]
}

/// A room beside one that is there already.
fn neighbour(r: &mut Random, spaces: &[Space]) -> Option<(Space, Joint)> {
    let to = r.below(spaces.len() as u32) as usize;
    let area = *spaces[to].areas.first()?;
    let axis = r.below(2) as usize;
    let beyond = r.chance(0.5);
    let size = Vec2::new(r.range(2.2, 5.0), r.range(2.2, 5.0));
    let gap = 2.0 * HALF_WALL_M;
    let mut low = Vec2::ZERO;
    low[axis] = if beyond {
        area.high[axis] + gap
    } else {
        area.low[axis] - gap - size[axis]
    };
    let other = 1 - axis;
    low[other] = r.range(area.low[other] - size[other] + 1.4, area.high[other] - 1.4);
    let new = Area {
        low,
        high: low + size,
    };
    let is_free = spaces
        .iter()
        .flat_map(|space| &space.areas)
        .all(|area| !area.grown(gap - 0.01).meets(&new));
    let overlap = [
        area.low[other].max(new.low[other]),
        area.high[other].min(new.high[other]),
    ];
    let room = overlap[1] - overlap[0] - 0.4;
    if !is_free || room < 0.75 {
        return None;
    }
    let wide = r.chance(0.4) && room > 1.3;
    let width = if wide {
        r.range(1.2, room.min(3.2))
    } else {
        r.range(0.75, 0.95).min(room)
    };
    let mut middle = Vec2::ZERO;
    let slack = 0.5 * (room - width);
    middle[other] = 0.5 * (overlap[0] + overlap[1]) + r.range(-slack.max(0.0), slack.max(0.01));
    let edge = if beyond {
        area.high[axis] + HALF_WALL_M
    } else {
        area.low[axis] - HALF_WALL_M
    };
    middle[axis] = edge;
    let mut through = Vec2::ZERO;
    through[axis] = if beyond { 1.0 } else { -1.0 };
    let height = if wide {
        r.range(2.05, 2.6)
    } else {
        r.range(1.98, 2.15)
    };
    let narrow = size.min_element() < 2.6;
    let usage = if narrow && r.chance(0.5) {
        Use::Hall
    } else {
        usage(r)
    };
    let level = if r.chance(0.6) {
        spaces[0].height
    } else {
        r.range(2.3, 3.0)
    };
    let joint = Joint {
        spaces: [to, spaces.len()],
        middle,
        through,
        width,
        height,
    };
    Some((
        Space {
            areas: vec![new],
            height: level,
            usage,
        },
        joint,
    ))
}
