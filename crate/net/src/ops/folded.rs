//! Convolution with what follows it, as the processor does it without gradients.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::{Device, Tensor};
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::lines::{Lines, add_up};
use super::padded::Layout;
use super::{flex, on_processor};

/// Whether [`folded`] runs on `device`.
pub fn runs_on(device: &Device) -> bool {
    !device.is_autodiff() && on_processor(device)
}

/// Convolves `x` `[V, C, H, W]` with `weight` `[C', C, K, K]`, or each channel with its own of `[C, 1, K, K]`, `K` odd; then
/// takes `scale` `[C']` times that plus `shift` `[C']`, then, where asked, a ReLU: a bias or batch normalisation by the running
/// statistics costs nothing. Output pixel `i` is centred on input pixel `stride * i`, zeros lie outside;
/// `[V, C', ceil(H / stride), ceil(W / stride)]`.
pub fn folded(
    x: Tensor<4>,
    weight: Tensor<4>,
    [scale, shift]: [Tensor<1>; 2],
    stride: usize,
    relu: bool,
) -> Tensor<4> {
    Tensor::from_dispatch(<Dispatch as Folded>::folded(
        x.into_dispatch(),
        weight.into_dispatch(),
        scale.into_dispatch(),
        shift.into_dispatch(),
        stride,
        relu,
    ))
}

/// The one backend that runs [`folded`].
#[backend_extension(Flex)]
pub trait Folded: Backend {
    /// See [`folded`].
    fn folded(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        scale: FloatTensor<Self>,
        shift: FloatTensor<Self>,
        stride: usize,
        relu: bool,
    ) -> FloatTensor<Self>;
}

/// Pixels of a piece of a plane at least: as many as fill a tile's registers several times.
const PIECE: usize = 192;
/// Pieces of a plane at most.
const PIECES: usize = 64;

/// What all pixels have in common.
struct Layer<'a> {
    /// `[C', T]`, scaled.
    weights: Vec<f32>,
    shift: &'a [f32],
    least: f32,
    views: usize,
    /// Of the input.
    channels: usize,
}

impl Layer<'_> {
    /// Weights as `[T, C']`, so that those of neighbouring lines lie together.
    fn turned(&self) -> Vec<f32> {
        let terms = self.weights.len() / self.shift.len();
        let term = |t: usize| self.weights[t..].iter().step_by(terms);
        (0..terms).flat_map(term).copied().collect()
    }

    /// Each pixel by itself.
    fn pointwise(&self, x: &[f32], pixels: usize) -> Vec<f32> {
        let (weights, outputs) = (self.turned(), self.shift.len());
        let offsets: Vec<usize> = (0..self.channels).map(|c| c * pixels).collect();
        let mut out = vec![0.0; self.views * outputs * pixels];
        let length = PIECE.max(pixels.div_ceil(PIECES).next_multiple_of(PIECE));
        let of_view = pixels.div_ceil(length);
        flex::pieces(&mut out, outputs, pixels, length)
            .into_par_iter()
            .enumerate()
            .for_each(|(piece, out)| {
                let first = piece / of_view * self.channels * pixels;
                self.add_up(
                    &x[first + piece % of_view * length..],
                    &offsets,
                    &weights,
                    out,
                );
            });
        out
    }

    /// All channels to all.
    fn dense(&self, x: &[f32], layout: &Layout) -> Vec<f32> {
        let (weights, outputs) = (self.turned(), self.shift.len());
        let [height, width] = layout.out();
        let planes = self.padded(x, layout);
        let tap = |channel: usize| move |tap: usize| channel * layout.len() + layout.offset(tap);
        let offsets: Vec<usize> = (0..self.channels)
            .flat_map(|channel| (0..layout.taps()).map(tap(channel)))
            .collect();
        let mut out = vec![0.0; self.views * outputs * height * width];
        flex::pieces(&mut out, outputs, height * width, width)
            .into_par_iter()
            .enumerate()
            .for_each(|(line, out)| {
                let first = line / height * self.channels * layout.len();
                let from = &planes[first + line % height * layout.columns..];
                self.add_up(from, &offsets, &weights, out);
            });
        out
    }

    /// Every channel to its own.
    fn depthwise(&self, x: &[f32], layout: &Layout) -> Vec<f32> {
        let taps = layout.taps();
        let [height, width] = layout.out();
        let offsets: Vec<usize> = (0..taps).map(|tap| layout.offset(tap)).collect();
        let mut out = vec![0.0; self.views * self.channels * height * width];
        out.par_chunks_mut(height * width)
            .zip(x.par_chunks(layout.pixels()))
            .enumerate()
            .for_each_init(
                || vec![0.0; layout.len()],
                |parts, (plane, (out, x))| {
                    layout.deal(x, parts);
                    let channel = plane % self.channels;
                    for (y, out) in out.chunks_exact_mut(width).enumerate() {
                        add_up(Lines {
                            from: &parts[y * layout.columns..],
                            offsets: &offsets,
                            weights: &self.weights[channel * taps..][..taps],
                            start: &self.shift[channel..][..1],
                            least: self.least,
                            out: vec![out],
                        });
                    }
                },
            );
        out
    }

    /// All planes, padded.
    fn padded(&self, x: &[f32], layout: &Layout) -> Vec<f32> {
        let mut planes = vec![0.0; self.views * self.channels * layout.len()];
        planes
            .par_chunks_mut(layout.len())
            .zip(x.par_chunks(layout.pixels()))
            .for_each(|(parts, x)| layout.deal(x, parts));
        planes
    }

    fn add_up(&self, from: &[f32], offsets: &[usize], weights: &[f32], out: Vec<&mut [f32]>) {
        add_up(Lines {
            from,
            offsets,
            weights,
            start: self.shift,
            least: self.least,
            out,
        });
    }
}

impl Folded for Flex {
    fn folded(
        x: FlexTensor,
        weight: FlexTensor,
        scale: FlexTensor,
        shift: FlexTensor,
        stride: usize,
        relu: bool,
    ) -> FlexTensor {
        let [views, channels, height, width] = x.shape().dims();
        let [outputs, inputs, kernel, _] = weight.shape().dims();
        let apart = inputs == 1 && outputs == channels;
        assert!(apart || inputs == channels, "groups of channels");
        let (x, weight) = (flex::read(x), flex::read(weight));
        let (scale, shift) = (flex::read(scale), flex::read(shift));
        let of_output = weight.chunks_exact(inputs * kernel * kernel).zip(&*scale);
        let layer = Layer {
            weights: of_output
                .flat_map(|(weights, scale)| weights.iter().map(move |weight| scale * weight))
                .collect(),
            shift: &shift,
            least: if relu { 0.0 } else { f32::NEG_INFINITY },
            views,
            channels,
        };
        let layout = Layout::new(height, width, kernel, stride);
        let [out_height, out_width] = layout.out();
        let out = if apart {
            layer.depthwise(&x, &layout)
        } else if kernel == 1 && stride == 1 {
            layer.pointwise(&x, height * width)
        } else {
            layer.dense(&x, &layout)
        };
        flex::tensor(out, [views, outputs, out_height, out_width].into())
    }
}
