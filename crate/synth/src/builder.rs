//! Putting solids together: sizes in metres in the furniture's own frame, rotations by place.

use glam::{Mat3, Vec3};

use crate::palette::Palette;
use crate::random::Random;
use crate::solid::{Shape, Solid};
use crate::texture::{Look, Pattern};

/// A frame in the room: x to the right and y away from someone who looks at a wall, z up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub origin: Vec3,
    /// Orthonormal; a mirrored room has determinant -1.
    pub axes: Mat3,
}

impl Place {
    pub fn point(&self, local: [f32; 3]) -> Vec3 {
        self.origin + self.axes * Vec3::from(local)
    }

    pub fn at(&self, x: f32, y: f32, z: f32) -> Self {
        Self {
            origin: self.point([x, y, z]),
            ..*self
        }
    }

    /// Turned about the vertical by whole quarters, exactly.
    pub fn quarter(&self, count: u32) -> Self {
        let (cos, sin) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][count as usize % 4];
        let turn = Mat3::from_cols(Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0), Vec3::Z);
        Self {
            axes: self.axes * turn,
            ..*self
        }
    }

    /// Turned about the vertical.
    pub fn turn(&self, radians: f32) -> Self {
        self.rotated(2, radians)
    }

    /// Leaning about x: positive leans the top towards -y.
    pub fn lean(&self, radians: f32) -> Self {
        self.rotated(0, radians)
    }

    /// Rolled about y: positive drops the +x side.
    pub fn roll(&self, radians: f32) -> Self {
        self.rotated(1, radians)
    }

    fn rotated(&self, axis: usize, radians: f32) -> Self {
        // libm, not the machine's own sine, so that all machines build the same room.
        let (sin, cos) = libm::sincosf(radians);
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut turn = Mat3::IDENTITY;
        turn.col_mut(a)[a] = cos;
        turn.col_mut(a)[b] = sin;
        turn.col_mut(b)[a] = -sin;
        turn.col_mut(b)[b] = cos;
        Self {
            axes: self.axes * turn,
            ..*self
        }
    }
}

/// The room as it grows.
pub(crate) struct Builder {
    pub solids: Vec<Solid>,
    pub random: Random,
    pub palette: Palette,
    /// What wooden things are drawn with.
    pub grain: Pattern,
    /// What cloth is drawn with.
    pub weave: Pattern,
}

impl Builder {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let palette = Palette::pick(&mut random);
        Self::with(random, palette)
    }

    pub fn with(random: Random, palette: Palette) -> Self {
        Self {
            solids: Vec::new(),
            random,
            palette,
            grain: Pattern::Wood,
            weave: Pattern::Weave,
        }
    }

    fn add(&mut self, place: &Place, shape: Shape, look: Look) {
        let seed = self.random.bits() >> 8;
        self.solids.push(Solid {
            shape,
            center: place.origin,
            axes: place.axes,
            look: if look.seed == 0 {
                look.seed(seed)
            } else {
                look
            },
            casts_shadow: true,
        });
    }

    /// A box of outer `size` around the place's origin with edges rounded by `round`.
    pub fn block(&mut self, place: &Place, size: [f32; 3], round: f32, look: Look) {
        let half_m = (Vec3::from(size) * 0.5 - round).max(Vec3::ZERO);
        self.add(
            place,
            Shape::Block {
                half_m,
                round_m: round,
            },
            look,
        );
    }

    /// A cut cone of outer radii and `height` around the place's origin with edges rounded by `round`.
    pub fn drum(&mut self, place: &Place, radii: [f32; 2], height: f32, round: f32, look: Look) {
        let shape = Shape::Drum {
            bottom_m: radii[0] - round,
            top_m: radii[1] - round,
            half_m: 0.5 * height - round,
            round_m: round,
        };
        self.add(place, shape, look);
    }

    pub fn ball(&mut self, place: &Place, radius: f32, look: Look) {
        self.add(
            place,
            Shape::Block {
                half_m: Vec3::ZERO,
                round_m: radius,
            },
            look,
        );
    }

    /// A cut cone from one point to another of the place.
    pub fn rod(
        &mut self,
        place: &Place,
        from: [f32; 3],
        to: [f32; 3],
        radii: [f32; 2],
        look: Look,
    ) {
        let (a, b) = (place.point(from), place.point(to));
        let z = (b - a).normalize_or(Vec3::Z);
        let x = if z.z.abs() < 0.9 { Vec3::Z } else { Vec3::X }
            .cross(z)
            .normalize();
        let along = Place {
            origin: 0.5 * (a + b),
            axes: Mat3::from_cols(x, z.cross(x), z),
        };
        self.drum(&along, radii, (b - a).length(), 0.0, look);
    }

    pub fn wood(&self) -> Look {
        let [dark, light] = self.palette.wood;
        Look::new(self.grain, [dark, light, light]).gloss(0.12)
    }

    pub fn cloth(&self, tones: [Vec3; 2]) -> Look {
        Look::new(self.weave, [tones[0], tones[1], tones[1]])
    }

    pub fn accent(&mut self) -> Vec3 {
        let accents = self.palette.accents;
        self.random.pick(&accents)
    }

    /// Three different accents.
    pub fn accents(&mut self) -> [Vec3; 3] {
        let from = self.palette.accents;
        let first = self.random.below(4) as usize;
        [0, 1, 2].map(|k| from[(first + k) % 4])
    }
}
