//! A size in pixels on the command line.

use std::{fmt, str::FromStr};

/// Width and height in pixels.
#[derive(Clone, Copy)]
pub struct Size(pub (u32, u32));

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self((width, height)) = self;
        write!(f, "{width}x{height}")
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X']);
        let sides = sides.and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
        sides
            .map(Self)
            .ok_or_else(|| "expected width x height in pixels, such as 320x240".to_owned())
    }
}
