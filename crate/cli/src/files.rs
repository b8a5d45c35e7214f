//! Files at both ends: scans and meshes in, meshes out.

use crate::failure::Failure;
use glam::Vec3;
use mesh::{Mesh, glb, obj, ply};
use scan::{FolderSource, Scan, ZipSource};
use std::{fs, fs::File, path::Path, rc::Rc};

/// Opens a folder or a zip as a scan.
pub fn open_scan(path: &Path) -> Result<Scan, Failure> {
    if path.is_file() {
        let file = File::open(path).map_err(|error| Failure::file("read", path, error))?;
        return Ok(scan::open(Rc::new(ZipSource::open(file)?))?);
    }
    Ok(scan::open(Rc::new(FolderSource::open(path)?))?)
}

/// Reads a PLY.
pub fn read_mesh(path: &Path) -> Result<Mesh, Failure> {
    let bytes = fs::read(path).map_err(|error| Failure::file("read", path, error))?;
    ply::read(&bytes).map_err(|error| Failure::Ply {
        path: path.to_owned(),
        error: Box::new(error),
    })
}

/// A mesh file's format.
#[derive(Clone, Copy)]
pub enum MeshFormat {
    Ply,
    Glb,
    Obj,
}

impl MeshFormat {
    /// From the ending of a file's name, so that a wrong one is told before any work.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_ref().and_then(|ending| ending.to_str()) {
            Some("ply") => Ok(Self::Ply),
            Some("glb") => Ok(Self::Glb),
            Some("obj") => Ok(Self::Obj),
            _ => Err(Failure::Format {
                path: path.to_owned(),
            }),
        }
    }

    /// Writes a mesh whose up direction is `up`.
    pub fn write(self, mesh: &Mesh, up: Vec3, path: &Path) -> Result<(), Failure> {
        let bytes = match self {
            Self::Ply => ply::write(mesh),
            Self::Glb => glb::write(mesh, up),
            Self::Obj => obj::write(mesh),
        };
        fs::write(path, bytes).map_err(|error| Failure::file("write", path, error))
    }
}
