//! Digests of large results: shape, sums, every k-th number. What `digest` in tests/reference writes.

use burn::tensor::Tensor;
use serde_json::Value;

use super::{devices::values, relative_error};

/// A golden file of digests by name.
pub struct Digests {
    file: Value,
    tolerance: f32,
}

impl Digests {
    /// Of a file's text.
    pub fn read(text: &str, tolerance: f32) -> Self {
        let file = serde_json::from_str(text).unwrap();
        Self { file, tolerance }
    }

    /// Shape, every k-th number and the sum of all must be the reference's within the tolerance, as a share of the largest.
    pub async fn assert<const D: usize>(&self, name: &str, found: Tensor<D>) {
        let dims = found.dims();
        self.assert_numbers(name, &dims, &values(found).await);
    }

    /// The same for numbers that are no tensor.
    pub fn assert_numbers(&self, name: &str, dims: &[usize], found: &[f32]) {
        let expected = &self.file[name];
        assert!(expected.is_object(), "the reference has no {name}");
        let numbers = |key: &str| -> Vec<f32> {
            let array = expected[key].as_array().unwrap();
            array.iter().map(|v| v.as_f64().unwrap() as f32).collect()
        };
        let shape: Vec<f32> = dims.iter().map(|&d| d as f32).collect();
        assert_eq!(shape, numbers("shape"), "{name}");
        let every = expected["every"].as_u64().unwrap() as usize;
        let some: Vec<f32> = found.iter().step_by(every).copied().collect();
        let off = relative_error(&some, &numbers("values"));
        assert!(off < self.tolerance, "{name}: {off:e}");
        let sum: f64 = found.iter().map(|v| f64::from(*v)).sum();
        let number = |key: &str| expected[key].as_f64().unwrap();
        let off = (sum - number("sum")).abs() / number("magnitude");
        assert!(off < f64::from(self.tolerance), "sum of {name}: {off:e}");
    }
}
