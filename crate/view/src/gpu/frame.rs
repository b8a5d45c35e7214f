//! What the shaders are told about one picture (`View` in view.wgsl).

use crate::look::{Look, MANY_VIEWS, RAMP, Shading, UNKNOWN, Viewport, depth_range_m, unit};
use crate::{Arena, OrbitCamera};
use glam::{Mat4, Vec3};

/// The uniform buffer's content, laid out as WGSL does.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    clip_from_world: [[f32; 4]; 4],
    eye_m: [f32; 3],
    shading: u32,
    forward: [f32; 3],
    target_is_srgb: u32,
    viewport_px: [f32; 2],
    depth_range_m: [f32; 2],
    wire: [f32; 4],
    background: [f32; 4],
    unknown: [f32; 4],
    ramp: [[f32; 4]; 9],
}

impl Frame {
    pub(super) fn new(
        clip_from_world: Mat4,
        viewport: Viewport,
        camera: &OrbitCamera,
        arena: &Arena,
        look: &Look,
        target_is_srgb: bool,
    ) -> Self {
        let with = |rgb: [u8; 3], a: f32| unit(rgb).extend(a).to_array();
        Self {
            clip_from_world: clip_from_world.to_cols_array_2d(),
            eye_m: camera.eye_m().to_array(),
            shading: match look.shading {
                Shading::Color => 0,
                Shading::Normal => 1,
                Shading::Depth => 2,
                Shading::Wireframe => 3,
                Shading::Confidence => 4,
                Shading::Views => 5,
            },
            forward: camera.axes().2.to_array(),
            target_is_srgb: target_is_srgb.into(),
            viewport_px: viewport.size_px().to_array(),
            depth_range_m: depth_range_m(camera, arena.bounds()),
            wire: with(look.theme.wire, viewport.scale),
            background: with(look.theme.background, 1.0),
            unknown: with(UNKNOWN, MANY_VIEWS.log2()),
            ramp: RAMP.map(|rgb| with(rgb, 1.0)),
        }
    }
}

/// The colour to clear with; a target that encodes sRGB is cleared with linear values.
pub(super) fn clear_color(background: [u8; 3], target_is_srgb: bool) -> wgpu::Color {
    let linear = |c: f32| {
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    let srgb = unit(background);
    let c: Vec3 = if target_is_srgb {
        srgb.map(linear)
    } else {
        srgb
    };
    wgpu::Color {
        r: c.x.into(),
        g: c.y.into(),
        b: c.z.into(),
        a: 1.0,
    }
}
