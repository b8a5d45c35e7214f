//! GLB and OBJ as a viewer sees them. The Khronos validator and trimesh look at the same files in the project's tests.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use glam::{Quat, Vec3};
use mesh::{Mesh, glb, obj};
use serde_json::Value;

fn colored_triangle() -> Mesh {
    Mesh {
        positions: vec![
            Vec3::new(-1.5, 0.1, 0.0),
            Vec3::X,
            Vec3::new(0.0, 2.0, -0.7),
        ],
        normals: vec![Vec3::Z, Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO],
        colors: vec![[255, 188, 0], [0, 0, 1], [10, 20, 30]],
        triangles: vec![[0, 1, 2]],
    }
}

/// The JSON and the binary chunk; checks the container on the way.
fn open(glb: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&glb[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, glb.len()));
    let (mut at, mut chunks) = (12, Vec::new());
    while at < glb.len() {
        let length = word(at);
        assert_eq!(length % 4, 0);
        chunks.push((&glb[at + 4..at + 8], &glb[at + 8..at + 8 + length]));
        at += 8 + length;
    }
    assert_eq!(chunks[0].0, b"JSON");
    let binary = chunks.get(1).map_or(&[][..], |&(kind, data)| {
        assert_eq!(kind, b"BIN\0");
        data
    });
    (
        serde_json::from_slice(chunks[0].1).unwrap(),
        binary.to_vec(),
    )
}

/// The bytes of a primitive's attribute, and its accessor.
fn attribute<'a>(json: &'a Value, binary: &'a [u8], name: &str) -> (&'a Value, &'a [u8]) {
    let primitive = &json["meshes"][0]["primitives"][0];
    let index = match name {
        "indices" => &primitive["indices"],
        _ => &primitive["attributes"][name],
    };
    let accessor = &json["accessors"][index.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [start, length] = ["byteOffset", "byteLength"].map(|k| view[k].as_u64().unwrap() as usize);
    (accessor, &binary[start..start + length])
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let words = bytes.chunks_exact(4);
    words
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect()
}

fn shorts(bytes: &[u8]) -> Vec<u16> {
    let words = bytes.chunks_exact(2);
    words
        .map(|b| u16::from_le_bytes(b.try_into().unwrap()))
        .collect()
}

#[test]
fn glb_holds_the_mesh() {
    let mesh = colored_triangle();
    let (json, binary) = open(&glb::write(&mesh, Vec3::Y));
    assert_eq!(json["asset"]["generator"], "IPDRecon");
    assert!(json["nodes"][0]["rotation"].is_null());

    let (accessor, bytes) = attribute(&json, &binary, "POSITION");
    assert_eq!(
        floats(bytes),
        [-1.5, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, -0.7]
    );
    let corner = |name: &str| {
        let numbers = accessor[name].as_array().unwrap().iter();
        numbers
            .map(|v| v.as_f64().unwrap() as f32)
            .collect::<Vec<_>>()
    };
    assert_eq!(corner("min"), [-1.5, 0.0, -0.7]);
    assert_eq!(corner("max"), [1.0, 2.0, 0.0]);

    let (_, bytes) = attribute(&json, &binary, "NORMAL");
    let normals = floats(bytes);
    assert_eq!(normals[3..6], [0.0, 0.0, 1.0], "made unit length");
    let last = Vec3::from_slice(&normals[6..9]);
    assert_eq!(
        last.length(),
        1.0,
        "an unknown normal must still be a unit vector"
    );

    let (accessor, bytes) = attribute(&json, &binary, "COLOR_0");
    assert_eq!(
        (&accessor["type"], &accessor["normalized"]),
        (&"VEC4".into(), &true.into())
    );
    let colors = shorts(bytes);
    // sRGB 188 is half the light; the darkest step of sRGB is still a step.
    assert_eq!((colors[0], colors[2], colors[3]), (65535, 0, 65535));
    assert!(
        (f32::from(colors[1]) / 65535.0 - 0.5029).abs() < 1e-4,
        "{}",
        colors[1]
    );
    assert_eq!(colors[6], 20);

    let (accessor, bytes) = attribute(&json, &binary, "indices");
    assert_eq!(accessor["componentType"], 5123);
    assert_eq!(shorts(bytes)[..3], [0, 1, 2]);
}

#[test]
fn glb_stands_upright_whatever_is_up() {
    for up in [Vec3::Z, Vec3::new(0.3, -0.8, 0.2).normalize(), Vec3::NEG_Y] {
        let (json, _) = open(&glb::write(&colored_triangle(), up));
        let rotation = json["nodes"][0]["rotation"].as_array().unwrap().iter();
        let rotation: Vec<f32> = rotation.map(|v| v.as_f64().unwrap() as f32).collect();
        let turned = Quat::from_slice(&rotation) * up;
        assert!(turned.distance(Vec3::Y) < 1e-6, "{up} shown as {turned}");
    }
}

#[test]
fn glb_indices_grow_when_they_must() {
    for (vertices, component) in [(65_535, 5123), (65_536, 5125)] {
        let last = vertices as u32 - 1;
        let mesh = Mesh {
            positions: (0..vertices).map(|i| Vec3::splat(i as f32)).collect(),
            triangles: vec![[0, 1, last]],
            ..Mesh::default()
        };
        let (json, binary) = open(&glb::write(&mesh, Vec3::Y));
        let (accessor, bytes) = attribute(&json, &binary, "indices");
        assert_eq!(accessor["componentType"], component);
        let width = if component == 5123 { 2 } else { 4 };
        let mut stored = [0; 4];
        stored[..width].copy_from_slice(&bytes[2 * width..3 * width]);
        assert_eq!(u32::from_le_bytes(stored), last);
    }
}

#[test]
fn glb_of_points_and_of_nothing() {
    let cloud = Mesh {
        triangles: Vec::new(),
        ..colored_triangle()
    };
    let (json, _) = open(&glb::write(&cloud, Vec3::Y));
    assert_eq!(json["meshes"][0]["primitives"][0]["mode"], 0);
    let (json, binary) = open(&glb::write(&Mesh::default(), Vec3::Y));
    assert!(json["meshes"].is_null() && binary.is_empty());
}

#[test]
fn obj_is_plain_text_with_colours() {
    let text = String::from_utf8(obj::write(&colored_triangle())).unwrap();
    let expected = "# IPDRecon, metres\n\
        v -1.5 0.1 0 1.0000 0.7373 0.0000\n\
        v 1 0 0 0.0000 0.0000 0.0039\n\
        v 0 2 -0.7 0.0392 0.0784 0.1176\n\
        vn 0.00000 0.00000 1.00000\n\
        vn 0.00000 0.00000 0.50000\n\
        vn 0.00000 0.00000 0.00000\n\
        f 1//1 2//2 3//3\n";
    assert_eq!(text, expected);
    let bare = Mesh {
        normals: Vec::new(),
        colors: Vec::new(),
        ..colored_triangle()
    };
    let text = String::from_utf8(obj::write(&bare)).unwrap();
    assert!(
        text.contains("v 1 0 0\n") && text.ends_with("f 1 2 3\n"),
        "{text}"
    );
}
