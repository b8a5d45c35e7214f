//! A network with inputs of a stated size, and the times of its parts.

use burn::backend::ExecutionError;
use burn::tensor::{Device, Tensor, TensorData};
use glam::{IVec3, Vec3};
use net::{
    Ipdrecon, Level, View,
    fusion::{Pairs, Pooling},
    model::Decoded,
    planes::Plane,
};
use recon::fused_at_once;

use crate::input::{around, cube, image, many, numbers, parent};
use crate::time::{Times, median, now_ms, timed, wait};
use crate::work::{self, Work};

/// The device did not give a result back.
#[derive(Debug, thiserror::Error)]
#[error(
    "expected a result from the device, found: {0}; it may have too little memory for so many views: ask for fewer"
)]
pub struct Unread(String);

impl From<ExecutionError> for Unread {
    fn from(error: ExecutionError) -> Self {
        Self(error.to_string())
    }
}

/// The stages of a piece, in order: pairs of all levels, then fusion and 3D network of each level.
pub const STAGES: [&str; 7] = [
    "pairs of voxel and view",
    "fusion, 16 cm",
    "3D network, 16 cm",
    "fusion, 8 cm",
    "3D network, 8 cm",
    "fusion, 4 cm",
    "3D network, 4 cm",
];

/// What is measured.
pub struct Subject<'a> {
    /// The network.
    pub network: &'a Ipdrecon,
    /// Where it computes.
    pub device: &'a Device,
    /// Pictures' width and height.
    pub size: (u32, u32),
    /// Fine voxels along the piece's edge, a multiple of 4.
    pub edge: i32,
    /// Warm runs of each part.
    pub runs: usize,
}

/// What a piece took.
pub struct PieceTimes {
    /// The whole, waited for once.
    pub whole: Times,
    /// Warm milliseconds of each of [`STAGES`], each waited for; together more than the whole.
    pub stages_ms: [f64; STAGES.len()],
    /// What each of [`STAGES`] computes and moves; nothing for the pairs.
    pub stages: [Work; STAGES.len()],
    /// Pairs of a voxel and a view that sees it, over all levels.
    pub pairs: usize,
}

impl Subject<'_> {
    /// Backbone and pyramid of one picture: what does not know the camera.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn pyramid(&self) -> Result<Times, Unread> {
        let images = image(self.size, self.device);
        timed(self.runs, async || {
            // All is asked for before anything is waited for, and a queue ends with what came last.
            let [_coarse, _medium, fine] = self.network.pyramid(images.clone());
            wait(&fine).await?;
            Ok(())
        })
        .await
    }

    /// The numbers that [`Subject::pyramid`] computes, coarse to fine, each level row by row.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn pyramid_numbers(&self) -> Result<[Vec<f32>; 3], Unread> {
        let mut all = [const { Vec::new() }; 3];
        let planes = self.network.pyramid(image(self.size, self.device));
        for (all, plane) in all.iter_mut().zip(planes) {
            *all = plane.into_data_async().await?.iter::<f32>().collect();
        }
        Ok(all)
    }

    /// All planes of one picture.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn picture(&self) -> Result<Times, Unread> {
        let images = image(self.size, self.device);
        let views = around(self.size, 1, self.edge);
        timed(self.runs, async || {
            let [_coarse, _medium, fine] = self.network.planes(images.clone(), &views);
            wait(fine.hidden.as_ref().unwrap_or(&fine.base)).await?;
            Ok(())
        })
        .await
    }

    /// A cube of the room with every voxel occupied, as `count` views see it.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn piece(&self, count: usize) -> Result<PieceTimes, Unread> {
        let piece = Piece::new(self, count);
        let whole = timed(self.runs, async || {
            let decoded = piece.run(self.network, &mut None).await?;
            wait(&decoded.logit).await?;
            Ok::<_, Unread>(())
        })
        .await?;
        let mut found = [const { Vec::new() }; STAGES.len()];
        for _ in 0..whole.runs {
            let mut spent = Some([0.0; STAGES.len()]);
            piece.run(self.network, &mut spent).await?;
            for (found, spent) in found.iter_mut().zip(spent.unwrap_or_default()) {
                found.push(spent);
            }
        }
        let (stages, pairs) = piece.work(self.network);
        Ok(PieceTimes {
            whole,
            stages_ms: found.map(|mut times| median(&mut times)),
            stages,
            pairs,
        })
    }

    /// The linear recurrence over the fine plane of one picture, both ways of a scan along rows.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn recurrence(&self) -> Result<Times, Unread> {
        let [width, height] =
            net::planes::plane_size(self.size.0 as usize, self.size.1 as usize, Level::Fine);
        let lanes = [self.network.config().planes[2] * height, width];
        let (a, x) = (
            numbers(lanes, self.device) + 0.4,
            numbers(lanes, self.device),
        );
        timed(self.runs, async || {
            for reverse in [false, true] {
                wait(&net::ops::linrec::linrec(a.clone(), x.clone(), reverse)).await?;
            }
            Ok(())
        })
        .await
    }

    /// Attention of one block of coarse voxels that `views` views see each.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn attention(&self, voxels: usize, views: usize) -> Result<Times, Unread> {
        let offsets: Vec<i32> = (0..=voxels as i32).map(|n| n * views as i32).collect();
        let segments = net::ops::segments::Segments::new(&offsets, self.device);
        let x = numbers(
            [segments.rows, self.network.config().planes[0]],
            self.device,
        );
        let heads = net::fusion::HEADS;
        timed(self.runs, async || {
            let [query, key, value] = [(); 3].map(|()| x.clone());
            wait(&net::ops::attention::attention(
                query, key, value, &segments, heads,
            ))
            .await?;
            Ok(())
        })
        .await
    }
}

/// What a piece is computed from.
struct Piece {
    views: Vec<View>,
    planes: [Plane; 3],
    sites: [Vec<IVec3>; 3],
    parents: [Tensor<1, burn::tensor::Int>; 3],
}

impl Piece {
    fn new(subject: &Subject<'_>, count: usize) -> Self {
        let images = image(subject.size, subject.device);
        let one = around(subject.size, 1, subject.edge);
        let planes = subject.network.planes(images, &one);
        let edges = Level::ALL.map(|level| subject.edge >> (2 - level as i32));
        let sites = edges.map(cube);
        let parents = [0, 1, 2].map(|level| {
            let rows = sites[level].iter().map(|site| parent(*site, edges[level]));
            let rows: Vec<i32> = rows.collect();
            Tensor::from_data(TensorData::from(rows.as_slice()), subject.device)
        });
        Self {
            views: around(subject.size, count, subject.edge),
            planes: planes.map(|plane| many(&plane, count)),
            sites,
            parents,
        }
    }

    fn pairs(&self, level: Level, sites: &[IVec3]) -> Pairs {
        let [_, _, height, width] = self.planes[level as usize].base.dims();
        let (voxel_m, stride) = (level.voxel_size_m(), level.stride());
        Pairs::find(
            sites,
            voxel_m,
            Vec3::ZERO,
            &self.views,
            [width, height],
            stride,
        )
    }

    /// All levels. Where `spent` is there, each stage is waited for and its milliseconds are added.
    async fn run(
        &self,
        network: &Ipdrecon,
        spent: &mut Option<[f64; STAGES.len()]>,
    ) -> Result<Decoded, Unread> {
        let [coarse, medium, fine] = Level::ALL;
        let above = self.level(network, coarse, None, spent).await?;
        let above = self.level(network, medium, Some(above), spent).await?;
        self.level(network, fine, Some(above), spent).await
    }

    async fn level(
        &self,
        network: &Ipdrecon,
        level: Level,
        above: Option<Decoded>,
        spent: &mut Option<[f64; STAGES.len()]>,
    ) -> Result<Decoded, Unread> {
        let at = level as usize;
        let (plane, sites) = (&self.planes[at], &self.sites[at]);
        let device = plane.base.device();
        let mut fused = Vec::new();
        for block in fused_at_once(0..sites.len(), self.views.len()) {
            let start = now_ms();
            let pairs = self.pairs(level, &sites[block]);
            let found = now_ms();
            let one = network.fuse(level, plane, &pairs.on(&device), Pooling::Softmax);
            if let Some(spent) = spent {
                wait(&one.features).await?;
                spent[0] += found - start;
                spent[1 + 2 * at] += now_ms() - found;
            }
            fused.push(one.features);
        }
        let start = now_ms();
        let from = above
            .as_ref()
            .map(|above| (above, self.parents[at].clone()));
        let input = network.input(Tensor::cat(fused, 0), from, None);
        let decoded = network.decode(level, input, sites);
        if let Some(spent) = spent {
            wait(&decoded.logit).await?;
            spent[2 + 2 * at] += now_ms() - start;
        }
        Ok(decoded)
    }

    /// What the stages compute and move, and the number of pairs.
    fn work(&self, network: &Ipdrecon) -> ([Work; STAGES.len()], usize) {
        let mut stages = [Work::default(); STAGES.len()];
        let mut pairs = 0;
        for level in Level::ALL {
            let at = level as usize;
            let edge = (self.sites[at].len() as f64).cbrt().round() as usize;
            let mut seen = Vec::new();
            for block in fused_at_once(0..self.sites[at].len(), self.views.len()) {
                let found = self.pairs(level, &self.sites[at][block]);
                seen.extend(
                    found
                        .offsets
                        .windows(2)
                        .map(|ends| (ends[1] - ends[0]) as usize),
                );
            }
            pairs += seen.iter().sum::<usize>();
            stages[1 + 2 * at] = work::fusion(network.config(), level, seen.into_iter());
            stages[2 + 2 * at] = work::decoding(network.config(), level, edge);
        }
        (stages, pairs)
    }
}
