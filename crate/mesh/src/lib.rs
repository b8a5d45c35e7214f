//! The triangle mesh: what a reconstruction ends in, how it leaves as a file, and how good it is.
//!
//! Files in and out ([`ply`], [`glb`], [`obj`]), what a comparison needs ([`sample`], [`nearest`], [`raster`]), the
//! paper's figures ([`metrics`]) and the three ways of taking them ([`protocol`]). Plain CPU code that knows neither a
//! GPU nor a scan's format, so that every other room can stand on it, in a browser as well.

pub mod camera;
pub mod glb;
pub mod metrics;
pub mod nearest;
pub mod obj;
pub mod ply;
pub mod protocol;
pub mod raster;
pub mod sample;
pub mod soup;

use glam::{DAffine3, DMat3, Vec3};

/// An indexed triangle mesh in metres, or a point cloud when it has no triangles.
///
/// Triangles wind counter-clockwise seen from outside, that is from the free space in front of the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals pointing into free space, empty or one per position. Zero means "not known".
    pub normals: Vec<Vec3>,
    /// Vertex colours, sRGB red, green, blue; empty or one per position.
    pub colors: Vec<[u8; 3]>,
    /// Three indices into `positions` each.
    pub triangles: Vec<[u32; 3]>,
}

/// What makes a [`Mesh`] unfit for use.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A vertex attribute has another length than the positions.
    #[error("mesh: expected no {attribute} or one for each of {vertices} vertices, found {found}")]
    AttributeCount {
        /// "normals" or "colours".
        attribute: &'static str,
        /// How many positions there are.
        vertices: usize,
        /// How many of the attribute there are.
        found: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("mesh: triangle {triangle}: expected vertex indices below {vertices}, found {found}")]
    IndexRange {
        /// Which triangle, from 0.
        triangle: usize,
        /// How many positions there are.
        vertices: usize,
        /// The index found.
        found: u32,
    },
    /// A position or a normal has a coordinate that is infinite or not a number.
    #[error("mesh: vertex {vertex}: expected a finite {attribute}, found {found}")]
    NotFinite {
        /// "position" or "normal".
        attribute: &'static str,
        /// Which vertex, from 0.
        vertex: usize,
        /// The value found.
        found: Vec3,
    },
}

/// An axis-aligned box in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub min: Vec3,
    /// The corner with the largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// The smallest box around `points`; `None` when there are none.
    pub fn of(points: &[Vec3]) -> Option<Self> {
        let (&first, rest) = points.split_first()?;
        let start = Self {
            min: first,
            max: first,
        };
        Some(rest.iter().fold(start, |all, &point| Self {
            min: all.min.min(point),
            max: all.max.max(point),
        }))
    }

    /// Edge lengths in metres.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The middle of the box.
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }
}

impl Mesh {
    /// The smallest box around all vertices; `None` when there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of(&self.positions)
    }

    /// Surface area in square metres.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| self.triangle_area(t)).sum()
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|index| self.positions[index as usize])
    }

    /// Area of one triangle in square metres.
    pub fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(triangle).map(Vec3::as_dvec3);
        (b - a).cross(c - a).length() * 0.5
    }

    /// Moves the mesh by `by`. A mirroring map also turns the winding round, so that outside stays outside.
    pub fn transform(&mut self, by: &DAffine3) {
        for position in &mut self.positions {
            *position = by.transform_point3(position.as_dvec3()).as_vec3();
        }
        // Normals go by the inverse transpose; the cofactors are the same up to scale and exist for a flat map too.
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = by.matrix3;
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrored = by.matrix3.determinant() < 0.0;
        let outward = if mirrored { -cofactors } else { cofactors };
        for normal in &mut self.normals {
            *normal = (outward * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        if mirrored {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
    }

    /// Checks what every other function here relies on: attribute counts, index range, finite numbers.
    ///
    /// # Errors
    /// The first fault found.
    pub fn validate(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        let counts = [
            ("normals", self.normals.len()),
            ("colours", self.colors.len()),
        ];
        for (attribute, found) in counts {
            if found != 0 && found != vertices {
                return Err(MeshError::AttributeCount {
                    attribute,
                    vertices,
                    found,
                });
            }
        }
        for (attribute, values) in [("position", &self.positions), ("normal", &self.normals)] {
            if let Some(vertex) = values.iter().position(|value| !value.is_finite()) {
                return Err(MeshError::NotFinite {
                    attribute,
                    vertex,
                    found: values[vertex],
                });
            }
        }
        for (triangle, indices) in self.triangles.iter().enumerate() {
            if let Some(&found) = indices.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::IndexRange {
                    triangle,
                    vertices,
                    found,
                });
            }
        }
        Ok(())
    }
}
