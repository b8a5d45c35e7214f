//! Keyframes' pictures as the network takes them, and the planes that it made of them.

use crate::{
    convert::{pinhole, pose},
    event::Sink,
    plan::working_size,
};
use burn::{
    Tensor,
    tensor::{DType, Device, TensorData},
};
use net::{Level, View};
use scan::{ColorImage, Scan};
use std::collections::BTreeMap;
use stereo::view::shrink;

/// A keyframe's view and what the network keeps of its picture.
pub(super) struct Picture<P> {
    /// Frame of the scan.
    pub frame: usize,
    /// The camera at the working size.
    pub view: View,
    planes: [P; 3],
}

impl<P> Picture<P> {
    /// What is kept at a level.
    pub fn plane(&self, level: Level) -> &P {
        &self.planes[level as usize]
    }
}

/// Pictures by keyframe, all of one size, for planes of several are stacked.
pub(super) struct Pictures<'a, P> {
    keyframes: &'a [usize],
    size: (u32, u32),
    kept: BTreeMap<usize, Picture<P>>,
}

impl<'a, P> Pictures<'a, P> {
    /// None yet. The working size has the proportions of the first keyframe's picture.
    pub fn new(scan: &Scan, keyframes: &'a [usize], size: (u32, u32)) -> Self {
        let first = keyframes.first().map(|&f| scan.frames()[f].color_camera);
        let size = first.map_or(size, |camera| working_size(&camera, size));
        Self {
            keyframes,
            size,
            kept: BTreeMap::new(),
        }
    }

    /// Decodes a keyframe's picture: `[1, 3, H, W]`, sRGB 0 to 255. One that cannot be decoded is reported.
    pub fn load(
        &self,
        scan: &Scan,
        keyframe: usize,
        device: &Device,
        sink: &mut impl Sink,
    ) -> Option<(Tensor<4>, View)> {
        let index = self.keyframes[keyframe];
        let frame = &scan.frames()[index];
        let picture = super::super::color(scan, index, sink)?;
        let (width, height) = self.size;
        let view = View {
            camera: pinhole(&frame.color_camera.scaled(width, height)),
            world_from_camera: pose(frame),
        };
        let shape = [1, 3, height as usize, width as usize];
        let data = TensorData::new(planar(&picture, self.size), shape);
        Some((Tensor::from_data(data, (device, DType::F32)), view))
    }

    /// Keeps what the network made of a keyframe.
    pub fn keep(&mut self, keyframe: usize, view: View, planes: [P; 3]) {
        let frame = self.keyframes[keyframe];
        let picture = Picture {
            frame,
            view,
            planes,
        };
        self.kept.insert(keyframe, picture);
    }

    /// A keyframe's, unless its picture could not be decoded.
    pub fn of(&self, keyframe: usize) -> Option<&Picture<P>> {
        self.kept.get(&keyframe)
    }

    /// All of them, in the scan's order.
    pub fn all(&self) -> impl Iterator<Item = &Picture<P>> {
        self.kept.values()
    }
}

/// Red, green and blue after each other, at another size.
fn planar(picture: &ColorImage, size: (u32, u32)) -> Vec<f32> {
    let from = (picture.width as usize, picture.height as usize);
    let to = (size.0 as usize, size.1 as usize);
    let channel = |channel: usize| {
        let values = picture.rgb.iter().skip(channel).step_by(3);
        shrink(
            &values.map(|&value| f32::from(value)).collect::<Vec<_>>(),
            from,
            to,
        )
    };
    (0..3).flat_map(channel).collect()
}
