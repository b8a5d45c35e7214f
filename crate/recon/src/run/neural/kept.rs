//! What finished stages made, as bytes: a run that begins again, on another device, is spared what was done before. Numbers of
//! four bytes, little-endian; each list after its length. Bytes that do not fit what is read from them are as good as none.

use super::levels::{Field, read};
use burn::{
    Tensor,
    tensor::{Device, TensorData},
};
use glam::{Affine3A, IVec3};
use mesh::{camera::Pinhole, soup::Evidence};
use net::{View, model::Decoded, sample::GuideMap};

/// A level whose features are larger than this is decoded again: the copy would cost more than it saves.
const MOST_BYTES: usize = 64 << 20;

/// A level that was decoded, for the level below.
pub(super) struct Above {
    /// What the 3D network said of the voxels that go on, and of no others.
    pub decoded: Decoded,
    /// Where each tile's voxels end among those of the level below.
    pub ends: Vec<usize>,
    /// The voxels of the level below, eight of each that goes on.
    pub sites: Vec<IVec3>,
}

/// Depth with confidence of the keyframes.
pub(super) fn guide(maps: &[GuideMap]) -> Vec<u8> {
    let mut to = Writer::default();
    to.count(maps.len());
    for GuideMap {
        view,
        depth_m,
        confidence,
    } in maps
    {
        let camera = view.camera;
        to.count(camera.width as usize);
        to.count(camera.height as usize);
        to.floats(&[camera.fx, camera.fy, camera.cx, camera.cy]);
        to.floats(&view.world_from_camera.to_cols_array());
        to.floats(depth_m);
        to.floats(confidence);
    }
    to.0
}

/// As it was given to [`guide`].
pub(super) fn read_guide(bytes: &[u8]) -> Option<Vec<GuideMap>> {
    let mut from = Reader(bytes);
    let maps = from.count()?;
    let map = |_| {
        let (width, height) = (from.count()?, from.count()?);
        let [fx, fy, cx, cy] = from.floats()?.try_into().ok()?;
        let pose: [f32; 12] = from.floats()?.try_into().ok()?;
        let camera = Pinhole {
            width: width as u32,
            height: height as u32,
            fx,
            fy,
            cx,
            cy,
        };
        let map = GuideMap {
            view: View {
                camera,
                world_from_camera: Affine3A::from_cols_array(&pose),
            },
            depth_m: from.floats()?,
            confidence: from.floats()?,
        };
        let pixels = width.checked_mul(height)?;
        (map.depth_m.len() == pixels && map.confidence.len() == pixels).then_some(map)
    };
    let maps: Option<Vec<GuideMap>> = (0..maps).map(map).collect();
    maps.filter(|_| from.0.is_empty())
}

/// A level for the one below. `None` if it is large, or the device does not give it.
pub(super) async fn above(above: &Above) -> Option<Vec<u8>> {
    if above.decoded.features.shape().num_elements() * 4 > MOST_BYTES {
        return None;
    }
    let Decoded { features, logit } = &above.decoded;
    let features = read(features.clone().flatten(0, 1)).await.ok()?;
    let logits = read(logit.clone()).await.ok()?;
    let mut to = Writer::default();
    to.sites(&above.sites);
    to.count(above.ends.len());
    above.ends.iter().for_each(|&end| to.count(end));
    to.floats(&features);
    to.floats(&logits);
    Some(to.0)
}

/// As it was given to [`above()`], for a scan of so many tiles.
pub(super) fn read_above(bytes: &[u8], tiles: usize, device: &Device) -> Option<Above> {
    let mut from = Reader(bytes);
    let sites = from.sites()?;
    let ends = from.count()?;
    let ends: Vec<usize> = (0..ends).map(|_| from.count()).collect::<Option<_>>()?;
    let (features, logits) = (from.floats()?, from.floats()?);
    let rows = sites.len() / 8;
    let fits = ends.len() == tiles
        && ends.is_sorted()
        && ends.last() == Some(&sites.len())
        && rows > 0
        && logits.len() == rows
        && !features.is_empty()
        && features.len().is_multiple_of(rows)
        && from.0.is_empty();
    let channels = features.len() / rows.max(1);
    fits.then(|| Above {
        decoded: Decoded {
            features: Tensor::from_data(TensorData::new(features, [rows, channels]), device),
            logit: Tensor::from_data(TensorData::new(logits, [rows]), device),
        },
        ends,
        sites,
    })
}

/// What the finest level made.
pub(super) fn field(field: &Field) -> Vec<u8> {
    let mut to = Writer::default();
    to.sites(&field.sites);
    to.floats(&field.distances);
    let packed = field.evidence.iter().map(|of| of.packed() as usize);
    to.count(field.evidence.len());
    packed.for_each(|packed| to.count(packed));
    to.0
}

/// As it was given to [`field()`].
pub(super) fn read_field(bytes: &[u8]) -> Option<Field> {
    let mut from = Reader(bytes);
    let (sites, distances) = (from.sites()?, from.floats()?);
    let known = from.count()?;
    let words = from.words(known)?.map(u32::from_le_bytes);
    let evidence: Vec<Evidence> = words.map(Evidence::unpacked).collect();
    let fits = sites.len() == distances.len()
        && (evidence.is_empty() || evidence.len() == sites.len())
        && from.0.is_empty();
    fits.then_some(Field {
        sites,
        distances,
        evidence,
    })
}

#[derive(Default)]
struct Writer(Vec<u8>);

impl Writer {
    fn count(&mut self, count: usize) {
        self.0.extend((count as u32).to_le_bytes());
    }

    fn floats(&mut self, values: &[f32]) {
        self.count(values.len());
        self.0.reserve(4 * values.len());
        values
            .iter()
            .for_each(|value| self.0.extend(value.to_le_bytes()));
    }

    fn sites(&mut self, sites: &[IVec3]) {
        self.count(sites.len());
        self.0.reserve(12 * sites.len());
        let parts = sites.iter().flat_map(IVec3::to_array);
        parts.for_each(|part| self.0.extend(part.to_le_bytes()));
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn words(&mut self, count: usize) -> Option<impl Iterator<Item = [u8; 4]>> {
        let (words, rest) = self.0.split_at_checked(count.checked_mul(4)?)?;
        self.0 = rest;
        Some(words.chunks_exact(4).map(|w| [w[0], w[1], w[2], w[3]]))
    }

    fn count(&mut self) -> Option<usize> {
        let mut words = self.words(1)?;
        words.next().map(|word| u32::from_le_bytes(word) as usize)
    }

    fn floats(&mut self) -> Option<Vec<f32>> {
        let count = self.count()?;
        Some(self.words(count)?.map(f32::from_le_bytes).collect())
    }

    fn sites(&mut self) -> Option<Vec<IVec3>> {
        let count = self.count()?;
        let words = self.words(count.checked_mul(3)?)?;
        let parts: Vec<i32> = words.map(i32::from_le_bytes).collect();
        Some(
            parts
                .chunks_exact(3)
                .map(|p| IVec3::new(p[0], p[1], p[2]))
                .collect(),
        )
    }
}
