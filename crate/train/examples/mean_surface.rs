//! The constant guess: the surface of the mean signed distance of many rooms, which looks at no picture. What a trained
//! network has to be better than.
//!
//! `mean_surface OUT.ply FOLDER...`

use std::collections::HashMap;
use std::error::Error;
use std::path::PathBuf;

use burn::tensor::Device;
use glam::IVec3;
use train::data::ScanSet;
use train::data::volume::{SATURATED, VOXEL_M};
use volume::{Point, VolumeConfig};

fn main() -> Result<(), Box<dyn Error>> {
    let mut paths = std::env::args().skip(1).map(PathBuf::from);
    let out = paths
        .next()
        .ok_or("expected a PLY file to write, then folders of scans with depth")?;
    let folders: Vec<PathBuf> = paths.collect();
    let scans = ScanSet::from_paths(&folders, 1, 3.0, None)?;
    // Sum of the distances at a lattice point, and how many rooms have it inside their bounds.
    let mut sums: HashMap<IVec3, (i32, i32)> = HashMap::new();
    for index in 0..scans.entries.len() {
        let truth = scans.truth(index, &scans.open(index)?)?;
        let [nx, ny, _] = truth.size;
        for (i, &value) in truth.values.iter().enumerate() {
            let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|v| v as i32);
            let sum = sums.entry(truth.start + IVec3::from_array(at)).or_default();
            sum.0 += i32::from(value);
            sum.1 += 1;
        }
    }
    // Where fewer than half of the rooms reach, a guess would be one about few rooms.
    let enough = scans.entries.len() as i32 / 2;
    let points: Vec<Point> = sums
        .iter()
        .filter(|(_, (_, rooms))| *rooms >= enough)
        .map(|(place, (sum, rooms))| Point {
            place: *place,
            distance: *sum as f32 / (*rooms as f32 * f32::from(SATURATED)),
            color: None,
            evidence: volume::Evidence::default(),
        })
        .collect();
    let config = VolumeConfig {
        binding_bytes: 1 << 30,
        ..VolumeConfig::uniform(VOXEL_M)
    };
    let mut volume = config.init(&Device::flex())?;
    volume.set_points(&points)?;
    let mesh = pollster::block_on(volume.mesh())?;
    std::fs::write(&out, mesh::ply::write(&mesh))?;
    println!(
        "{}: {} vertices, {} triangles, the mean of {} rooms",
        out.display(),
        mesh.positions.len(),
        mesh.triangles.len(),
        scans.entries.len()
    );
    Ok(())
}
