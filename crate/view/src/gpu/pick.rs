//! What lies under the cursor: the scene's depth drawn into a single pixel and read back.
//!
//! One draw of the bricks on the cursor's ray, four bytes back, no waiting: the answer is polled
//! for. Asking the GPU rather than boxes keeps the answer on the surface that is really seen, with
//! the walls that are left out left out.

use super::frame::Frame;
use super::pipelines::{DEPTH_FORMAT, PICK_FORMAT, Pipelines};
use super::scene::Scene;
use crate::look::Viewport;
use crate::{OrbitCamera, Ray};
use glam::{Mat4, Vec2, Vec3, Vec4};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

const OPEN: u8 = 0;
const READY: u8 = 1;
const FAILED: u8 = 2;

/// How a question what lies under the cursor stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Picking {
    /// Nothing was asked, or the answer has been given.
    Idle,
    /// The GPU is at it: poll again.
    Pending,
    /// The surface point (metres, world), or `None` where there is no surface.
    Done(Option<Vec3>),
}

struct Question {
    ray: Ray,
    forward: Vec3,
    state: Arc<AtomicU8>,
}

pub(super) struct Picker {
    frame: wgpu::Buffer,
    group: wgpu::BindGroup,
    pixel: wgpu::Texture,
    depth: wgpu::TextureView,
    readback: wgpu::Buffer,
    question: Option<Question>,
}

impl Picker {
    pub(super) fn new(device: &wgpu::Device, pipelines: &Pipelines) -> Self {
        let (frame, group) = pipelines.frame_binding(device);
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("pick"),
                size: wgpu::Extent3d::default(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        Self {
            frame,
            group,
            pixel: texture(PICK_FORMAT, wgpu::TextureUsages::COPY_SRC),
            depth: texture(DEPTH_FORMAT, wgpu::TextureUsages::empty())
                .create_view(&wgpu::TextureViewDescriptor::default()),
            readback: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pick"),
                size: 4,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            question: None,
        }
    }

    pub(super) fn ask(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pipelines: &Pipelines,
        (at_px, viewport, camera): (Vec2, Viewport, &OrbitCamera),
        scene: &Scene<'_>,
    ) {
        if self.question.is_some() {
            return;
        }
        let ndc = viewport.ndc(at_px);
        let clip_from_world = only_at(ndc, viewport.size_px()) * viewport.clip_from_world(camera);
        let frame = Frame::new(
            clip_from_world,
            viewport,
            camera,
            scene.arena,
            scene.look,
            false,
        );
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));

        let mut encoder = device.create_command_encoder(&Default::default());
        let pixel = self
            .pixel
            .create_view(&wgpu::TextureViewDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("pick"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &pixel,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_pipeline(pipelines.pick.get(scene.look.cull_back));
        for (page, ranges) in scene.arena.draws(&clip_from_world) {
            pass.set_vertex_buffer(0, page.slice(..));
            for range in ranges {
                pass.draw(range, 0..1);
            }
        }
        drop(pass);
        encoder.copy_texture_to_buffer(
            self.pixel.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.readback,
                layout: wgpu::TexelCopyBufferLayout::default(),
            },
            wgpu::Extent3d::default(),
        );
        queue.submit([encoder.finish()]);

        let state = Arc::new(AtomicU8::new(OPEN));
        let told = state.clone();
        self.readback
            .map_async(wgpu::MapMode::Read, .., move |result| {
                let outcome = if result.is_ok() { READY } else { FAILED };
                told.store(outcome, Ordering::Release);
            });
        self.question = Some(Question {
            ray: camera.ray(ndc, viewport.aspect()),
            forward: camera.axes().2,
            state,
        });
    }

    pub(super) fn poll(&mut self) -> Picking {
        let Some(question) = &self.question else {
            return Picking::Idle;
        };
        let state = question.state.load(Ordering::Acquire);
        if state == OPEN {
            return Picking::Pending;
        }
        let depth_m = (state == READY).then(|| self.read_m()).flatten();
        let point = depth_m.map(|depth_m| {
            let Ray {
                origin_m,
                direction,
            } = question.ray;
            origin_m + direction * (depth_m / direction.dot(question.forward))
        });
        self.question = None;
        Picking::Done(point)
    }

    /// The view depth that was drawn, if any.
    fn read_m(&self) -> Option<f32> {
        let bytes = self.readback.get_mapped_range(..).ok()?;
        let depth_m: f32 = bytemuck::pod_read_unaligned(&bytes);
        drop(bytes);
        self.readback.unmap();
        (depth_m > 0.0).then_some(depth_m)
    }
}

/// The clip map that blows the pixel at `ndc` of a `size` picture up to a whole one-pixel picture.
fn only_at(ndc: Vec2, size: Vec2) -> Mat4 {
    Mat4::from_cols(
        Vec4::new(size.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, size.y, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(-ndc.x * size.x, -ndc.y * size.y, 0.0, 1.0),
    )
}
