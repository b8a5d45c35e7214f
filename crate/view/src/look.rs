//! What a picture shows and in which colours, the same for both painters.

use glam::{Mat4, Vec2, Vec3};
use mesh::Bounds;

use crate::OrbitCamera;
use crate::bounds::corners;

/// How the surface is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// The scan's colours under a soft light.
    #[default]
    Color,
    /// World normal as colour: (n + 1) / 2, so that floors are blue.
    Normal,
    /// Distance along the view direction on an even ramp, near is light.
    Depth,
    /// Colour with the triangles' edges on top.
    Wireframe,
    /// How sure the measurements are that the surface rests on, 0 to 1 along [`RAMP`]; [`UNKNOWN`] where they have none.
    Confidence,
    /// Views that the surface rests on: 1, 2, 4, 8, 16, 32 and more are even steps along [`RAMP`]; [`UNKNOWN`] where that is
    /// not known.
    Views,
}

/// Colours (sRGB) of everything but the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    /// Behind everything.
    pub background: [u8; 3],
    /// The floor's grid.
    pub grid: [u8; 3],
    /// Camera frusta and path.
    pub camera: [u8; 3],
    /// The frustum that is pointed at.
    pub highlight: [u8; 3],
    /// Edges in [`Shading::Wireframe`].
    pub wire: [u8; 3],
}

impl Theme {
    /// For a light page.
    pub const LIGHT: Self = Self {
        background: [244, 245, 247],
        grid: [120, 130, 146],
        camera: [53, 104, 212],
        highlight: [217, 95, 14],
        wire: [28, 34, 46],
    };
    /// For a dark page.
    pub const DARK: Self = Self {
        background: [20, 22, 27],
        grid: [142, 152, 168],
        camera: [122, 164, 255],
        highlight: [255, 170, 84],
        wire: [236, 240, 247],
    };
}

/// Everything about a picture that is neither the scene nor the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// How the surface is coloured.
    pub shading: Shading,
    /// The other colours.
    pub theme: Theme,
    /// Leave out surfaces seen from behind: one looks into a room through its walls.
    pub cull_back: bool,
    /// Draw the photos' cameras and their path.
    pub show_frusta: bool,
    /// Draw the 1 m grid under the floor.
    pub show_grid: bool,
    /// Height of the floor, metres.
    pub floor_height_m: f32,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            shading: Shading::default(),
            theme: Theme::LIGHT,
            cull_back: true,
            show_frusta: false,
            show_grid: true,
            floor_height_m: 0.0,
        }
    }
}

/// Size of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Columns, device pixels.
    pub width_px: u32,
    /// Rows, device pixels.
    pub height_px: u32,
    /// Device pixels per CSS pixel: lines keep their width on dense screens.
    pub scale: f32,
}

impl Viewport {
    /// Width / height.
    pub fn aspect(&self) -> f32 {
        let size = self.size_px();
        size.x / size.y
    }

    /// Columns and rows, at least 1.
    pub fn size_px(&self) -> Vec2 {
        Vec2::new(self.width_px.max(1) as f32, self.height_px.max(1) as f32)
    }

    /// Pixels (from the top left) to normalised device coordinates: x right, y up, -1 to 1.
    pub fn ndc(&self, at_px: Vec2) -> Vec2 {
        (at_px / self.size_px() * 2.0 - 1.0) * Vec2::new(1.0, -1.0)
    }

    /// World to clip of `camera` in a picture of this size.
    pub fn clip_from_world(&self, camera: &OrbitCamera) -> Mat4 {
        camera.clip_from_world(self.aspect())
    }
}

/// Views at the light end of [`RAMP`].
pub(crate) const MANY_VIEWS: f32 = 32.0;

/// What [`Shading::Confidence`] and [`Shading::Views`] show where nothing is known: a grey that is not on the ramp.
pub const UNKNOWN: [u8; 3] = [128, 128, 128];

/// The ramp of [`Shading::Depth`] (far to near), [`Shading::Confidence`] and [`Shading::Views`] (low to high): nine stops evenly spaced in OKLCh lightness (0.26
/// to 0.92) while the hue turns from 300 to 95 degrees, chroma at most 0.14 and within sRGB.
pub const RAMP: [[u8; 3]; 9] = [
    [48, 2, 89],
    [39, 42, 127],
    [3, 81, 138],
    [17, 112, 139],
    [2, 143, 146],
    [4, 175, 141],
    [111, 199, 120],
    [189, 215, 105],
    [255, 228, 127],
];

/// View depths (metres) that the ramp spans: what of `bounds` is ahead of the eye.
pub(crate) fn depth_range_m(camera: &OrbitCamera, bounds: Option<Bounds>) -> [f32; 2] {
    let Some(bounds) = bounds else {
        return [0.0, 1.0];
    };
    let (eye, forward) = (camera.eye_m(), camera.axes().2);
    let depths = corners(&bounds).map(|corner| (corner - eye).dot(forward));
    let near = depths.into_iter().fold(f32::INFINITY, f32::min).max(0.0);
    let far = depths.into_iter().fold(0.0, f32::max);
    [near, far.max(near + 0.1)]
}

/// sRGB bytes to 0..1, still encoded.
pub(crate) fn unit(rgb: [u8; 3]) -> Vec3 {
    Vec3::from_array(rgb.map(f32::from)) / 255.0
}
