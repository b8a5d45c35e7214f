//! What the page forwards from the visitor's hands, free of any browser type.

/// Mouse and pen drag with buttons, fingers by their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointerKind {
    /// A mouse, or a pen.
    Mouse,
    /// A finger.
    Touch,
}

/// One event from the page. Positions are device pixels from the canvas's top left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A button or finger went down.
    PointerDown {
        /// The browser's pointer id.
        id: i32,
        /// Pixels from the left.
        x: f32,
        /// Pixels from the top.
        y: f32,
        /// The DOM's number: 0 left, 1 middle, 2 right.
        button: u8,
        /// What it is.
        kind: PointerKind,
        /// Shift held: a left drag pans.
        shift: bool,
    },
    /// A pointer moved; of one that is not down it is ignored.
    PointerMove {
        /// The browser's pointer id.
        id: i32,
        /// Pixels from the left.
        x: f32,
        /// Pixels from the top.
        y: f32,
    },
    /// A pointer went up or was cancelled.
    PointerUp {
        /// The browser's pointer id.
        id: i32,
    },
    /// The wheel or a trackpad scrolled.
    Wheel {
        /// CSS pixels downwards, as the page normalises them; positive goes away.
        dy: f32,
        /// Cursor, pixels from the left.
        x: f32,
        /// Cursor, pixels from the top.
        y: f32,
    },
    /// A key, by the DOM's physical `code` ("KeyW", "ArrowLeft").
    Key {
        /// `KeyboardEvent.code`.
        code: String,
        /// Pressed or released.
        down: bool,
    },
    /// The canvas changed size.
    Resize {
        /// Width of the drawing buffer, device pixels.
        width_px: u32,
        /// Height of the drawing buffer, device pixels.
        height_px: u32,
        /// Device pixels per CSS pixel.
        scale: f32,
    },
    /// The canvas lost the focus: everything held is let go.
    Blur,
}
