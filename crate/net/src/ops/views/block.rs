//! Some pairs all the way from planes to tokens, and back.

use std::ops::Range;

use super::super::attention::flex::Scratch;
use super::super::functions::exp;
use super::super::rows::flex::Slices;
use super::super::wide::wide;
use super::ViewsShape;
use super::layer::{Kept, Layer, Room};
use super::linear::Linear;

/// Where all weights lie.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub lift: Option<Linear>,
    pub embed: Linear,
    pub layers: Vec<Layer>,
    /// Numbers in all.
    pub size: usize,
}

impl Layout {
    pub fn new(shape: ViewsShape) -> Self {
        let c = shape.channels;
        let mut size = 0;
        let lift = shape.lift.then(|| Linear::take(&mut size, c, c));
        let embed = Linear::take(&mut size, c + shape.extra, c);
        let layers = (0..shape.layers)
            .map(|_| Layer::take(&mut size, c))
            .collect();
        Self {
            lift,
            embed,
            layers,
            size,
        }
    }
}

/// What all blocks read.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a> {
    pub shape: ViewsShape,
    pub layout: &'a Layout,
    pub base: &'a [f32],
    pub hidden: &'a [f32],
    pub extra: &'a [f32],
    pub weights: &'a [f32],
    pub at: Slices<'a>,
}

/// A thread's room for a block.
#[derive(Debug, Default)]
pub(super) struct Block {
    hidden: Vec<f32>,
    active: Vec<f32>,
    input: Vec<f32>,
    input_grad: Vec<f32>,
    kept: Vec<Kept>,
    room: Room,
    scratch: Scratch,
}

/// Gradients of a block's rows: of what was sampled of base and hidden planes `[rows, C]`, and of the further numbers.
pub(super) struct RowGradients<'a> {
    pub base: &'a mut [f32],
    pub hidden: &'a mut [f32],
    pub extra: &'a mut [f32],
}

impl Block {
    /// Fills `x` with the tokens of the segments between `offsets`.
    pub fn forward(&mut self, from: Sources<'_>, offsets: &[i32], x: &mut [f32]) {
        let pairs = pairs(offsets);
        let (c, rows) = (from.shape.channels, pairs.len());
        // Voxels that no view sees.
        if rows == 0 {
            return;
        }
        let wide = c + from.shape.extra;
        self.input.resize(rows * wide, 0.0);
        gather(from, pairs.start, &mut self.input);
        if let Some(lift) = &from.layout.lift {
            self.hidden.resize(rows * c, 0.0);
            self.active.resize(rows * c, 0.0);
            activate(from, pairs.start, &mut self.hidden, &mut self.active);
            let input = (self.input.as_mut_slice(), wide);
            lift.add(from.weights, rows, (&self.active, c), input);
        }
        from.layout
            .embed
            .set(from.weights, rows, (&self.input, wide), x);
        self.kept
            .resize_with(from.layout.layers.len(), Kept::default);
        for (layer, kept) in from.layout.layers.iter().zip(&mut self.kept) {
            layer.forward(
                from.weights,
                from.shape,
                offsets,
                x,
                kept,
                &mut self.scratch,
            );
        }
    }

    /// After [`Block::forward`] of the same segments: turns the gradient of the tokens, which is overwritten, into those of
    /// the rows, and adds to the weights'.
    pub fn backward(
        &mut self,
        from: Sources<'_>,
        offsets: &[i32],
        dx: &mut [f32],
        to: RowGradients<'_>,
        grads: &mut [f32],
    ) {
        let (c, rows) = (from.shape.channels, pairs(offsets).len());
        if rows == 0 {
            return;
        }
        let wide = c + from.shape.extra;
        for (layer, kept) in from.layout.layers.iter().zip(&self.kept).rev() {
            let room = (&mut self.room, &mut self.scratch);
            layer.backward(from.weights, from.shape, offsets, dx, kept, room, grads);
        }
        let embed = &from.layout.embed;
        embed.add_gradients(grads, rows, (&self.input, wide), (dx, c));
        self.input_grad.resize(rows * wide, 0.0);
        embed.input_gradient(from.weights, rows, (dx, c), &mut self.input_grad);
        let both = to
            .base
            .chunks_exact_mut(c)
            .zip(to.extra.chunks_exact_mut(from.shape.extra));
        for ((base, extra), input) in both.zip(self.input_grad.chunks_exact(wide)) {
            base.copy_from_slice(&input[..c]);
            extra.copy_from_slice(&input[c..]);
        }
        if let Some(lift) = &from.layout.lift {
            lift.add_gradients(grads, rows, (&self.active, c), (to.base, c));
            lift.input_gradient(from.weights, rows, (to.base, c), to.hidden);
            activation_gradient(&self.hidden, to.hidden);
        }
    }
}

/// The pairs of the segments between `offsets`.
fn pairs(offsets: &[i32]) -> Range<usize> {
    let [first, .., end] = offsets else {
        return 0..0;
    };
    *first as usize..*end as usize
}

wide! {
    /// Base features and further numbers of the pairs from `first` on.
    fn gather(from: Sources<'_>, first: usize, input: &mut [f32]) {
        let (c, extra) = (from.shape.channels, from.shape.extra);
        for (i, input) in input.chunks_exact_mut(c + extra).enumerate() {
            let (sampled, further) = input.split_at_mut(c);
            from.at.read(first + i, from.base, sampled);
            further.copy_from_slice(&from.extra[(first + i) * extra..][..extra]);
        }
    }
}

wide! {
    /// Hidden features of the pairs from `first` on, and their `silu(x) = x / (1 + e^-x)`.
    fn activate(from: Sources<'_>, first: usize, hidden: &mut [f32], active: &mut [f32]) {
        let c = from.shape.channels;
        for (i, hidden) in hidden.chunks_exact_mut(c).enumerate() {
            from.at.read(first + i, from.hidden, hidden);
        }
        for (active, x) in active.iter_mut().zip(hidden.iter()) {
            *active = x / (1.0 + exp(-x));
        }
    }
}

wide! {
    /// `silu'(x) = s (1 + x (1 - s))` with `s = 1 / (1 + e^-x)`.
    fn activation_gradient(hidden: &[f32], grads: &mut [f32]) {
        for (grad, x) in grads.iter_mut().zip(hidden) {
            let s = 1.0 / (1.0 + exp(-x));
            *grad *= s * (1.0 + x * (1.0 - s));
        }
    }
}
