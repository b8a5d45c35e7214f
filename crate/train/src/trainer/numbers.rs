//! What the losses of several samples say together.

use crate::task::Outcome;
use burn::tensor::Tensor;
use serde_json::Value;

/// Means of what several samples' losses say.
#[derive(Default)]
pub(super) struct Numbers {
    samples: f64,
    sums: Vec<(String, f64)>,
    occupancy: Vec<(&'static str, [usize; 3])>,
}

impl Numbers {
    /// Adds a sample's numbers and gives its loss.
    pub fn add(&mut self, outcome: Outcome) -> Tensor<1> {
        // One reading for all: every reading waits for the device.
        let total = outcome.total.clone().detach();
        let tensors = outcome.parts.iter().map(|(_, tensor)| tensor.clone());
        let all: Vec<Tensor<1>> = std::iter::once(total)
            .chain(tensors)
            .map(Tensor::inner)
            .collect();
        let values = Tensor::cat(all, 0).into_data();
        let names = std::iter::once("loss").chain(outcome.parts.iter().map(|(name, _)| *name));
        for (i, (name, value)) in names.zip(values.iter::<f32>()).enumerate() {
            match self.sums.get_mut(i) {
                Some((_, sum)) => *sum += f64::from(value),
                None => self.sums.push((name.to_owned(), f64::from(value))),
            }
        }
        for (i, (name, counts)) in outcome.occupancy.iter().enumerate() {
            match self.occupancy.get_mut(i) {
                Some((_, sums)) => sums.iter_mut().zip(counts).for_each(|(s, c)| *s += c),
                None => self.occupancy.push((name, *counts)),
            }
        }
        self.samples += 1.0;
        outcome.total
    }

    /// Takes the occupancy of others.
    pub fn with_occupancy(self, other: Self) -> Self {
        Self {
            occupancy: other.occupancy,
            ..self
        }
    }

    /// The mean loss.
    pub fn loss(&self) -> f64 {
        self.sums
            .first()
            .map_or(f64::NAN, |(_, sum)| sum / self.samples)
    }

    /// For the log.
    pub fn fields(&self) -> Vec<(&str, Value)> {
        let sums = self.sums.iter();
        let mut fields: Vec<(&str, Value)> = sums
            .map(|(name, sum)| (name.as_str(), (sum / self.samples).into()))
            .collect();
        for (name, counts) in &self.occupancy {
            let [iou, precision, recall] = scores(*counts);
            let names = occupancy_names(name);
            fields.push((names[0], iou.into()));
            fields.push((names[1], precision.into()));
            fields.push((names[2], recall.into()));
        }
        fields
    }

    /// For the eye.
    pub fn said(&self) -> String {
        let sums = self.sums.iter();
        let mut said: Vec<String> = sums
            .map(|(name, sum)| {
                format!(
                    "{} {:.4}",
                    name.trim_start_matches("loss_"),
                    sum / self.samples
                )
            })
            .collect();
        for (name, counts) in &self.occupancy {
            let [iou, precision, recall] = scores(*counts);
            said.push(format!(
                "{name} IoU {iou:.3} (precision {precision:.3}, recall {recall:.3})"
            ));
        }
        said.join(", ")
    }
}

fn occupancy_names(level: &str) -> [&'static str; 3] {
    match level {
        "coarse" => [
            "occupied_coarse_iou",
            "occupied_coarse_precision",
            "occupied_coarse_recall",
        ],
        _ => [
            "occupied_medium_iou",
            "occupied_medium_precision",
            "occupied_medium_recall",
        ],
    }
}

/// Intersection over union, precision and recall of hits, false alarms and misses; 1 where there was nothing to find.
fn scores([hits, false_alarms, misses]: [usize; 3]) -> [f64; 3] {
    let share = |of: usize| {
        if of == 0 {
            1.0
        } else {
            hits as f64 / of as f64
        }
    };
    [
        share(hits + false_alarms + misses),
        share(hits + false_alarms),
        share(hits + misses),
    ]
}
