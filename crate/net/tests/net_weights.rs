//! Weights as files: what is written comes back, and a bad file says what is wrong with it.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::tiny;
use net::weights::{Precision, WeightsError, config, load, save};
use net::{Ipdrecon, NetConfig, named};

fn model(config: &NetConfig) -> Ipdrecon {
    common::filled(Ipdrecon::new(config, &Device::flex()))
}

/// The bytes with a text of the header replaced by another of the same length.
fn edited(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
    let mut bytes = bytes.to_vec();
    bytes[at.expect("the text is in the header")..][..to.len()].copy_from_slice(to.as_bytes());
    bytes
}

#[test]
fn numbers_and_configuration_come_back() {
    let model = model(&tiny());
    let bytes = save(&model, Precision::F32).unwrap();
    let back = load(&bytes, &Device::flex()).unwrap();
    assert_eq!(back.config(), &tiny());
    let (before, after) = (named::tensors(&model), named::tensors(&back));
    assert!(before.len() > 300, "{} tensors", before.len());
    for ((name, before), (other, after)) in before.iter().zip(&after) {
        assert_eq!(name, other);
        assert_eq!(before.as_bytes(), after.as_bytes(), "{name}");
    }
}

#[test]
fn half_precision_halves_the_file_and_keeps_three_digits() {
    let model = model(&tiny());
    let whole = save(&model, Precision::F32).unwrap().len();
    let bytes = save(&model, Precision::F16).unwrap();
    assert!(bytes.len() < whole * 6 / 10, "{} of {whole}", bytes.len());
    let back = load(&bytes, &Device::flex()).unwrap();
    for ((name, before), (_, after)) in named::tensors(&model).iter().zip(&named::tensors(&back)) {
        for (a, b) in before.iter::<f32>().zip(after.iter::<f32>()) {
            assert!((a - b).abs() <= 1e-3 * a.abs().max(1e-3), "{name}: {a} {b}");
        }
    }
}

#[test]
fn a_file_cut_short_says_so() {
    let bytes = save(&model(&tiny()), Precision::F16).unwrap();
    for kept in [0, 5, 100, bytes.len() / 2, bytes.len() - 1] {
        let error = load(&bytes[..kept], &Device::flex()).unwrap_err();
        assert!(
            matches!(error, WeightsError::Format { .. }),
            "{kept}: {error}"
        );
        let text = error.to_string();
        assert!(
            text.contains("cut short") && text.contains(&format!("{kept} bytes")),
            "{text}"
        );
    }
}

#[test]
fn weights_of_another_version_program_or_shape_say_so() {
    let bytes = save(&model(&tiny()), Precision::F16).unwrap();
    let device = Device::flex();

    let newer = edited(
        &bytes,
        r#""ipdrecon.version":"1""#,
        r#""ipdrecon.version":"2""#,
    );
    let error = load(&newer, &device).unwrap_err();
    assert!(
        matches!(&error, WeightsError::Version { found } if found == "2"),
        "{error}"
    );

    let foreign = edited(&bytes, "ipdrecon.config", "somethingsother");
    let error = load(&foreign, &device).unwrap_err();
    assert!(matches!(error, WeightsError::NotOurs), "{error}");

    // Wider planes in the configuration than in the tensors.
    let wider = edited(&bytes, r#"\"unet\":[4,"#, r#"\"unet\":[5,"#);
    let error = load(&wider, &device).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, WeightsError::Shape { .. }), "{text}");
    assert!(
        text.contains("decoders") && text.contains("expected"),
        "{text}"
    );

    // A switch that is off in the configuration while its tensors are there.
    let fewer = edited(&bytes, r#"\"acm\":true"#, r#"\"acm\": !!!"#);
    let error = load(&fewer, &device).unwrap_err();
    assert!(matches!(error, WeightsError::Config(_)), "{error}");

    let impossible = edited(&bytes, r#"\"pyramid\":16"#, r#"\"pyramid\":17"#);
    let error = load(&impossible, &device).unwrap_err();
    assert!(matches!(error, WeightsError::Impossible(_)), "{error}");
    assert_eq!(config(&bytes).unwrap(), tiny());
}

#[test]
fn weights_that_diverged_are_neither_written_nor_read() {
    let broken = named::replace(model(&tiny()), |path, shape| {
        path.ends_with("head.bias")
            .then(|| vec![f32::NAN; shape.iter().product()])
    });
    let error = save(&broken, Precision::F32).unwrap_err();
    assert!(error.to_string().contains("diverged"), "{error}");
}
