//! What the network is trained for: occupancy at 16 and 8 cm, signed distance at 4 cm, and for every voxel and view
//! whether the view sees its surface there (method 1.9, paper Eq. 8).

use burn::tensor::activation::tanh;
use burn::tensor::{Device, Int, Tensor, TensorData};
use glam::{IVec3, Vec3};

use crate::decode::children;
use crate::fusion::{Pairs, Pooling};
use crate::guide::{Guidance, guide_at};
use crate::model::{Decoded, GUIDE_CHANNELS, TSDF_SCALE};
use crate::sample::Truth;
use crate::{Ipdrecon, Level, Sample};

/// How a sample is gone through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LossOptions {
    /// How views are merged.
    pub pooling: Pooling,
    /// The most medium and fine sites: those nearest to a random one are kept.
    pub most_sites: [usize; 2],
    /// Which random one.
    pub seed: u64,
    /// Go down at no fewer sites than are truly occupied, the likeliest ones: training, as opposed to use. Of the truth only
    /// their number counts: sites that it chose would tell the level below where the surface is by being there.
    pub at_least_true: bool,
}

/// The loss of a sample, and how right the network was.
pub struct Loss {
    /// The sum of all parts, `[1]`.
    pub total: Tensor<1>,
    /// View occupancy of the three levels, occupancy of two, signed distance; each `[1]` and without gradient.
    pub parts: [(&'static str, Tensor<1>); 6],
    /// Coarse and medium occupancy against the truth, on supervised sites.
    pub occupancy: [Confusion; 2],
    /// Mean absolute error of the signed distance in metres over supervised fine sites, `[1]`; 0 where there are none.
    pub distance_error_m: Tensor<1>,
    /// Sites and visible pairs of each level.
    pub sites: [usize; 3],
    /// Pairs of a site and a view that sees it.
    pub pairs: [usize; 3],
}

/// Yes and no, said and true.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Confusion {
    /// Said and true.
    pub hits: usize,
    /// Said and not true.
    pub false_alarms: usize,
    /// True and not said.
    pub misses: usize,
}

impl Confusion {
    /// Intersection over union; 1 where there was nothing to find and nothing was said.
    pub fn iou(&self) -> f64 {
        match self.hits + self.false_alarms + self.misses {
            0 => 1.0,
            union => self.hits as f64 / union as f64,
        }
    }
}

/// The truncation distance of the truth in metres: three fine voxels.
pub const TRUNCATION_M: f32 = 0.12;

/// Runs the network over a sample of pictures `width` by `height` pixels and compares. Reads logits back at once: not for the browser.
pub fn loss(
    model: &Ipdrecon,
    sample: &Sample,
    size: [usize; 2],
    options: &LossOptions,
    device: &Device,
) -> Loss {
    let [width, height] = size;
    let shape = [sample.views.len(), 3, height, width];
    let images = Tensor::from_data(TensorData::new(sample.images.clone(), shape), device);
    let planes = model.planes(images, &sample.views);

    let mut sites = all_sites(sample.truth.size[0]);
    let mut above: Option<(Decoded, Vec<i32>)> = None;
    let mut occupancy = [Confusion::default(); 2];
    let mut view_losses = Vec::new();
    let mut level_losses = Vec::new();
    let mut distance_error_m = zero(device);
    let mut counts = [[0; 2]; 3];
    for level in Level::ALL {
        let l = level as usize;
        let plane = &planes[l];
        let [_, _, plane_height, plane_width] = plane.base.dims();
        let pairs = Pairs::find(
            &sites,
            level.voxel_size_m(),
            Vec3::ZERO,
            &sample.views,
            [plane_width, plane_height],
            level.stride(),
        );
        counts[l] = [sites.len(), pairs.len()];
        let fused = model.fuse(level, plane, &pairs.on(device), options.pooling);
        view_losses.push(view_loss(
            &fused.occupancy,
            &pairs,
            sample,
            size,
            level,
            device,
        ));

        let guide = guide_of(model, sample, &sites, level, device);
        let above_here = above.take().map(|(decoded, parent)| {
            let parent = Tensor::<1, Int>::from_data(TensorData::from(parent.as_slice()), device);
            (decoded, parent)
        });
        let above_here = above_here.as_ref().map(|(d, p)| (d, p.clone()));
        let input = model.input(fused.features, above_here, guide);
        let decoded = model.decode(level, input, &sites);
        let known = Known::of(&sample.truth, &sites, l);
        if level == Level::Fine {
            let (loss, error_m) = distance_loss(&decoded.logit, &known, device);
            level_losses.push(loss);
            distance_error_m = error_m;
            break;
        }
        level_losses.push(mean_cross_entropy(
            &decoded.logit,
            &known.occupied,
            &known.rows,
            device,
        ));
        let logits: Vec<f32> = decoded.logit.clone().detach().into_data().iter().collect();
        let said: Vec<bool> = logits.iter().map(|logit| *logit > 0.0).collect();
        occupancy[l] = known.confusion(&said);
        let least = if options.at_least_true {
            known.count()
        } else {
            0
        };
        let keep = likeliest(&logits, &said, least);
        let parents: Vec<IVec3> = keep.iter().map(|&i| sites[i as usize]).collect();
        let all = children(&parents);
        let chosen = nearest_to_one(&all, options.most_sites[l], options.seed ^ l as u64);
        let parent = chosen.iter().map(|&i| keep[i / 8]).collect();
        sites = chosen.iter().map(|&i| all[i]).collect();
        above = Some((decoded, parent));
        if sites.is_empty() {
            break;
        }
    }
    finish(
        view_losses,
        level_losses,
        occupancy,
        distance_error_m,
        counts,
        device,
    )
}

fn finish(
    views: Vec<Tensor<1>>,
    levels: Vec<Tensor<1>>,
    occupancy: [Confusion; 2],
    distance_error_m: Tensor<1>,
    counts: [[usize; 2]; 3],
    device: &Device,
) -> Loss {
    // A level that was not reached, since nothing was occupied above it, costs nothing.
    let part =
        |losses: &[Tensor<1>], i: usize| losses.get(i).cloned().unwrap_or_else(|| zero(device));
    let parts = [
        ("view_coarse", part(&views, 0)),
        ("view_medium", part(&views, 1)),
        ("view_fine", part(&views, 2)),
        ("occupancy_coarse", part(&levels, 0)),
        ("occupancy_medium", part(&levels, 1)),
        ("distance_fine", part(&levels, 2)),
    ];
    let all = views.into_iter().chain(levels);
    let total = all.reduce(|sum, part| sum + part);
    Loss {
        total: total.unwrap_or_else(|| zero(device)),
        parts: parts.map(|(name, part)| (name, part.detach())),
        occupancy,
        distance_error_m,
        sites: counts.map(|[sites, _]| sites),
        pairs: counts.map(|[_, pairs]| pairs),
    }
}

fn zero(device: &Device) -> Tensor<1> {
    Tensor::zeros([1], device)
}

/// Every lattice point of a box, x fastest.
fn all_sites([nx, ny, nz]: [usize; 3]) -> Vec<IVec3> {
    let count = nx * ny * nz;
    let site = |i: usize| {
        IVec3::new(
            (i % nx) as i32,
            (i / nx % ny) as i32,
            (i / (nx * ny)) as i32,
        )
    };
    (0..count).map(site).collect()
}

/// The truth at the sites of a level.
struct Known {
    /// Rows of supervised sites.
    rows: Vec<i32>,
    /// Of those: 1 where occupied.
    occupied: Vec<f32>,
    /// Of those: the signed distance over the truncation distance; fine only.
    tsdf: Vec<f32>,
    /// Of every site: supervised and occupied.
    true_at: Vec<bool>,
    /// Of every site: supervised.
    supervised_at: Vec<bool>,
}

impl Known {
    fn of(truth: &Truth, sites: &[IVec3], level: usize) -> Self {
        let [nx, ny, nz] = truth.size[level];
        let inside = |site: &IVec3| {
            let [x, y, z] = site.to_array().map(|v| v as usize);
            (x < nx && y < ny && z < nz).then(|| x + nx * (y + ny * z))
        };
        let mut known = Self {
            rows: Vec::new(),
            occupied: Vec::new(),
            tsdf: Vec::new(),
            true_at: vec![false; sites.len()],
            supervised_at: vec![false; sites.len()],
        };
        for (row, site) in sites.iter().enumerate() {
            let Some(i) = inside(site).filter(|&i| truth.supervised[level][i]) else {
                continue;
            };
            let occupied = truth.occupied[level][i];
            known.true_at[row] = occupied;
            known.supervised_at[row] = true;
            known.rows.push(row as i32);
            known.occupied.push(if occupied { 1.0 } else { 0.0 });
            if level == Level::Fine as usize {
                known.tsdf.push(truth.tsdf[i]);
            }
        }
        known
    }

    /// How many sites are known to be occupied.
    fn count(&self) -> usize {
        self.true_at.iter().filter(|occupied| **occupied).count()
    }

    fn confusion(&self, said: &[bool]) -> Confusion {
        let mut confusion = Confusion::default();
        for (row, &said) in said.iter().enumerate() {
            match (said, self.true_at[row]) {
                (true, true) => confusion.hits += 1,
                (true, false) if self.supervised_at[row] => confusion.false_alarms += 1,
                (false, true) => confusion.misses += 1,
                _ => {}
            }
        }
        confusion
    }
}

/// Rows of the sites that are said to be occupied; where they are fewer than `least`, of the `least` likeliest. In order.
fn likeliest(logits: &[f32], said: &[bool], least: usize) -> Vec<i32> {
    let found: Vec<i32> = (0..said.len() as i32)
        .filter(|&i| said[i as usize])
        .collect();
    let least = least.min(logits.len());
    if found.len() >= least {
        return found;
    }
    let mut order: Vec<i32> = (0..logits.len() as i32).collect();
    let unlikely = |&i: &i32, &j: &i32| {
        let likelier = logits[j as usize].total_cmp(&logits[i as usize]);
        likelier.then(i.cmp(&j))
    };
    order.select_nth_unstable_by(least - 1, unlikely);
    order.truncate(least);
    order.sort_unstable();
    order
}

fn guide_of(
    model: &Ipdrecon,
    sample: &Sample,
    sites: &[IVec3],
    level: Level,
    device: &Device,
) -> Option<Tensor<2>> {
    if !model.config().guide || sample.guide.is_empty() {
        return None;
    }
    let says = guide_at(sites, level.voxel_size_m(), Vec3::ZERO, &sample.guide);
    let values = says.into_iter().flat_map(Guidance::channels).collect();
    let data = TensorData::new(values, [sites.len(), GUIDE_CHANNELS]);
    Some(Tensor::from_data(data, device))
}

/// Whether a view's measured surface lies within three voxels of the site, for the pairs where something was measured.
fn view_loss(
    logit: &Tensor<1>,
    pairs: &Pairs,
    sample: &Sample,
    [width, height]: [usize; 2],
    level: Level,
    device: &Device,
) -> Tensor<1> {
    let near_m = 3.0 * level.voxel_size_m();
    let (rows, labels) = pairs.truth(&sample.depth_m, [width, height], level.stride(), near_m);
    mean_cross_entropy(logit, &labels, &rows, device)
}

/// Mean over `rows` of `max(x, 0) - x y + ln(1 + e^-|x|)`: cross entropy of the logit `x` with the label `y`.
fn mean_cross_entropy(
    logit: &Tensor<1>,
    labels: &[f32],
    rows: &[i32],
    device: &Device,
) -> Tensor<1> {
    if rows.is_empty() {
        return zero(device);
    }
    let x = logit
        .clone()
        .select(0, Tensor::<1, Int>::from_data(rows, device));
    let y = Tensor::<1>::from_data(labels, device);
    let entropy = x.clone().clamp_min(0.0) - x.clone() * y + x.abs().neg().exp().log1p();
    entropy.mean()
}

/// L1 between `sign(d) ln(1 + |d|)` of what is said and what is true, and the mean error in metres (method 1.9).
fn distance_loss(logit: &Tensor<1>, known: &Known, device: &Device) -> (Tensor<1>, Tensor<1>) {
    if known.rows.is_empty() {
        return (zero(device), zero(device));
    }
    let rows = Tensor::<1, Int>::from_data(known.rows.as_slice(), device);
    let said = tanh(logit.clone().select(0, rows)) * TSDF_SCALE;
    let tsdf = Tensor::<1>::from_data(known.tsdf.as_slice(), device);
    let compressed = |d: Tensor<1>| d.clone().sign() * d.abs().log1p();
    let error = (compressed(said.clone()) - compressed(tsdf.clone()))
        .abs()
        .mean();
    let off = (said.detach().clamp(-1.0, 1.0) - tsdf).abs().mean() * TRUNCATION_M;
    (error, off)
}

/// Indices of the `most` sites nearest to a random one, in order: neighbours stay together, which a 3D convolution wants.
fn nearest_to_one(sites: &[IVec3], most: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sites.len()).collect();
    if sites.len() <= most {
        return order;
    }
    // SplitMix64: any well-mixed number will do.
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    let middle = sites[((z ^ (z >> 31)) % sites.len() as u64) as usize];
    let far = |&i: &usize| ((sites[i] - middle).length_squared(), i);
    order.select_nth_unstable_by_key(most, far);
    order.truncate(most);
    order.sort_unstable();
    order
}
