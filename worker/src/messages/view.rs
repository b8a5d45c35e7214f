//! What the page tells about the view: the visitor's hands and keys, how it is drawn, where the camera goes.

use serde::Deserialize;
use tsify::Tsify;

/// Pointer, wheel and keys, in physical pixels of the canvas.
#[derive(Deserialize, Tsify)]
#[serde(
    tag = "kind",
    rename_all = "camelCase",
    rename_all_fields = "camelCase"
)]
pub enum InputEvent {
    /// A button or finger goes down.
    PointerDown {
        /// Pointer id of the browser.
        id: i32,
        /// From the left edge.
        x: f32,
        /// From the top edge.
        y: f32,
        /// 0 left, 1 middle, 2 right, as in `PointerEvent.button`.
        button: u8,
        /// A finger rather than a mouse or pen.
        touch: bool,
        /// Shift was held (a drag then pans).
        shift: bool,
    },
    /// It moves.
    PointerMove {
        /// Pointer id of the browser.
        id: i32,
        /// From the left edge.
        x: f32,
        /// From the top edge.
        y: f32,
    },
    /// It goes up or is cancelled.
    PointerUp {
        /// Pointer id of the browser.
        id: i32,
    },
    /// The wheel, in CSS pixels as normalised by the page.
    Wheel {
        /// Positive: away from the scene.
        delta: f32,
        /// From the left edge.
        x: f32,
        /// From the top edge.
        y: f32,
    },
    /// Focus the point under the cursor.
    DoubleClick {
        /// From the left edge.
        x: f32,
        /// From the top edge.
        y: f32,
    },
    /// A key by `KeyboardEvent.code`.
    Key {
        /// For example `KeyW`, `ArrowLeft`.
        code: String,
        /// Down or up.
        down: bool,
    },
    /// The canvas has another size.
    Resize {
        /// Physical pixels.
        width_px: u32,
        /// Physical pixels.
        height_px: u32,
        /// Physical pixels per CSS pixel.
        pixel_ratio: f32,
    },
    /// The canvas lost the focus: let go of everything.
    Blur,
}

/// How the view is drawn.
#[derive(Deserialize, Tsify, Clone, Copy)]
#[serde(rename_all = "camelCase")]
pub struct ViewOptions {
    /// What the surface is painted with.
    pub shading: ShadingMode,
    /// The cameras and their path.
    pub cameras: bool,
    /// Light or dark.
    pub dark: bool,
    /// Draw walls seen from behind.
    pub back_faces: bool,
    /// The visitor asked for little motion.
    pub reduced_motion: bool,
}

/// What a surface is painted with.
#[derive(Deserialize, Tsify, Clone, Copy)]
#[serde(rename_all = "camelCase")]
pub enum ShadingMode {
    /// The colour of the photos.
    Color,
    /// The direction that the surface faces.
    Normal,
    /// The triangles.
    Wireframe,
    /// The distance from the eye.
    Depth,
    /// How sure the measurements are that the surface rests on.
    Confidence,
    /// How many views the surface rests on.
    Views,
}

/// Where to put the camera.
#[derive(Deserialize, Tsify, Clone, Copy)]
#[serde(tag = "kind", rename_all = "camelCase")]
pub enum LookAt {
    /// Everything in view.
    Home,
    /// From above.
    Top,
    /// Through the camera of a keyframe.
    Keyframe {
        /// Its position in the plan.
        index: u32,
    },
}
