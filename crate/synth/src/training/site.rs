//! Where there is still room: on the floor, along walls, and on walls.

use glam::Vec2;

use crate::builder::Place;
use crate::random::Random;
use crate::training::plan::{Area, Filling, HALF_WALL_M, Plan, Space, Wall};

/// Something that takes floor, or the air above it.
struct Taken {
    area: Area,
    /// Only what is higher than this is in its way.
    above: f32,
    /// Whether something stands there.
    stands: bool,
}

/// One room while it is furnished.
pub(crate) struct Site<'a> {
    pub space: &'a Space,
    pub walls: Vec<&'a Wall>,
    taken: Vec<Taken>,
    /// For each wall: what of it is covered, as from x, to x, from z, to z.
    covered: Vec<Vec<[f32; 4]>>,
}

impl<'a> Site<'a> {
    pub fn new(plan: &'a Plan, index: usize) -> Self {
        let walls: Vec<_> = plan
            .walls
            .iter()
            .filter(|wall| wall.space == index)
            .collect();
        let mut site = Self {
            space: &plan.spaces[index],
            covered: vec![Vec::new(); walls.len()],
            walls,
            taken: Vec::new(),
        };
        for i in 0..site.walls.len() {
            let wall = site.walls[i];
            for &(hole, filling) in &wall.holes {
                let (from, to) = (hole.x - 0.5 * hole.width, hole.x + 0.5 * hole.width);
                let is_window = filling == Filling::Window;
                let rim = if is_window { 0.35 } else { 0.12 };
                site.covered[i].push([from - rim, to + rim, hole.sill, hole.sill + hole.height]);
                // Curtains and radiators keep what is high away; doors and passages keep everything.
                let (depth, above) = if is_window {
                    (0.3, hole.sill.min(0.75))
                } else {
                    (0.9, 0.0)
                };
                let area = footprint(&wall.place, [from - 0.05, to + 0.05], [-depth, HALF_WALL_M]);
                site.keep_free(area, above);
            }
        }
        site
    }

    /// Keeps `area` free of what is higher than `above`.
    pub fn keep_free(&mut self, area: Area, above: f32) {
        self.taken.push(Taken {
            area,
            above,
            stands: false,
        });
    }

    /// Something stands on `area`.
    pub fn take(&mut self, area: Area) {
        self.taken.push(Taken {
            area,
            above: 0.0,
            stands: true,
        });
    }

    /// Share of the floor that things stand on.
    pub fn covered(&self) -> f32 {
        let sum: f32 = self
            .taken
            .iter()
            .filter(|taken| taken.stands)
            .map(|taken| taken.area.size().x * taken.area.size().y)
            .sum();
        sum / self.space.floor_m2()
    }

    fn is_free(&self, area: &Area, height: f32) -> bool {
        let inside = (0..=4)
            .flat_map(|i| (0..=4).map(move |j| Vec2::new(i as f32, j as f32) * 0.25))
            .all(|share| {
                let p = area.low + (area.high - area.low) * share;
                self.space.holds(p.clamp(area.low + 1e-3, area.high - 1e-3))
            });
        inside
            && !self
                .taken
                .iter()
                .any(|taken| height > taken.above && taken.area.meets(area))
    }

    /// A place at a wall for something of `size` (along the wall, away from it, high), with `clear` metres before it.
    pub fn at_wall(&mut self, r: &mut Random, size: [f32; 3], clear: f32) -> Option<Place> {
        let total: f32 = self.walls.iter().map(|wall| wall.length).sum();
        for _ in 0..28 {
            let mut left = r.range(0.0, total);
            let index = self.walls.iter().position(|wall| {
                left -= wall.length;
                left < 0.0
            })?;
            let wall = self.walls[index];
            let reach = 0.5 * (wall.length - size[0]) - 0.02;
            if reach < 0.0 || size[2] > wall.height - 0.05 {
                continue;
            }
            let x = if r.chance(0.4) {
                reach * r.pick(&[-1.0, 1.0])
            } else {
                r.range(-reach, reach + 1e-3)
            };
            let ends = [x - 0.5 * size[0], x + 0.5 * size[0]];
            let wide = footprint(&wall.place, ends, [-size[1] - clear, -0.002]);
            let covers = self.covered[index]
                .iter()
                .any(|c| c[0] < ends[1] && ends[0] < c[1] && c[2] < size[2]);
            if covers || !self.is_free(&wide, size[2]) {
                continue;
            }
            self.covered[index].push([ends[0], ends[1], 0.0, size[2]]);
            self.take(footprint(&wall.place, ends, [-size[1] - 0.03, 0.0]));
            return Some(wall.place.at(x, -0.016, 0.0));
        }
        None
    }

    /// A free rectangle of the floor of `size`, turned by `turn`, with `clear` metres around it.
    pub fn on_floor(
        &mut self,
        r: &mut Random,
        size: [f32; 2],
        turn: f32,
        clear: f32,
    ) -> Option<Place> {
        let bounds = self.space.bounds();
        for _ in 0..28 {
            let p = bounds.low + bounds.size() * Vec2::new(r.unit(), r.unit());
            let place = Place {
                origin: p.extend(0.0),
                axes: glam::Mat3::IDENTITY,
            }
            .turn(turn);
            let half = [0.5 * size[0], 0.5 * size[1]];
            let wide = footprint(
                &place,
                [-half[0] - clear, half[0] + clear],
                [-half[1] - clear, half[1] + clear],
            );
            if self.is_free(&wide, 2.0) {
                let own = footprint(&place, [-half[0], half[0]], [-half[1], half[1]]);
                self.take(own);
                return Some(place);
            }
        }
        None
    }

    /// A free rectangle of a wall of `size` with its middle `middle` metres up.
    pub fn on_wall(&mut self, r: &mut Random, size: [f32; 2], middle: f32) -> Option<Place> {
        for _ in 0..10 {
            let index = r.below(self.walls.len().max(1) as u32) as usize;
            let wall = *self.walls.get(index)?;
            let reach = 0.5 * (wall.length - size[0]) - 0.08;
            let (low, high) = (middle - 0.5 * size[1], middle + 0.5 * size[1]);
            if reach < 0.0 || high > wall.height - 0.1 {
                continue;
            }
            let x = r.range(-reach, reach + 1e-3);
            let (from, to) = (x - 0.5 * size[0], x + 0.5 * size[0]);
            let covered = &mut self.covered[index];
            if covered
                .iter()
                .any(|c| c[0] < to && from < c[1] && c[2] < high && low < c[3])
            {
                continue;
            }
            covered.push([from - 0.05, to + 0.05, low - 0.05, high + 0.05]);
            return Some(wall.place.at(x, 0.0, middle));
        }
        None
    }
}

/// The box on the floor around a rectangle in a place's own x and y.
pub(crate) fn footprint(place: &Place, x: [f32; 2], y: [f32; 2]) -> Area {
    Area::around(
        [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]]
            .map(|[x, y]| place.point([x, y, 0.0]).truncate()),
    )
}
