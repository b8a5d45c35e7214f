//! PLY out, in the form that every reader takes: binary little endian, single floats, byte colours.

use crate::Mesh;
use glam::Vec3;
use std::fmt::Write;

/// The mesh as binary little-endian PLY: `x y z`, `nx ny nz` and `red green blue` where the mesh has them, and faces
/// unless it is a point cloud. The mesh must be valid ([`Mesh::validate`]).
pub fn write(mesh: &Mesh) -> Vec<u8> {
    let vertices = mesh.positions.len();
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment IPDRecon, metres\nelement vertex {vertices}\n"
    );
    let mut properties = |kind: &str, names: [&str; 3]| {
        for name in names {
            // Writing to a String cannot fail.
            let _ = writeln!(header, "property {kind} {name}");
        }
    };
    properties("float", ["x", "y", "z"]);
    if !mesh.normals.is_empty() {
        properties("float", ["nx", "ny", "nz"]);
    }
    if !mesh.colors.is_empty() {
        properties("uchar", ["red", "green", "blue"]);
    }
    if !mesh.triangles.is_empty() {
        let faces = mesh.triangles.len();
        let _ = write!(
            header,
            "element face {faces}\nproperty list uchar int vertex_indices\n"
        );
    }
    header.push_str("end_header\n");

    let mut bytes = header.into_bytes();
    bytes.reserve_exact(vertices * 27 + mesh.triangles.len() * 13);
    for (index, position) in mesh.positions.iter().enumerate() {
        let vectors = [Some(position), mesh.normals.get(index)];
        let numbers = vectors.into_iter().flatten().flat_map(Vec3::to_array);
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        if let Some(color) = mesh.colors.get(index) {
            bytes.extend(color);
        }
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|index| index.to_le_bytes()));
    }
    bytes
}
