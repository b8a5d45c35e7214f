//! Weights of VoRTX's own code (PyTorch with torchsparse 1.4) as those of this network with all of its switches off.

use burn::tensor::Device;

use crate::{Ipdrecon, NetConfig, named};

/// Why a file of tensors is not VoRTX.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A tensor that VoRTX has is not there.
    #[error(
        "expected the tensor `{name}` of VoRTX's network, found none and {found} others, {missing} such missing in all; \
         give a checkpoint of VoRTX with its own widths, whole and with its names"
    )]
    Missing {
        /// The first one.
        name: String,
        /// How many are missing.
        missing: usize,
        /// How many tensors there are.
        found: usize,
    },
    /// A tensor of another shape.
    #[error(
        "expected `{name}` of shape {expected:?}, found {found:?}; VoRTX's own widths alone can be taken over"
    )]
    Shape {
        /// Its name in the file.
        name: String,
        /// Its shape there in VoRTX.
        expected: Vec<usize>,
        /// Its shape in the file.
        found: Vec<usize>,
    },
}

/// A tensor of a file: its shape and its numbers, row by row.
pub type Stored = (Vec<usize>, Vec<f32>);

/// The network whose tensors `read` gives by the names of VoRTX's `state_dict`, with or without the `vortx.` that its
/// training puts before them.
///
/// # Errors
/// Tensors that are missing or of other shapes.
pub fn import(
    mut read: impl FnMut(&str) -> Option<Stored>,
    tensors: usize,
    device: &Device,
) -> Result<Ipdrecon, ImportError> {
    let config = NetConfig::full().baseline();
    let mut missing = Vec::new();
    let mut fault = None;
    let model = named::replace(Ipdrecon::new(&config, device), |path, shape| {
        let (name, layout) = theirs(path)?;
        let stored = read(&name).or_else(|| read(&format!("vortx.{name}")));
        let Some((found, values)) = stored else {
            // torchsparse's convolutions have no bias unless they are asked for one.
            if path.ends_with("head.bias") {
                return Some(vec![0.0; shape.iter().product()]);
            }
            missing.push(name);
            return None;
        };
        let expected = layout.shape(shape);
        if found != expected || values.len() != expected.iter().product::<usize>() {
            fault.get_or_insert(ImportError::Shape {
                name,
                expected,
                found,
            });
            return None;
        }
        Some(layout.ours(shape, &values))
    });
    if let Some(name) = missing.first() {
        return Err(ImportError::Missing {
            name: name.clone(),
            missing: missing.len(),
            found: tensors,
        });
    }
    fault.map_or(Ok(model), Err)
}

/// How a tensor lies in VoRTX's file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Layout {
    Same,
    /// PyTorch's linear layers: outputs by inputs.
    Transposed,
    /// Kernels of edge 2: the last axis of the offset runs fastest, where ours is the first. Those of edge 3 are as ours.
    Eight,
    /// VoRTX's distance is negative in free space, ours is positive there.
    Negated,
}

impl Layout {
    /// The shape in the file of what has `shape` here.
    fn shape(self, shape: &[usize]) -> Vec<usize> {
        let mut shape = shape.to_vec();
        if self == Self::Transposed {
            shape.reverse();
        }
        shape
    }

    /// The numbers in our order.
    fn ours(self, shape: &[usize], values: &[f32]) -> Vec<f32> {
        match (self, shape) {
            (Self::Transposed, &[inputs, outputs]) => (0..inputs * outputs)
                .map(|i| values[i / outputs + inputs * (i % outputs)])
                .collect(),
            (Self::Eight, &[taps, inputs, outputs]) => {
                let size = inputs * outputs;
                let theirs = |tap: usize| (tap & 1) << 2 | tap & 2 | tap >> 2;
                let tap = |tap: usize| &values[theirs(tap) * size..(theirs(tap) + 1) * size];
                (0..taps).flat_map(|k| tap(k).iter().copied()).collect()
            }
            (Self::Negated, _) => values.iter().map(|value| -value).collect(),
            _ => values.to_vec(),
        }
    }
}

const LEVELS: [&str; 3] = ["coarse", "medium", "fine"];

/// The name in VoRTX of a tensor of ours.
fn theirs(path: &str) -> Option<(String, Layout)> {
    let parts: Vec<&str> = path.split('.').collect();
    match parts.as_slice() {
        ["planes", "backbone", "stem", layer, rest @ ..] => {
            let first = 3 * place(&["first", "depth", "project"], layer)?;
            Some((
                format!("cnn2d.conv0.{}", convolution(first, rest)?),
                Layout::Same,
            ))
        }
        [
            "planes",
            "backbone",
            "stages",
            stage,
            "blocks",
            block,
            layer,
            rest @ ..,
        ] => {
            let stage = ["conv0.8", "conv1", "conv2"].get(stage.parse::<usize>().ok()?)?;
            let first = 3 * place(&["expand", "depth", "project"], layer)?;
            let rest = convolution(first, rest)?;
            Some((format!("cnn2d.{stage}.{block}.layers.{rest}"), Layout::Same))
        }
        ["planes", "pyramid", kind, number, rest @ ..] => {
            let kind = if *kind == "lateral" { "inner" } else { "out" };
            let number = number.parse::<usize>().ok()? + 1;
            let rest = match rest {
                ["conv", "weight"] => "2.weight".to_owned(),
                ["norm", part] => format!("0.{}", normalisation(part)?),
                _ => return None,
            };
            Some((format!("cnn2d.{kind}{number}.{rest}"), Layout::Same))
        }
        ["planes", "levels", level, "rays", "mix", "weight"] => Some((
            format!("view_embedders.{}.conv.0.weight", name(level)?),
            Layout::Same,
        )),
        ["fusion", level, "norm", part] => Some((
            format!("layer_norms.{}.{}", name(level)?, normalisation(part)?),
            Layout::Same,
        )),
        ["fusion", level, rest @ ..] => {
            let (rest, layout) = fusion(rest)?;
            Some((format!("mv_fusion.{}.{rest}", name(level)?), layout))
        }
        ["decoders", level, "head", part] => {
            let part = if *part == "weight" { "kernel" } else { "bias" };
            let layout = if *level == "2" {
                Layout::Negated
            } else {
                Layout::Same
            };
            Some((format!("output_layers.{}.{part}", name(level)?), layout))
        }
        ["decoders", level, "unet", rest @ ..] => {
            let (rest, layout) = unet(rest)?;
            Some((format!("cnns3d.{}.{rest}", name(level)?), layout))
        }
        _ => None,
    }
}

fn place(names: &[&str], name: &str) -> Option<usize> {
    names.iter().position(|other| *other == name)
}

fn name(level: &str) -> Option<&'static str> {
    LEVELS.get(level.parse::<usize>().ok()?).copied()
}

/// A convolution and the normalisation after it, numbered from `first`.
fn convolution(first: usize, rest: &[&str]) -> Option<String> {
    match rest {
        ["conv", "weight"] => Some(format!("{first}.weight")),
        ["norm", part] => Some(format!("{}.{}", first + 1, normalisation(part)?)),
        _ => None,
    }
}

fn normalisation(part: &str) -> Option<&str> {
    match part {
        "gamma" => Some("weight"),
        "beta" => Some("bias"),
        "running_mean" | "running_var" => Some(part),
        _ => None,
    }
}

fn fusion(rest: &[&str]) -> Option<(String, Layout)> {
    let linear = |name: &str, part: &str| {
        let layout = if part == "weight" {
            Layout::Transposed
        } else {
            Layout::Same
        };
        Some((format!("{name}.{part}"), layout))
    };
    match rest {
        ["embed", part] => linear("depth_mlp", part),
        ["occupancy", part] => linear("proj_tsdf_mlp", part),
        ["layers", layer, kind, part] => {
            let layer = format!("transformer.encoder_layers.{layer}");
            match *kind {
                "norm_attention" => Some((
                    format!("{layer}.norm1.{}", normalisation(part)?),
                    Layout::Same,
                )),
                "norm_mlp" => Some((
                    format!("{layer}.norm2.{}", normalisation(part)?),
                    Layout::Same,
                )),
                "query_key_value" => {
                    let (_, layout) = linear("", part)?;
                    Some((format!("{layer}.attn.in_proj_{part}"), layout))
                }
                "output" => linear(&format!("{layer}.attn.out_proj"), part),
                "mlp_in" => linear(&format!("{layer}.mlp.fc1"), part),
                "mlp_out" => linear(&format!("{layer}.mlp.fc2"), part),
                _ => None,
            }
        }
        _ => None,
    }
}

fn unet(rest: &[&str]) -> Option<(String, Layout)> {
    match rest {
        ["stem", rest @ ..] => Some((format!("stem.{}", sparse(0, rest)?), Layout::Same)),
        [stage, "change", rest @ ..] => {
            let layout = if rest[0] == "conv" {
                Layout::Eight
            } else {
                Layout::Same
            };
            Some((
                format!("{}.0.net.{}", stage_name(stage)?, sparse(0, rest)?),
                layout,
            ))
        }
        [stage, block, rest @ ..] => {
            let number = place(&["first", "second"], block)?;
            let block = match stage.starts_with("down") {
                true => format!("{}.{}", stage_name(stage)?, number + 1),
                false => format!("{}.1.{number}", stage_name(stage)?),
            };
            let rest = match rest {
                ["first", rest @ ..] => format!("net.{}", sparse(0, rest)?),
                ["second", "weight"] => "net.3.kernel".to_owned(),
                ["norm", part] => format!("net.4.{}", normalisation(part)?),
                ["around", "linear", "weight"] => "downsample.0.kernel".to_owned(),
                ["around", "norm", part] => format!("downsample.1.{}", normalisation(part)?),
                _ => return None,
            };
            Some((format!("{block}.{rest}"), Layout::Same))
        }
        _ => None,
    }
}

fn stage_name(stage: &str) -> Option<&'static str> {
    let names = ["stage1", "stage2", "up1", "up2"];
    names
        .get(place(&["down1", "down2", "up1", "up2"], stage)?)
        .copied()
}

/// As [`convolution`], with torchsparse's word for a weight.
fn sparse(first: usize, rest: &[&str]) -> Option<String> {
    match rest {
        ["conv", "weight"] => Some(format!("{first}.kernel")),
        _ => convolution(first, rest),
    }
}
