//! Golden files of tests/reference/net_fusion.py.

use serde_json::Value;

use super::relative_error;

/// Part of the golden file by its path, such as `fusion/full`.
pub fn part<'a>(file: &'a Value, path: &str) -> &'a Value {
    let found = path.split('/').fold(file, |value, key| &value[key]);
    assert!(!found.is_null(), "nothing at {path} of the golden file");
    found
}

/// Numbers of a golden list.
pub fn list(value: &Value) -> Vec<f32> {
    let values = value.as_array().unwrap().iter();
    values.map(|v| v.as_f64().unwrap() as f32).collect()
}

/// Each `step`-th number and the sum of all are those of the file.
pub fn check(found: &[f32], expected: &Value, tolerance: f32, what: &str) {
    let step = expected["step"].as_u64().unwrap() as usize;
    let spread: Vec<f32> = found.iter().step_by(step).copied().collect();
    let error = relative_error(&spread, &list(&expected["values"]));
    assert!(error < tolerance, "{what}: relative error {error}");
    let sum: f64 = found.iter().map(|v| f64::from(*v)).sum();
    let [expected_sum, size] = ["sum", "size"].map(|key| expected[key].as_f64().unwrap());
    let off = (sum - expected_sum).abs() / size;
    assert!(
        off < f64::from(tolerance),
        "{what}: sum {sum}, expected {expected_sum}"
    );
}

/// A gradient is the slope that was found by differences.
pub fn check_slopes(gradient: &[f32], expected: &Value, tolerance: f32, what: &str) {
    let at = expected["at"].as_array().unwrap().iter();
    let found: Vec<f32> = at.map(|i| gradient[i.as_u64().unwrap() as usize]).collect();
    let error = relative_error(&found, &list(&expected["values"]));
    assert!(error < tolerance, "{what}: relative error {error}");
}
