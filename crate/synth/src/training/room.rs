//! A dwelling of one to three rooms from a seed.

use glam::Vec3;

use crate::builder::Builder;
use crate::random::Random;
use crate::room::Light;
use crate::scene::Scene;
use crate::training::colors::{self, oklch};
use crate::training::furnish::{Mood, furnish};
use crate::training::light::direct;
use crate::training::pieces::lamps;
use crate::training::plan::{HALF_WALL_M, Plan};
use crate::training::shell::{Daylight, build};

/// More lights than this are not looked at: the weakest go.
pub(crate) const MOST_LIGHTS: usize = 10;

/// Furnished rooms to learn from, in metres: the floor is z = 0, Z is up.
#[derive(Clone, Debug)]
pub struct TrainingRoom {
    pub(crate) scene: Scene,
    pub(crate) plan: Plan,
    pub(crate) lights: Vec<Light>,
    /// Light in each room that has been reflected at least once, as it falls on a surface; linear RGB.
    pub(crate) ambient: Vec<Vec3>,
}

impl TrainingRoom {
    /// The rooms that `seed` names: the same on every machine.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0x7EA1_A1B2_0000_0000);
        let palette = colors::palette(&mut random);
        let plan = Plan::new(&mut random);
        let mut b = Builder::with(random, palette);
        let (day, mood) = weather(&mut b.random);
        let mut lights = build(&mut b, &plan, day);
        for index in 0..plan.spaces.len() {
            lights.extend(furnish(&mut b, &plan, index, mood));
        }
        lights.retain(|light| light.power.max_element() > 0.02);
        lights.sort_by(|a, b| b.power.element_sum().total_cmp(&a.power.element_sum()));
        lights.truncate(MOST_LIGHTS);
        if lights.is_empty() {
            lights.push(bare_bulb(&plan, mood.tint));
        }
        let mut room = Self {
            scene: Scene::new(b.solids),
            ambient: vec![Vec3::ZERO; plan.spaces.len()],
            plan,
            lights,
        };
        room.ambient = (0..room.plan.spaces.len())
            .map(|i| room.reflected(i, &mut b.random))
            .collect();
        // A closed room is never black: a little light of the brightest one.
        let brightest = room
            .ambient
            .iter()
            .fold(Vec3::splat(1e-3), |a, b| a.max(*b));
        for ambient in &mut room.ambient {
            *ambient = ambient.max(0.2 * brightest);
        }
        room
    }

    /// Signed distance in metres from `point` to the nearest surface: positive in free space, where it is exact;
    /// exact inside of a single solid as well, and at least of the right sign where solids overlap.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.scene.distance(point)
    }

    /// Lower and upper corner of the box around all rooms, inner faces.
    pub fn bounds_m(&self) -> (Vec3, Vec3) {
        let bounds = self.plan.bounds();
        let height = self
            .plan
            .spaces
            .iter()
            .map(|space| space.height)
            .fold(0.0, f32::max);
        (bounds.low.extend(0.0), bounds.high.extend(height))
    }

    /// Floor of all rooms in square metres.
    pub fn floor_m2(&self) -> f32 {
        self.plan.spaces.iter().map(|space| space.floor_m2()).sum()
    }

    /// How many rooms there are.
    pub fn rooms(&self) -> usize {
        self.plan.spaces.len()
    }

    /// Whether a point is within one of the rooms, walls left out.
    pub fn is_inside(&self, point: Vec3) -> bool {
        self.plan
            .spaces
            .iter()
            .any(|space| point.z > 0.0 && point.z < space.height && space.holds(point.truncate()))
    }

    /// Reflected light at `point`.
    pub(crate) fn ambient_at(&self, point: Vec3) -> Vec3 {
        let p = point.truncate();
        let index = self.plan.spaces.iter().position(|space| {
            space
                .areas
                .iter()
                .any(|area| area.grown(HALF_WALL_M).holds(p))
        });
        self.ambient[index.unwrap_or(0)]
    }

    /// Mean of the light that surfaces of a room reflect, again and again, from some random places of it.
    fn reflected(&self, index: usize, r: &mut Random) -> Vec3 {
        const SAMPLES: u32 = 96;
        let space = &self.plan.spaces[index];
        let (mut given, mut tone, mut count) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for _ in 0..SAMPLES {
            let area = r.pick(&space.areas);
            let p = area.low + area.size() * glam::Vec2::new(r.range(0.1, 0.9), r.range(0.1, 0.9));
            let from = p.extend(r.range(0.8, space.height - 0.2));
            let dir = Vec3::new(r.range(-1.0, 1.0), r.range(-1.0, 1.0), r.range(-1.0, 1.0))
                .normalize_or(Vec3::X);
            if self.distance(from) < 0.02 {
                continue;
            }
            let Some(hit) = self.scene.cast(from, dir, 30.0) else {
                continue;
            };
            let look = &self.scene.solids[hit.solid as usize].look;
            let at = from + dir * hit.t + hit.normal * 1e-3;
            let light = direct(
                self,
                at,
                hit.normal,
                [r.range(-1.0, 1.0), r.range(-1.0, 1.0)],
                dir,
                0.0,
                0.0,
            );
            given += light.crisp + light.soft;
            tone += look.tones[0].lerp(look.tones[1], 0.5);
            count += 1.0f32;
        }
        let share = 1.0 / count.max(1.0);
        let (given, tone) = (given * share, (tone * share).min(Vec3::splat(0.8)));
        given * tone / (Vec3::ONE - tone)
    }
}

/// Time of day, how full the rooms are, and which light is on.
fn weather(r: &mut Random) -> (Daylight, Mood) {
    let level = match r.below(10) {
        0..=5 => r.range(0.4, 1.0),
        6 | 7 => r.range(0.05, 0.4),
        _ => 0.0,
    };
    let tint = oklch(0.93, r.range(0.0, 0.05), r.pick(&[0.2, 0.25, 0.62])) * 1.15;
    let lamps = if level < 0.2 || r.chance(0.5) {
        r.range(0.35, 1.1)
    } else {
        0.0
    };
    // Lived-in rooms are the usual ones.
    let full = r.unit().sqrt();
    let day = Daylight { level, tint };
    (
        day,
        Mood {
            full: full.max(0.05),
            lamps,
            tint: lamps::warmth(r),
        },
    )
}

fn bare_bulb(plan: &Plan, tint: Vec3) -> Light {
    let area = plan.spaces[0].areas[0];
    let middle = 0.5 * (area.low + area.high);
    Light {
        center: middle.extend(plan.spaces[0].height - 0.25),
        spread: [Vec3::X * 0.05, Vec3::Y * 0.05],
        facing: Vec3::ZERO,
        power: tint * 1.5,
    }
}
