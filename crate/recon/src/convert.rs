//! From the scan's types to the volume's and the mesh's: neither room knows the other.

use glam::{Affine3A, DVec3, Vec3};
use mesh::{Mesh, camera::Pinhole};
use scan::{Camera, ColorImage, DepthImage, Frame, Scan};
use stereo::DepthMap;
use volume::DepthView;

/// A frame's pictures as the volume takes them, the sensor's depth and colour where there is any.
pub(crate) fn depth_view<'a>(
    frame: &Frame,
    depth: &'a DepthImage,
    color: Option<&'a ColorImage>,
) -> DepthView<'a> {
    DepthView {
        depth_m: &depth.depth_m,
        depth_camera: pinhole(&frame.depth_camera),
        confidence: None,
        color: color.map(|image| (image.rgb.as_slice(), pinhole(&frame.color_camera))),
        world_from_camera: pose(frame),
    }
}

/// A keyframe's depth that was made from colour, as the volume takes it, with the frame's own picture.
pub(crate) fn stereo_view<'a>(
    frame: &Frame,
    map: &'a DepthMap,
    color: Option<&'a ColorImage>,
) -> DepthView<'a> {
    DepthView {
        depth_m: &map.depth_m,
        depth_camera: pinhole(&map.camera),
        confidence: Some(&map.confidence),
        color: color.map(|image| (image.rgb.as_slice(), pinhole(&frame.color_camera))),
        world_from_camera: pose(frame),
    }
}

/// A frame's pose, camera to canonical world, in single precision.
pub fn pose(frame: &Frame) -> Affine3A {
    Affine3A::from_mat4(glam::DMat4::from(frame.pose).as_mat4())
}

/// Puts a mesh from the canonical world where exports lie: in the scan's own world, or left as it is for `canonical`.
/// Gives back which way is up there.
pub fn place(mesh: &mut Mesh, scan: &Scan, canonical: bool) -> Vec3 {
    if canonical {
        return Vec3::Z;
    }
    let scan_from_canonical = scan.scan_from_canonical();
    mesh.transform(&scan_from_canonical);
    up(scan)
}

/// Which way is up in the scan's own world.
pub fn up(scan: &Scan) -> Vec3 {
    let scan_from_canonical = scan.scan_from_canonical();
    scan_from_canonical.transform_vector3(DVec3::Z).as_vec3()
}

/// A scan's camera as the mesh's rasteriser and the volume take it.
pub fn pinhole(camera: &Camera) -> Pinhole {
    Pinhole {
        width: camera.width,
        height: camera.height,
        fx: camera.fx as f32,
        fy: camera.fy as f32,
        cx: camera.cx as f32,
        cy: camera.cy as f32,
    }
}
