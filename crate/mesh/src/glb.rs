//! GLB (binary glTF 2.0) out: the one file that phones, browsers and Blender open alike, in colour.

use crate::{Bounds, Mesh};
use glam::{Quat, Vec3};

const MAGIC: &[u8; 4] = b"glTF";
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;

/// The mesh as GLB. The mesh must be valid ([`Mesh::validate`]).
///
/// glTF is Y up. Vertices stay in the mesh's own coordinates; `up` is the direction (unit length) that is up in them,
/// and the node carries the rotation that turns it to Y: `Vec3::Z` for a room with Z up, `Vec3::Y` for no rotation.
/// The material is single-sided, so that from outside one looks through the near walls into the room.
/// Colours become linear, as glTF asks, in 16 bits so that dark tones keep their steps. A mesh without vertices gives
/// a file with an empty scene, a point cloud one with points.
pub fn write(mesh: &Mesh, up: Vec3) -> Vec<u8> {
    let mut parts = Parts::default();
    let mut primitive = String::new();
    if let Some(bounds) = mesh.bounds() {
        primitive = add_vertices(&mut parts, mesh, bounds);
    }
    let asset = r#""asset":{"version":"2.0","generator":"IPDRecon"}"#;
    let json = if primitive.is_empty() {
        format!(r#"{{{asset},"scene":0,"scenes":[{{"name":"Empty"}}]}}"#)
    } else {
        let rotation = Quat::from_rotation_arc(up, Vec3::Y).normalize().to_array();
        let node = if up == Vec3::Y {
            String::new()
        } else {
            format!(r#","rotation":{}"#, numbers(&rotation))
        };
        format!(
            concat!(
                r#"{{{},"scene":0,"scenes":[{{"nodes":[0]}}],"#,
                r#""nodes":[{{"name":"Room","mesh":0{}}}],"meshes":[{{"primitives":[{{{}}}]}}],"#,
                r#""materials":[{{"pbrMetallicRoughness":{{"metallicFactor":0,"roughnessFactor":1}}}}],"#,
                r#""buffers":[{{"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}]}}"#
            ),
            asset,
            node,
            primitive,
            parts.bytes.len(),
            parts.views.join(","),
            parts.accessors.join(","),
        )
    };
    container(json.into_bytes(), &parts.bytes)
}

/// The binary chunk and what describes it.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Parts {
    /// Appends one array in a view of its own and returns its accessor's number.
    fn add(&mut self, bytes: impl Iterator<Item = u8>, target: u32, accessor: &str) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        pad(&mut self.bytes, 0);
        let view = self.views.len();
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{start},"byteLength":{length},"target":{target}}}"#
        ));
        self.accessors
            .push(format!(r#"{{"bufferView":{view},{accessor}}}"#));
        view
    }
}

/// Adds all arrays; returns the primitive's JSON without braces.
fn add_vertices(parts: &mut Parts, mesh: &Mesh, bounds: Bounds) -> String {
    let count = mesh.positions.len();
    let floats = |values: &[Vec3]| -> Vec<u8> {
        let flat = values.iter().flat_map(Vec3::to_array);
        flat.flat_map(f32::to_le_bytes).collect()
    };
    let accessor = format!(
        r#""componentType":{FLOAT},"count":{count},"type":"VEC3","min":{},"max":{}"#,
        numbers(&bounds.min.to_array()),
        numbers(&bounds.max.to_array()),
    );
    let position = parts.add(floats(&mesh.positions).into_iter(), ARRAY_BUFFER, &accessor);
    let mut attributes = format!(r#""POSITION":{position}"#);
    if !mesh.normals.is_empty() {
        let unit: Vec<Vec3> = mesh
            .normals
            .iter()
            .map(|normal| normal.normalize_or(Vec3::Y))
            .collect();
        let accessor = format!(r#""componentType":{FLOAT},"count":{count},"type":"VEC3""#);
        let normal = parts.add(floats(&unit).into_iter(), ARRAY_BUFFER, &accessor);
        attributes += &format!(r#","NORMAL":{normal}"#);
    }
    if !mesh.colors.is_empty() {
        let linear: Vec<u16> = (0..=255).map(linear_u16).collect();
        // Four channels, because a vertex must start at a multiple of four bytes.
        let channels = mesh.colors.iter().flat_map(|color| {
            let [r, g, b] = color.map(|channel| linear[usize::from(channel)]);
            [r, g, b, u16::MAX]
        });
        let accessor = format!(
            r#""componentType":{UNSIGNED_SHORT},"normalized":true,"count":{count},"type":"VEC4""#
        );
        let color = parts.add(channels.flat_map(u16::to_le_bytes), ARRAY_BUFFER, &accessor);
        attributes += &format!(r#","COLOR_0":{color}"#);
    }
    if mesh.triangles.is_empty() {
        return format!(r#""mode":{POINTS},"material":0,"attributes":{{{attributes}}}"#);
    }
    let corners = mesh.triangles.as_flattened();
    // The largest index of a type is reserved (primitive restart).
    let short = count <= usize::from(u16::MAX);
    let accessor = format!(
        r#""componentType":{},"count":{},"type":"SCALAR""#,
        if short { UNSIGNED_SHORT } else { UNSIGNED_INT },
        corners.len()
    );
    let width = if short { 2 } else { 4 };
    let bytes = corners
        .iter()
        .flat_map(|index| index.to_le_bytes().into_iter().take(width));
    let indices = parts.add(bytes, ELEMENT_ARRAY_BUFFER, &accessor);
    format!(r#""mode":{TRIANGLES},"material":0,"indices":{indices},"attributes":{{{attributes}}}"#)
}

/// sRGB (IEC 61966-2-1) to linear, 0 to 65535.
fn linear_u16(srgb: u8) -> u16 {
    let value = f64::from(srgb) / 255.0;
    let linear = if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    };
    (linear * 65535.0).round() as u16
}

/// A JSON array that keeps every bit of each f32.
fn numbers(values: &[f32]) -> String {
    let texts: Vec<String> = values
        .iter()
        .map(|&value| f64::from(value).to_string())
        .collect();
    format!("[{}]", texts.join(","))
}

/// The GLB container: header, JSON chunk padded with spaces, binary chunk padded with zeros.
fn container(mut json: Vec<u8>, binary: &[u8]) -> Vec<u8> {
    pad(&mut json, b' ');
    let mut chunks = vec![(b"JSON", json.as_slice())];
    if !binary.is_empty() {
        chunks.push((b"BIN\0", binary));
    }
    let length = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let mut glb = Vec::with_capacity(length);
    glb.extend(MAGIC);
    glb.extend(2_u32.to_le_bytes());
    glb.extend((length as u32).to_le_bytes());
    for (kind, data) in chunks {
        glb.extend((data.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(data);
    }
    glb
}

fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}
