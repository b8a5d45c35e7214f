//! Writes one small coloured mesh as PLY, GLB and OBJ, and odd cases as GLB, for other programs to check:
//! `cargo run --release -p mesh --example write_exports -- DIR`.

use glam::Vec3;
use mesh::{Mesh, glb, obj, ply};
use std::error::Error;
use std::fs;
use std::path::PathBuf;

const RINGS: u32 = 24;
const SEGMENTS: u32 = 48;

/// A closed ring of one metre, 25 cm thick; the colour tells the place on it.
fn torus() -> Mesh {
    let mut mesh = Mesh::default();
    for segment in 0..SEGMENTS {
        for ring in 0..RINGS {
            let around = segment as f32 / SEGMENTS as f32 * std::f32::consts::TAU;
            let across = ring as f32 / RINGS as f32 * std::f32::consts::TAU;
            let outward = Vec3::new(around.cos(), around.sin(), 0.0);
            let normal = outward * across.cos() + Vec3::Z * across.sin();
            mesh.positions.push(outward + normal * 0.25);
            mesh.normals.push(normal);
            mesh.colors
                .push([(segment * 5) as u8, (ring * 10) as u8, 77]);

            let at = |s: u32, r: u32| (s % SEGMENTS) * RINGS + r % RINGS;
            let [a, b] = [at(segment, ring), at(segment + 1, ring)];
            let [c, d] = [at(segment, ring + 1), at(segment + 1, ring + 1)];
            mesh.triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    mesh
}

/// A strip with more vertices than 16-bit indices reach, without normals and colours.
fn many_vertices() -> Mesh {
    let columns = 33_000_u32;
    let column = |i: u32| [0.0, 1.0].map(|y| Vec3::new(i as f32 * 1e-3, y, 0.0));
    Mesh {
        positions: (0..columns).flat_map(column).collect(),
        triangles: (0..2 * columns - 2)
            .map(|i| {
                if i % 2 == 0 {
                    [i, i + 2, i + 1]
                } else {
                    [i, i + 1, i + 2]
                }
            })
            .collect(),
        ..Mesh::default()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = PathBuf::from(folder.ok_or("expected a folder to write to as the only argument")?);
    fs::create_dir_all(&folder)?;
    let torus = torus();
    let points = Mesh {
        triangles: Vec::new(),
        ..torus.clone()
    };
    let tilted = Vec3::new(0.2, -0.9, 0.4).normalize();
    let files = [
        ("torus.ply", ply::write(&torus)),
        ("torus.obj", obj::write(&torus)),
        ("torus.glb", glb::write(&torus, Vec3::Z)),
        ("tilted.glb", glb::write(&torus, tilted)),
        ("points.ply", ply::write(&points)),
        ("points.glb", glb::write(&points, Vec3::Y)),
        ("many-vertices.glb", glb::write(&many_vertices(), Vec3::Y)),
        ("empty.glb", glb::write(&Mesh::default(), Vec3::Z)),
    ];
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}
