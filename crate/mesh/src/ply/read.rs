//! A mesh from a PLY file: keeps of its elements what a [`Mesh`] has room for.

use super::PlyError;
use super::body::{Body, Row};
use super::header::{Element, Property, Scalar, parse};
use crate::Mesh;
use glam::Vec3;

/// Reads a mesh, or a point cloud when the file has no faces.
///
/// ASCII and both binary byte orders; positions and normals in any number type; colours as `red green blue` (also
/// `r g b` and `diffuse_*`), whole numbers as they are, floating point as 0 to 1; polygons become fans of triangles,
/// faces with fewer than three corners are left out; all else is skipped. Normals that are not finite become zero.
///
/// # Errors
/// [`PlyError`] names the line or the element. No input panics or asks for more memory than its own size warrants.
pub fn read(data: &[u8]) -> Result<Mesh, PlyError> {
    let header = parse(data)?;
    let mut body = Body::new(data, &header);
    let mut mesh = Mesh::default();
    let mut faces = Vec::new();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(&mut body, element, &mut mesh)?,
            "face" => faces = read_faces(&mut body, element)?,
            "tristrips" => {
                return Err(PlyError::Unsupported {
                    what: "the faces are stored as triangle strips (element \"tristrips\")".into(),
                    instead: "a list of faces (element \"face\")",
                });
            }
            _ => {
                let mut row = Row::of(element);
                for index in element.rows() {
                    body.read_row(element, index, &mut row)?;
                }
            }
        }
    }
    mesh.triangles.reserve_exact(faces.len());
    let vertices = mesh.positions.len();
    for (face, triangle) in faces {
        // A file without vertices has no valid index at all, so `IndexRange` would have nothing to print.
        if vertices == 0 {
            return Err(PlyError::Unsupported {
                what: "there are faces but no element \"vertex\"".into(),
                instead: "vertices and faces",
            });
        }
        if let Some(&found) = triangle.iter().find(|&&i| i < 0 || i >= vertices as i64) {
            return Err(PlyError::IndexRange {
                face,
                vertices,
                found,
            });
        }
        mesh.triangles.push(triangle.map(|index| index as u32));
    }
    Ok(mesh)
}

fn read_vertices(body: &mut Body, element: &Element, mesh: &mut Mesh) -> Result<(), PlyError> {
    let find = |names: &[&str]| {
        let matches = |p: &Property| p.length.is_none() && names.contains(&p.name.as_str());
        element.properties.iter().position(matches)
    };
    let three = |names: [&[&str]; 3]| {
        let [x, y, z] = names.map(find);
        Some([x?, y?, z?])
    };
    let Some(position) = three([&["x"], &["y"], &["z"]]) else {
        return Err(PlyError::Unsupported {
            what: "element \"vertex\" lacks the properties x, y and z".into(),
            instead: "a mesh or a point cloud with positions",
        });
    };
    let normal = three([&["nx"], &["ny"], &["nz"]]);
    let color = three([
        &["red", "r", "diffuse_red"],
        &["green", "g", "diffuse_green"],
        &["blue", "b", "diffuse_blue"],
    ]);
    let color_scale = color.map_or(1.0, |[red, ..]| match element.properties[red].value {
        Scalar::F32 | Scalar::F64 => 255.0,
        Scalar::U16 => 255.0 / 65535.0,
        _ => 1.0,
    });
    let mut row = Row::of(element);
    for vertex in element.rows() {
        body.read_row(element, vertex, &mut row)?;
        let pick = |at: [usize; 3]| at.map(|property| row.values[property]);
        let [x, y, z] = pick(position);
        let place = Vec3::new(x as f32, y as f32, z as f32);
        if !place.is_finite() {
            return Err(PlyError::NotFinite { vertex, x, y, z });
        }
        mesh.positions.push(place);
        if let Some(normal) = normal {
            let normal = Vec3::from_array(pick(normal).map(|value| value as f32));
            mesh.normals.push(if normal.is_finite() {
                normal
            } else {
                Vec3::ZERO
            });
        }
        if let Some(color) = color {
            let channels = pick(color).map(|value| (value * color_scale).round() as u8);
            mesh.colors.push(channels);
        }
    }
    Ok(())
}

/// Triangles with the number of the face they come from.
fn read_faces(body: &mut Body, element: &Element) -> Result<Vec<(u64, [i64; 3])>, PlyError> {
    let is_corners = |p: &Property| {
        p.length.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
    };
    let Some(corners) = element.properties.iter().position(is_corners) else {
        return Err(PlyError::Unsupported {
            what: "element \"face\" lacks the list vertex_indices".into(),
            instead: "faces with vertex_indices",
        });
    };
    let mut triangles = Vec::new();
    let mut row = Row::of(element);
    for face in element.rows() {
        body.read_row(element, face, &mut row)?;
        if let [first, rest @ ..] = row.lists[corners].as_slice() {
            let fan = rest.windows(2);
            triangles.extend(fan.map(|pair| (face, [*first, pair[0], pair[1]].map(|i| i as i64))));
        }
    }
    Ok(triangles)
}
