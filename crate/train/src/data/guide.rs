//! Stereo's depth of a scan's keyframes, for networks with the switch `guide`.

use super::crop::Crop;
use super::picture::{mirror_view, pinhole, single};
use crate::random::Random;
use burn::tensor::Device;
use glam::{Affine3A, Vec3};
use mesh::camera::Pinhole;
use net::View;
use net::sample::GuideMap;
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView, serialize};
use scan::Scan;
use std::path::Path;
use stereo::{Step, StereoConfig, StereoError};

/// The depth maps of a scan, packed: a room of sixty keyframes takes 3 MB at 160 x 120 pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StereoMaps(Vec<StereoMap>);

#[derive(Clone, Debug, PartialEq)]
struct StereoMap {
    camera: Pinhole,
    world_from_camera: Affine3A,
    /// 0 where there is none.
    depth_mm: Vec<u16>,
    /// 255 is certain.
    confidence: Vec<u8>,
}

impl StereoMaps {
    /// Matches keyframes, which are indices into the scan's frames, on the processor. None where no two see the same
    /// from different places.
    ///
    /// # Errors
    /// What stereo says.
    pub fn make(scan: &Scan, keyframes: &[usize]) -> Result<Self, StereoError> {
        let mut maps = Vec::new();
        let mut stereo = match StereoConfig::default().init(scan, keyframes, &Device::flex()) {
            Err(StereoError::NoParallax { .. }) => return Ok(Self::default()),
            other => other?,
        };
        loop {
            match pollster::block_on(stereo.advance(scan))? {
                Step::Working | Step::Matched | Step::Finding(_) => {}
                Step::Depth(map) => maps.push(StereoMap {
                    camera: pinhole(&map.camera),
                    world_from_camera: single(&scan.frames()[map.frame].pose),
                    // Out of a number's range it is cut, which is what `as` does.
                    depth_mm: map
                        .depth_m
                        .iter()
                        .map(|m| (m * 1e3).round() as u16)
                        .collect(),
                    confidence: map
                        .confidence
                        .iter()
                        .map(|c| (c * 255.0).round() as u8)
                        .collect(),
                }),
                Step::Done => return Ok(Self(maps)),
            }
        }
    }

    /// How many keyframes have depth.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether none has.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The maps that show any of `points` (in the scan's world), in the crop's world. Each stays with a chance of
    /// `share`: a network that always had all of them would be lost in a scan with few keyframes.
    pub fn of_crop(
        &self,
        crop: &Crop,
        points: &[Vec3],
        share: f32,
        random: &mut Random,
    ) -> Vec<GuideMap> {
        let mut stays = || random.chance(share);
        let maps = self.0.iter().filter(|_| stays());
        let near =
            maps.filter(|map| super::views::seen(&map.camera, map.world_from_camera, points) > 0);
        near.map(|map| map.in_crop(crop)).collect()
    }

    /// Writes the maps as a safetensors file: of map `k` its depth in millimetres and its confidence `[H, W]`, and
    /// fx, fy, cx, cy with the rows of its pose.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, file: &Path) -> std::io::Result<()> {
        let stored: Vec<(Vec<u8>, Vec<u8>)> = self.0.iter().map(StereoMap::bytes).collect();
        let mut views = Vec::new();
        for (k, (map, (depth, numbers))) in self.0.iter().zip(&stored).enumerate() {
            let size = vec![map.camera.height as usize, map.camera.width as usize];
            for (name, kind, shape, bytes) in [
                (DEPTH, Dtype::U16, size.clone(), depth),
                (CONFIDENCE, Dtype::U8, size, &map.confidence),
                (CAMERA, Dtype::F32, vec![NUMBERS], numbers),
            ] {
                let view = TensorView::new(kind, shape, bytes).map_err(std::io::Error::other)?;
                views.push((entry(k, name), view));
            }
        }
        let bytes = serialize(views, None).map_err(std::io::Error::other)?;
        super::write_whole(file, &bytes)
    }

    /// Reads what [`StereoMaps::write`] wrote; `None` for anything else, so that it is made anew.
    pub fn read(file: &Path) -> Option<Self> {
        let bytes = std::fs::read(file).ok()?;
        let file = SafeTensors::deserialize(&bytes).ok()?;
        let maps = (0..file.len() / 3).map(|k| StereoMap::read(&file, k).ok().flatten());
        maps.collect::<Option<_>>().map(Self)
    }
}

const DEPTH: &str = "depth_mm";
const CONFIDENCE: &str = "confidence";
const CAMERA: &str = "camera";
/// Four of the camera and twelve of the pose.
const NUMBERS: usize = 16;

fn entry(map: usize, name: &str) -> String {
    format!("{map:05}.{name}")
}

impl StereoMap {
    fn in_crop(&self, crop: &Crop) -> GuideMap {
        let mut camera = self.camera;
        let mut depth_m: Vec<f32> = self
            .depth_mm
            .iter()
            .map(|mm| f32::from(*mm) / 1e3)
            .collect();
        let mut confidence: Vec<f32> = self
            .confidence
            .iter()
            .map(|c| f32::from(*c) / 255.0)
            .collect();
        if crop.mirrored {
            mirror_view(&mut camera, [&mut depth_m, &mut confidence]);
        }
        GuideMap {
            view: View {
                camera,
                world_from_camera: crop.pose(self.world_from_camera),
            },
            depth_m,
            confidence,
        }
    }

    /// Its depth, and the numbers of its camera.
    fn bytes(&self) -> (Vec<u8>, Vec<u8>) {
        let Pinhole { fx, fy, cx, cy, .. } = self.camera;
        let pose = self.world_from_camera.to_cols_array();
        let numbers = [fx, fy, cx, cy].into_iter().chain(pose);
        (
            self.depth_mm
                .iter()
                .flat_map(|mm| mm.to_le_bytes())
                .collect(),
            numbers.flat_map(f32::to_le_bytes).collect(),
        )
    }

    fn read(file: &SafeTensors, k: usize) -> Result<Option<Self>, SafeTensorError> {
        let depth = file.tensor(&entry(k, DEPTH))?;
        let confidence = file.tensor(&entry(k, CONFIDENCE))?;
        let numbers = file.tensor(&entry(k, CAMERA))?;
        let words = numbers.data().as_chunks::<4>().0.iter();
        let numbers: Vec<f32> = words.map(|word| f32::from_le_bytes(*word)).collect();
        let (&[height, width], [fx, fy, cx, cy, pose @ ..]) = (depth.shape(), numbers.as_slice())
        else {
            return Ok(None);
        };
        let fits = confidence.shape() == depth.shape() && depth.dtype() == Dtype::U16;
        let pose: Option<&[f32; 12]> = pose.as_array();
        let Some(pose) = pose.filter(|_| fits) else {
            return Ok(None);
        };
        Ok(Some(Self {
            camera: Pinhole {
                width: width as u32,
                height: height as u32,
                fx: *fx,
                fy: *fy,
                cx: *cx,
                cy: *cy,
            },
            world_from_camera: Affine3A::from_cols_array(pose),
            depth_mm: depth
                .data()
                .as_chunks::<2>()
                .0
                .iter()
                .map(|two| u16::from_le_bytes(*two))
                .collect(),
            confidence: confidence.data().to_vec(),
        }))
    }
}
