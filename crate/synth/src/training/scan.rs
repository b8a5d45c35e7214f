//! A walk through a training room.

use crate::layout::{Content, seven_scenes_upright};
use crate::path::{View, path};
use crate::room::Room;
use crate::trace::{Frame, render};

/// A scan to learn from. Its world is the room's: metres, Z up, the floor at z = 0.
pub struct TrainingScan {
    room: Room,
    views: Vec<View>,
}

impl TrainingScan {
    /// The room named by `seed`, walked through in `frames` pictures of `width` by `height` pixels.
    pub fn new(seed: u64, frames: usize, width: u32, height: u32) -> Self {
        let room = Room::new(seed);
        let views = path(&room, frames, width, height);
        Self { room, views }
    }

    /// The views of the frames, in order.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// Colour and exact depth of frame `index`.
    pub fn frame(&self, index: usize) -> Frame {
        render(&self.room, &self.views[index])
    }

    /// The scan's text files in the 7-Scenes layout, calibration and poses, by name.
    pub fn texts(&self) -> Vec<(String, String)> {
        seven_scenes_upright(&self.views)
            .into_iter()
            .filter_map(|(name, content)| match content {
                Content::Text(text) => Some((name, text)),
                Content::Color(_) | Content::Depth(_) => None,
            })
            .collect()
    }
}
