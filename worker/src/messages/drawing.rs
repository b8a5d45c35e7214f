//! What an engine asks a view in another worker to draw. The vertices of bricks travel beside it, as one `Float32Array`.

use serde::{Deserialize, Serialize};
use tsify::Tsify;

/// From an engine without a canvas to the worker that has it.
#[derive(Serialize, Deserialize, Tsify)]
#[serde(
    tag = "type",
    rename_all = "camelCase",
    rename_all_fields = "camelCase"
)]
pub enum Drawing {
    /// Take all bricks away.
    Clear {
        /// Edge of those that will come, metres.
        brick_size_m: f32,
        /// Put the camera where the whole room will be in the picture.
        home: bool,
    },
    /// Draw the cameras of a scan.
    Cameras {
        /// Its name.
        title: String,
        /// In the order of capture.
        poses: Vec<CameraMessage>,
    },
    /// Draw new versions of bricks; one without vertices goes.
    Bricks {
        /// In the order of their vertices.
        bricks: Vec<BrickMessage>,
    },
}

/// A camera.
#[derive(Serialize, Deserialize, Tsify)]
#[serde(rename_all = "camelCase")]
pub struct CameraMessage {
    /// Camera to world, column by column: three axes (x right, y down, z forward) and the place in metres.
    pub world_from_camera: [f32; 12],
    /// Pixels: width and height.
    pub size: [u32; 2],
    /// Pixels: fx, fy, cx, cy.
    pub lens: [f32; 4],
}

/// A brick and how many vertices it has.
#[derive(Serialize, Deserialize, Tsify)]
pub struct BrickMessage(pub [i32; 3], pub u32);
