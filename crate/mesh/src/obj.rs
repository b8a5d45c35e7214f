//! Wavefront OBJ out: the text format that every tool opens. Vertex colours ride behind the position, as MeshLab,
//! Blender and trimesh read them.

use crate::Mesh;
use std::fmt::Write;

/// The mesh as OBJ: `v x y z r g b` (colour from 0 to 1), `vn`, and `f v//vn`. The mesh must be valid
/// ([`Mesh::validate`]).
pub fn write(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::with_capacity(mesh.positions.len() * 96 + mesh.triangles.len() * 40);
    text.push_str("# IPDRecon, metres\n");
    // Writing to a String cannot fail.
    for (index, p) in mesh.positions.iter().enumerate() {
        let _ = write!(text, "v {} {} {}", p.x, p.y, p.z);
        if let Some(color) = mesh.colors.get(index) {
            let [r, g, b] = color.map(|channel| f32::from(channel) / 255.0);
            let _ = write!(text, " {r:.4} {g:.4} {b:.4}");
        }
        text.push('\n');
    }
    for n in &mesh.normals {
        let _ = writeln!(text, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z);
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| index + 1);
        let _ = if mesh.normals.is_empty() {
            writeln!(text, "f {a} {b} {c}")
        } else {
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")
        };
    }
    text.into_bytes()
}
