//! A layer of the encoder over a block of pairs.

use super::super::attention::flex::{self as attention, Table};
use super::super::wide::wide;
use super::ViewsShape;
use super::linear::Linear;
use super::norm::{self, Norm};

/// Where a layer's weights lie.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    norm_attention: Norm,
    query_key_value: Linear,
    output: Linear,
    norm_mlp: Norm,
    mlp_in: Linear,
    mlp_out: Linear,
}

/// What the forward pass of a layer leaves for the backward pass, by rows.
#[derive(Debug, Default)]
pub(super) struct Kept {
    normed: [Vec<f32>; 2],
    by: [Vec<f32>; 2],
    read: [Vec<f32>; 2],
    joint: Vec<f32>,
    heard: Vec<f32>,
    log_sum: Vec<f32>,
    inner: Vec<f32>,
}

/// Room for a layer's backward pass.
#[derive(Debug, Default)]
pub(super) struct Room {
    narrow: Vec<f32>,
    wide: Vec<f32>,
}

impl Kept {
    fn fit(&mut self, rows: usize, channels: usize, heads: usize) {
        let narrow = rows * channels;
        for list in self.normed.iter_mut().chain(&mut self.read) {
            list.resize(narrow, 0.0);
        }
        for list in &mut self.by {
            list.resize(rows, 0.0);
        }
        self.joint.resize(3 * narrow, 0.0);
        self.inner.resize(2 * narrow, 0.0);
        self.log_sum.resize(rows * heads, 0.0);
        self.heard.resize(narrow, 0.0);
    }
}

impl Layer {
    /// The layer whose weights begin at `start`, which moves to their end.
    pub fn take(start: &mut usize, channels: usize) -> Self {
        Self {
            norm_attention: Norm::take(start, channels),
            query_key_value: Linear::take(start, channels, 3 * channels),
            output: Linear::take(start, channels, channels),
            norm_mlp: Norm::take(start, channels),
            mlp_in: Linear::take(start, channels, 2 * channels),
            mlp_out: Linear::take(start, 2 * channels, channels),
        }
    }

    /// Takes the rows of the segments between `offsets` through the layer, in place.
    pub fn forward(
        &self,
        weights: &[f32],
        shape: ViewsShape,
        offsets: &[i32],
        x: &mut [f32],
        kept: &mut Kept,
        scratch: &mut attention::Scratch,
    ) {
        let (c, heads) = (shape.channels, shape.heads);
        let rows = x.len() / c;
        kept.fit(rows, c, heads);
        let Kept {
            normed: [n1, n2],
            by: [r1, r2],
            read: [y1, y2],
            joint,
            heard,
            log_sum,
            inner,
        } = kept;
        norm::forward(&self.norm_attention, weights, x, n1, r1, y1);
        self.query_key_value.set(weights, rows, (y1, c), joint);
        attention::forward(table(joint, shape), offsets, scratch, heard, log_sum);
        self.output.add(weights, rows, (heard, c), (x, c));
        norm::forward(&self.norm_mlp, weights, x, n2, r2, y2);
        self.mlp_in.set(weights, rows, (y2, c), inner);
        cut(inner);
        self.mlp_out.add(weights, rows, (inner, 2 * c), (x, c));
    }

    /// Turns the gradient of what the layer gave into that of what it was given, in place, and adds to the weights'.
    #[allow(clippy::too_many_arguments)]
    pub fn backward(
        &self,
        weights: &[f32],
        shape: ViewsShape,
        offsets: &[i32],
        dx: &mut [f32],
        kept: &Kept,
        (room, scratch): (&mut Room, &mut attention::Scratch),
        grads: &mut [f32],
    ) {
        let (c, heads) = (shape.channels, shape.heads);
        let rows = dx.len() / c;
        room.narrow.resize(rows * c, 0.0);
        room.wide.resize(rows * 3 * c, 0.0);
        let Room { narrow, wide } = room;
        let [n1, n2] = &kept.normed;
        let [r1, r2] = &kept.by;
        let [y1, y2] = &kept.read;

        let inner = &mut wide[..rows * 2 * c];
        self.mlp_out
            .add_gradients(grads, rows, (&kept.inner, 2 * c), (dx, c));
        self.mlp_out.input_gradient(weights, rows, (dx, c), inner);
        cut_gradient(&kept.inner, inner);
        self.mlp_in
            .add_gradients(grads, rows, (y2, c), (inner, 2 * c));
        self.mlp_in
            .input_gradient(weights, rows, (inner, 2 * c), narrow);
        norm::backward(&self.norm_mlp, weights, narrow, n2, r2, dx, grads);

        self.output
            .add_gradients(grads, rows, (&kept.heard, c), (dx, c));
        self.output.input_gradient(weights, rows, (dx, c), narrow);
        wide.fill(0.0);
        let results = [kept.heard.as_slice(), narrow.as_slice()];
        let log_sum = &kept.log_sum[..rows * heads];
        attention::backward(
            table(&kept.joint, shape),
            offsets,
            scratch,
            results,
            log_sum,
            wide,
        );
        self.query_key_value
            .add_gradients(grads, rows, (y1, c), (wide, 3 * c));
        self.query_key_value
            .input_gradient(weights, rows, (wide, 3 * c), narrow);
        norm::backward(&self.norm_attention, weights, narrow, n1, r1, dx, grads);
    }
}

/// Query, key and value that lie one after the other in each row.
fn table(joint: &[f32], shape: ViewsShape) -> Table<'_> {
    let c = shape.channels;
    Table {
        parts: [joint, &joint[c..], &joint[2 * c..]],
        stride: 3 * c,
        channels: c,
        heads: shape.heads,
    }
}

wide! {
    /// `max(x, 0)`.
    fn cut(values: &mut [f32]) {
        for value in values {
            *value = if *value > 0.0 { *value } else { 0.0 };
        }
    }
}

wide! {
    /// The gradient passes where something came through.
    fn cut_gradient(values: &[f32], grads: &mut [f32]) {
        for (grad, value) in grads.iter_mut().zip(values) {
            *grad = if *value > 0.0 { *grad } else { 0.0 };
        }
    }
}
