//! `ipdrecon import` on a checkpoint made here, with the names and shapes that VoRTX's code gives its `state_dict`.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{ipdrecon, network, str, text};
use net::{NetConfig, named};
use std::{collections::HashMap, fs, io::Write, path::Path};
use tempfile::TempDir;

type Tensors = Vec<(String, Vec<usize>)>;

/// The tensors of VoRTX's modules, one after another as its classes make them.
fn vortx() -> Tensors {
    let mut all = Tensors::new();
    let mut add = |name: String, shape: &[usize]| all.push((name, shape.to_vec()));
    let norm = |add: &mut dyn FnMut(String, &[usize]), name: &str, width: usize| {
        for part in ["weight", "bias", "running_mean", "running_var"] {
            add(format!("{name}.{part}"), &[width]);
        }
        add(format!("{name}.num_batches_tracked"), &[]);
    };
    add("cnn2d.conv0.0.weight".into(), &[32, 3, 3, 3]);
    norm(&mut add, "cnn2d.conv0.1", 32);
    add("cnn2d.conv0.3.weight".into(), &[32, 1, 3, 3]);
    norm(&mut add, "cnn2d.conv0.4", 32);
    add("cnn2d.conv0.6.weight".into(), &[16, 32, 1, 1]);
    norm(&mut add, "cnn2d.conv0.7", 16);
    for (stage, inputs, outputs, kernel, wider) in [
        ("conv0.8", 16, 24, 3, 3),
        ("conv1", 24, 40, 5, 3),
        ("conv2", 40, 80, 5, 6),
    ] {
        for block in 0..3 {
            let from = if block == 0 { inputs } else { outputs };
            let inner = wider * from;
            let name = format!("cnn2d.{stage}.{block}.layers");
            add(format!("{name}.0.weight"), &[inner, from, 1, 1]);
            norm(&mut add, &format!("{name}.1"), inner);
            add(format!("{name}.3.weight"), &[inner, 1, kernel, kernel]);
            norm(&mut add, &format!("{name}.4"), inner);
            add(format!("{name}.6.weight"), &[outputs, inner, 1, 1]);
            norm(&mut add, &format!("{name}.7"), outputs);
        }
    }
    for (name, width, outputs, kernel) in [
        ("inner1", 40, 80, 1),
        ("inner2", 24, 80, 1),
        ("out1", 80, 80, 1),
        ("out2", 80, 40, 3),
        ("out3", 80, 24, 3),
    ] {
        norm(&mut add, &format!("cnn2d.{name}.0"), width);
        add(
            format!("cnn2d.{name}.2.weight"),
            &[outputs, width, kernel, kernel],
        );
    }
    let mut above = 0;
    for (i, (level, width, base)) in [("coarse", 80, 32), ("medium", 40, 16), ("fine", 24, 8)]
        .into_iter()
        .enumerate()
    {
        add(
            format!("view_embedders.{level}.conv.0.weight"),
            &[width, width + 27, 1, 1],
        );
        add(format!("layer_norms.{level}.weight"), &[width]);
        add(format!("layer_norms.{level}.bias"), &[width]);
        let fusion = format!("mv_fusion.{level}");
        let linear =
            |add: &mut dyn FnMut(String, &[usize]), name: &str, inputs: usize, outputs: usize| {
                add(format!("{fusion}.{name}.weight"), &[outputs, inputs]);
                add(format!("{fusion}.{name}.bias"), &[outputs]);
            };
        linear(&mut add, "depth_mlp", width + 1, width);
        linear(&mut add, "proj_tsdf_mlp", width, 1);
        for layer in 0..2 {
            let layer = format!("transformer.encoder_layers.{layer}");
            for norm in ["norm1", "norm2"] {
                add(format!("{fusion}.{layer}.{norm}.weight"), &[width]);
                add(format!("{fusion}.{layer}.{norm}.bias"), &[width]);
            }
            add(
                format!("{fusion}.{layer}.attn.in_proj_weight"),
                &[3 * width, width],
            );
            add(format!("{fusion}.{layer}.attn.in_proj_bias"), &[3 * width]);
            linear(&mut add, &format!("{layer}.attn.out_proj"), width, width);
            linear(&mut add, &format!("{layer}.mlp.fc1"), width, 2 * width);
            linear(&mut add, &format!("{layer}.mlp.fc2"), 2 * width, width);
        }
        let unet = format!("cnns3d.{level}");
        let conv = |add: &mut dyn FnMut(String, &[usize]),
                    name: &str,
                    at: usize,
                    taps: usize,
                    from: usize,
                    to: usize| {
            add(format!("{unet}.{name}.{at}.kernel"), &[taps, from, to]);
            norm(add, &format!("{unet}.{name}.{}", at + 1), to);
        };
        let residual =
            |add: &mut dyn FnMut(String, &[usize]), name: &str, from: usize, to: usize| {
                conv(add, &format!("{name}.net"), 0, 27, from, to);
                conv(add, &format!("{name}.net"), 3, 27, to, to);
                if from != to {
                    add(format!("{unet}.{name}.downsample.0.kernel"), &[from, to]);
                    norm(add, &format!("{unet}.{name}.downsample.1"), to);
                }
            };
        let inputs = above + width + usize::from(i > 0);
        let [c0, c1, c2, c3] = [base, 2 * base, 4 * base, 3 * base];
        conv(&mut add, "stem", 0, 27, inputs, c0);
        conv(&mut add, "stage1.0.net", 0, 8, c0, c0);
        residual(&mut add, "stage1.1", c0, c1);
        residual(&mut add, "stage1.2", c1, c1);
        conv(&mut add, "stage2.0.net", 0, 8, c1, c1);
        residual(&mut add, "stage2.1", c1, c2);
        residual(&mut add, "stage2.2", c2, c2);
        conv(&mut add, "up1.0.net", 0, 8, c2, c3);
        residual(&mut add, "up1.1.0", c3 + c1, c3);
        residual(&mut add, "up1.1.1", c3, c3);
        conv(&mut add, "up2.0.net", 0, 8, c3, c3);
        residual(&mut add, "up2.1.0", c3 + c0, c3);
        residual(&mut add, "up2.1.1", c3, c3);
        add(format!("output_layers.{level}.kernel"), &[c3, 1]);
        above = c3;
    }
    all
}

/// Number `i` of the tensor `name`: exact in 16 bits, and with a period that no row or column has.
fn number(name: &str, i: usize) -> f32 {
    let seed: usize = name.bytes().map(usize::from).sum();
    ((seed + i) % 1021) as f32 / 1024.0
        + if name.ends_with("running_var") {
            0.5
        } else {
            0.0
        }
}

/// A file of `torch.save`: a zip with a pickle of names and a file for each tensor.
fn checkpoint(path: &Path, tensors: &Tensors) {
    let mut zip = zip::ZipWriter::new(fs::File::create(path).unwrap());
    let plain =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let word = |out: &mut Vec<u8>, word: &str| {
        out.push(b'X');
        out.extend((word.len() as u32).to_le_bytes());
        out.extend(word.as_bytes());
    };
    let whole = |out: &mut Vec<u8>, number: usize| {
        out.push(b'J');
        out.extend((number as i32).to_le_bytes());
    };
    let mut pickle = b"\x80\x02}(".to_vec();
    word(&mut pickle, "epoch");
    whole(&mut pickle, 3);
    word(&mut pickle, "state_dict");
    pickle.extend(b"}(");
    for (k, (name, shape)) in tensors.iter().enumerate() {
        let count: usize = shape.iter().product();
        word(&mut pickle, &format!("vortx.{name}"));
        pickle.extend(b"ctorch._utils\n_rebuild_tensor_v2\n((");
        word(&mut pickle, "storage");
        let counter = name.ends_with("num_batches_tracked");
        pickle.extend(if counter {
            b"ctorch\nLongStorage\n".as_slice()
        } else {
            b"ctorch\nFloatStorage\n"
        });
        word(&mut pickle, &k.to_string());
        word(&mut pickle, "cpu");
        whole(&mut pickle, count);
        pickle.extend(b"tQ");
        whole(&mut pickle, 0);
        let mut strides = vec![1; shape.len()];
        for axis in (1..shape.len()).rev() {
            strides[axis - 1] = strides[axis] * shape[axis];
        }
        for numbers in [shape, &strides] {
            pickle.push(b'(');
            numbers
                .iter()
                .for_each(|number| whole(&mut pickle, *number));
            pickle.push(b't');
        }
        pickle.extend(b"\x89ccollections\nOrderedDict\n)RtR");
        zip.start_file(format!("archive/data/{k}"), plain).unwrap();
        let bytes: Vec<u8> = match counter {
            true => 7_i64.to_le_bytes().to_vec(),
            false => (0..count)
                .flat_map(|i| number(name, i).to_le_bytes())
                .collect(),
        };
        zip.write_all(&bytes).unwrap();
    }
    pickle.extend(b"uu.");
    zip.start_file("archive/data.pkl", plain).unwrap();
    zip.write_all(&pickle).unwrap();
    zip.start_file("archive/version", plain).unwrap();
    zip.write_all(b"3\n").unwrap();
    zip.finish().unwrap();
}

#[test]
fn every_tensor_of_vortx_finds_its_place() {
    let folder = TempDir::new().unwrap();
    let [theirs, ours] = ["vortx.ckpt", "vortx.safetensors"].map(|name| folder.path().join(name));
    let tensors = vortx();
    checkpoint(&theirs, &tensors);
    let run = ipdrecon(&["import", str(&theirs), "-o", str(&ours)]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let model = net::weights::load(&fs::read(&ours).unwrap(), &Device::flex()).unwrap();
    assert_eq!(model.config(), &NetConfig::full().baseline());
    let found: HashMap<String, Vec<f32>> = named::tensors(&model)
        .into_iter()
        .map(|(name, data)| (name, data.iter::<f32>().collect()))
        .collect();
    // As many numbers as VoRTX has, but for our three biases: nothing of it was left out or taken twice.
    let learnt = tensors
        .iter()
        .filter(|(name, _)| !name.ends_with("num_batches_tracked"));
    let count: usize = learnt
        .clone()
        .map(|(_, shape)| shape.iter().product::<usize>())
        .sum();
    assert_eq!(found.values().map(Vec::len).sum::<usize>(), count + 3);
    let sum = |values: &mut dyn Iterator<Item = f32>| {
        values.map(|value| f64::from(value.abs())).sum::<f64>()
    };
    let expected: f64 = learnt
        .map(|(name, shape)| sum(&mut (0..shape.iter().product()).map(|i| number(name, i))))
        .sum();
    let all = sum(&mut found.values().flatten().copied());
    assert!((all - expected).abs() < 1e-6 * expected, "{all} {expected}");

    let at = |ours: &str, i: usize, theirs: &str, j: usize| {
        assert_eq!(
            found[ours][i],
            number(theirs, j),
            "{ours}[{i}] is {theirs}[{j}]"
        );
    };
    at(
        "planes.backbone.stages.1.blocks.2.depth.conv.weight",
        777,
        "cnn2d.conv1.2.layers.3.weight",
        777,
    );
    at(
        "planes.pyramid.out.1.norm.running_var",
        5,
        "cnn2d.out2.0.running_var",
        5,
    );
    // A linear layer: input 3, output 7 of 81 inputs and 80 outputs.
    at(
        "fusion.0.embed.weight",
        3 * 80 + 7,
        "mv_fusion.coarse.depth_mlp.weight",
        7 * 81 + 3,
    );
    at(
        "fusion.2.layers.1.query_key_value.bias",
        50,
        "mv_fusion.fine.transformer.encoder_layers.1.attn.in_proj_bias",
        50,
    );
    // Edge 3: the first axis runs fastest in both.
    let size = 73 * 8;
    at(
        "decoders.2.unet.stem.conv.weight",
        11 * size + 9,
        "cnns3d.fine.stem.0.kernel",
        11 * size + 9,
    );
    // Edge 2: the child at (1, 0, 0) is our second and their fifth.
    let size = 16 * 16;
    at(
        "decoders.1.unet.down1.change.conv.weight",
        size + 3,
        "cnns3d.medium.stage1.0.net.0.kernel",
        4 * size + 3,
    );
    at(
        "decoders.1.unet.up2.second.second.weight",
        99,
        "cnns3d.medium.up2.1.1.net.3.kernel",
        99,
    );
    assert_eq!(
        found["decoders.2.head.weight"][4],
        -number("output_layers.fine.kernel", 4)
    );
    at(
        "decoders.1.head.weight",
        4,
        "output_layers.medium.kernel",
        4,
    );
}

#[test]
fn weights_of_a_training_run_become_half_as_large() {
    let folder = TempDir::new().unwrap();
    let [theirs, ours] =
        ["run.safetensors", "out.safetensors"].map(|name| folder.path().join(name));
    let model = net::weights::load(&network(false, 1.0), &Device::flex()).unwrap();
    let whole = net::weights::save(&model, net::weights::Precision::F32).unwrap();
    fs::write(&theirs, &whole).unwrap();
    let run = ipdrecon(&["import", str(&theirs), "-o", str(&ours)]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let found = fs::read(&ours).unwrap();
    assert!(
        found.len() < whole.len() * 6 / 10,
        "{} of {}",
        found.len(),
        whole.len()
    );
    let found = net::weights::load(&found, &Device::flex()).unwrap();
    assert_eq!(found.config(), model.config());
}

#[test]
fn what_is_no_vortx_says_why() {
    let folder = TempDir::new().unwrap();
    let [path, out] = ["some.ckpt", "out.safetensors"].map(|name| folder.path().join(name));
    let refused = |said: &str| {
        let run = ipdrecon(&["import", str(&path), "-o", str(&out)]);
        assert!(!run.status.success() && !out.exists());
        let error = text(&run.stderr);
        assert!(
            error.starts_with("error: ") && error.contains(said),
            "{error}"
        );
    };
    refused("some.ckpt");
    fs::write(&path, b"nothing of the kind").unwrap();
    refused("torch.save");
    let mut tensors = vortx();
    let lacking = tensors
        .iter()
        .position(|(name, _)| name == "mv_fusion.fine.depth_mlp.bias")
        .unwrap();
    let (name, shape) = tensors.remove(lacking);
    checkpoint(&path, &tensors);
    refused("expected the tensor `mv_fusion.fine.depth_mlp.bias` of VoRTX's network");
    assert_eq!(shape, [24]);
    tensors.push((name, vec![25]));
    checkpoint(&path, &tensors);
    refused("of shape [24], found [25]");
}
