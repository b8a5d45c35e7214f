//! Colours of the surface: the mean of what the keyframes that see a place show there.

use super::{levels::Field, pictures::Pictures, tiles::Tiling};
use crate::{
    convert::pinhole,
    event::{Flow, Sink, Stage},
    run::{Fusion, RunError, color},
};
use glam::{IVec3, Vec3};
use mesh::raster::{self, Cull};
use net::Level;
use rayon::prelude::*;
use scan::Scan;
use std::collections::HashMap;
use volume::Point;

/// A place is seen if the mesh, drawn into the view, is not farther from it than this along the optical axis, in metres.
const SAME_SURFACE_M: f32 = 0.06;
/// The mesh is cut away nearer to the camera than this, in metres.
const NEAR_M: f32 = 0.05;

/// A fine site beside the surface, and where the surface passes it.
pub(super) struct Beside {
    /// Index of the site.
    site: usize,
    /// The mean of the surface's crossings on the six edges around the site, in fine voxels from the lattice's corner.
    place: Vec3,
}

/// Sites with the surface between them and a neighbour: those that vertices take their colours from.
pub(super) fn surface(field: &Field) -> Vec<Beside> {
    let known = field.sites.iter().zip(&field.distances);
    let known: HashMap<IVec3, f32> = known.map(|(&site, &distance)| (site, distance)).collect();
    let beside = |(site, (&at, &here)): (usize, (&IVec3, &f32))| {
        let mut sum = Vec3::ZERO;
        let mut crossings = 0;
        for axis in IVec3::AXES {
            for step in [axis, -axis] {
                // As marching cubes decides it.
                let there = known.get(&(at + step)).copied();
                if let Some(there) = there.filter(|&there| (there < 0.0) != (here < 0.0)) {
                    sum += at.as_vec3() + step.as_vec3() * (here / (here - there));
                    crossings += 1;
                }
            }
        }
        (crossings > 0).then(|| Beside {
            site,
            place: sum / crossings as f32,
        })
    };
    let sites = field.sites.par_iter().zip(&field.distances).enumerate();
    sites.filter_map(beside).collect()
}

/// Gives the points beside the surface their colours, keyframe by keyframe. A picture that cannot be decoded again is
/// reported. When the sink stops it, colours of the keyframes so far are left.
pub(super) async fn paint<P>(
    scan: &Scan,
    pictures: &Pictures<'_, P>,
    tiling: &Tiling,
    surface: &[Beside],
    points: &mut [Point],
    fusion: &mut Fusion,
    sink: &mut impl Sink,
) -> Result<(), RunError> {
    let all: Vec<_> = pictures.all().collect();
    sink.stage(Stage::Coloring, all.len());
    let mesh = fusion.volume.mesh().await?;
    let voxel_m = Level::Fine.voxel_size_m();
    let places_m: Vec<Vec3> = surface
        .iter()
        .map(|beside| beside.place * voxel_m + tiling.origin_m)
        .collect();
    let mut sums = vec![[0.0f32; 4]; surface.len()];
    for (done, picture) in all.into_iter().enumerate() {
        if sink.checkpoint().await == Flow::Stop {
            fusion.stopped = true;
            break;
        }
        if let Some(image) = color(scan, picture.frame, sink) {
            let view = &picture.view;
            let camera_from_world = view.world_from_camera.inverse();
            let near = raster::depth(&mesh, &view.camera, &camera_from_world, Cull::None, NEAR_M);
            let camera = pinhole(&scan.frames()[picture.frame].color_camera);
            sums.par_iter_mut()
                .zip(&places_m)
                .for_each(|(sum, &place)| {
                    let place = camera_from_world.transform_point3(place);
                    if place.z < NEAR_M {
                        return;
                    }
                    let drawn = pixel(&view.camera, place).map(|pixel| near[pixel]);
                    let seen =
                        drawn.is_some_and(|z| z > 0.0 && (z - place.z).abs() < SAME_SURFACE_M);
                    if let (true, Some(pixel)) = (seen, pixel(&camera, place)) {
                        // Near pictures show it best.
                        let weight = 1.0 / (place.z * place.z);
                        for (sum, &value) in sum.iter_mut().zip(&image.rgb[pixel * 3..][..3]) {
                            *sum += weight * f32::from(value);
                        }
                        sum[3] += weight;
                    }
                });
        }
        sink.progress(done + 1);
    }
    for (beside, [r, g, b, weight]) in surface.iter().zip(sums) {
        points[beside.site].color =
            (weight > 0.0).then(|| [r, g, b].map(|sum| (sum / weight).round() as u8));
    }
    Ok(())
}

/// Index of the pixel that a point in camera coordinates falls on.
fn pixel(camera: &mesh::camera::Pinhole, point: Vec3) -> Option<usize> {
    let pixel = camera.project(point).round();
    let inside = pixel.x >= 0.0
        && pixel.y >= 0.0
        && pixel.x < camera.width as f32
        && pixel.y < camera.height as f32;
    inside.then(|| pixel.y as usize * camera.width as usize + pixel.x as usize)
}
