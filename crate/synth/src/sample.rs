//! A scan that nobody had to download: its files are drawn at the moment they are read.

use std::cell::RefCell;
use std::collections::HashMap;

use glam::{Mat3, Vec3};
use scan::{Entry, Source, SourceError};

use crate::layout::{Content, Layout};
use crate::path::{View, path};
use crate::random::hash_unit;
use crate::room::Room;
use crate::trace::{Frame, depth, render};

/// A walk through a room made by rule, as the folder that a phone with a depth sensor would have written.
pub struct SampleScan {
    room: Room,
    views: Vec<View>,
    layout: Layout,
    noisy: bool,
    entries: Vec<Entry>,
    contents: HashMap<String, Content>,
    /// Colour and depth of a frame are mostly read one after the other.
    last: RefCell<Option<(usize, Frame)>>,
}

impl SampleScan {
    /// The room named by `seed`, walked through in `frames` pictures of `width` by `height` pixels, in the 7-Scenes
    /// layout with a depth sensor's noise.
    pub fn new(seed: u64, frames: usize, width: u32, height: u32) -> Self {
        let room = Room::new(seed);
        let views = path(&room, frames, width, height);
        Self {
            room,
            views,
            layout: Layout::SevenScenes,
            noisy: true,
            entries: Vec::new(),
            contents: HashMap::new(),
            last: RefCell::new(None),
        }
        .with_layout(Layout::SevenScenes)
    }

    /// A walk as the page offers it: 36 pictures of 320 by 240 pixels.
    pub fn walk(seed: u64) -> Self {
        Self::new(seed, 36, 320, 240)
    }

    /// The sample the page starts with.
    pub fn first() -> Self {
        Self::walk(3)
    }

    /// The same walk in another layout.
    pub fn with_layout(mut self, layout: Layout) -> Self {
        let files = layout.files(&self.views);
        self.entries = files
            .iter()
            .map(|(path, _)| Entry { path: path.clone() })
            .collect();
        self.contents = files.into_iter().collect();
        self.layout = layout;
        self
    }

    /// The same walk with exact depth, rounded to the layout's unit only.
    pub fn without_noise(mut self) -> Self {
        self.noisy = false;
        self
    }

    /// The room that is walked through.
    pub fn room(&self) -> &Room {
        &self.room
    }

    /// The views of the frames, in the room's coordinates.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// Rotation and translation in metres that bring the room's coordinates into the world of the files.
    pub fn world_from_room(&self) -> (Mat3, Vec3) {
        self.layout.world_from_room(&self.views)
    }

    /// Every file with its content, for writing the scan to a folder or an archive.
    pub fn files(&self) -> impl Iterator<Item = (&str, Vec<u8>)> {
        self.entries.iter().filter_map(|entry| {
            Some((
                entry.path.as_str(),
                self.bytes(self.contents.get(&entry.path)?),
            ))
        })
    }

    fn bytes(&self, content: &Content) -> Vec<u8> {
        match *content {
            Content::Text(ref text) => text.clone().into_bytes(),
            Content::Color(i) => {
                let frame = render(&self.room, &self.views[i]);
                let png = color_png(frame.width, frame.height, &frame.color);
                self.last.replace(Some((i, frame)));
                png
            }
            Content::Depth(i) => {
                let last = self.last.borrow();
                let drawn = last
                    .as_ref()
                    .filter(|(at, _)| *at == i)
                    .map(|(_, frame)| &frame.depth_m);
                let view = &self.views[i];
                let units = match drawn {
                    Some(depth_m) => self.sense(i, depth_m),
                    None => self.sense(i, &depth(&self.room, view)),
                };
                depth_png(view.camera.width, view.camera.height, &units)
            }
        }
    }

    /// What a depth sensor would store: noise that grows with the square of the distance, about half of a first
    /// Kinect's (Nguyen et al., 3DIMPVT 2012).
    fn sense(&self, frame: usize, depth_m: &[f32]) -> Vec<u16> {
        let units_per_m = self.layout.depth_units_per_m();
        let strength = if self.noisy { 0.5 } else { 0.0 };
        depth_m
            .iter()
            .enumerate()
            .map(|(pixel, &z)| {
                // Three uniform draws make a bell of unit variance.
                let draw = |k| hash_unit(pixel as i32, frame as i32, k, 0x5EED);
                let bell = 2.0 * (draw(0) + draw(1) + draw(2)) - 3.0;
                let sigma_m = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
                ((z + strength * sigma_m * bell) * units_per_m + 0.5) as u16
            })
            .collect()
    }
}

impl Source for SampleScan {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        match self.contents.get(path) {
            Some(content) => Ok(self.bytes(content)),
            None => Err(SourceError::NotFound {
                path: path.to_owned(),
            }),
        }
    }

    fn name(&self) -> &str {
        "sample-room"
    }
}

fn color_png(width: u32, height: u32, color: &[[u8; 3]]) -> Vec<u8> {
    stored_png(
        width,
        height,
        png::ColorType::Rgb,
        png::BitDepth::Eight,
        color.as_flattened(),
    )
}

fn depth_png(width: u32, height: u32, units: &[u16]) -> Vec<u8> {
    let bytes: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
    stored_png(
        width,
        height,
        png::ColorType::Grayscale,
        png::BitDepth::Sixteen,
        &bytes,
    )
}

/// An uncompressed PNG in memory, which has no way to fail.
fn stored_png(
    width: u32,
    height: u32,
    color: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
) -> Vec<u8> {
    let mut png = Vec::with_capacity(bytes.len() + bytes.len() / 64 + 1024);
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::NoCompression);
    encoder.set_filter(png::Filter::NoFilter);
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(bytes));
    debug_assert!(written.is_ok(), "{written:?}");
    png
}
