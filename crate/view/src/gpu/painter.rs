//! One picture of the scene into a texture: the surface, then the lines, with multisampling.

use super::frame::{Frame, clear_color};
use super::pick::{Picker, Picking};
use super::pipelines::{DEPTH_FORMAT, Pipelines};
use super::scene::Scene;
use crate::OrbitCamera;
use crate::lines::{self, Line};
use crate::look::Viewport;
use glam::Vec2;

/// The textures drawn into before the target, by size.
struct Attachments {
    width_px: u32,
    height_px: u32,
    /// `None` without multisampling.
    color: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

/// Draws scenes with wgpu. Needs WebGPU's default limits and no optional feature.
pub struct GpuPainter {
    device: wgpu::Device,
    queue: wgpu::Queue,
    format: wgpu::TextureFormat,
    samples: u32,
    pipelines: Pipelines,
    frame: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    attachments: Option<Attachments>,
    lines: Vec<Line>,
    line_buffer: Option<wgpu::Buffer>,
    picker: Picker,
}

impl GpuPainter {
    /// A painter for targets of `format`, with 4 samples a pixel where the format has them.
    /// `multisample` false draws with one: kinder to a processor that plays GPU.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        multisample: bool,
    ) -> Self {
        let can = format.guaranteed_format_features(device.features()).flags;
        let resolves = can.sample_count_supported(4)
            && can.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let samples = if multisample && resolves { 4 } else { 1 };
        let pipelines = Pipelines::new(device, format, samples);
        let (frame, frame_group) = pipelines.frame_binding(device);
        let picker = Picker::new(device, &pipelines);
        Self {
            device: device.clone(),
            queue: queue.clone(),
            format,
            samples,
            pipelines,
            frame,
            frame_group,
            attachments: None,
            lines: Vec::new(),
            line_buffer: None,
            picker,
        }
    }

    /// Records one picture into `target` (the painter's format, `viewport`'s size). One picture a
    /// submit: the view's numbers are written before the submit begins.
    pub fn paint(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        viewport: Viewport,
        camera: &OrbitCamera,
        scene: &Scene<'_>,
    ) {
        let clip_from_world = viewport.clip_from_world(camera);
        let target_is_srgb = self.format.is_srgb();
        let frame = Frame::new(
            clip_from_world,
            viewport,
            camera,
            scene.arena,
            scene.look,
            target_is_srgb,
        );
        self.queue
            .write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        self.update_lines(scene);

        let attachments = match self.attachments.take() {
            Some(kept) if kept.fits(viewport) => kept,
            _ => Attachments::new(&self.device, viewport, self.format, self.samples),
        };
        let (view, resolve_target) = match &attachments.color {
            Some(color) => (color, Some(target)),
            None => (target, None),
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(clear_color(
                        scene.look.theme.background,
                        target_is_srgb,
                    )),
                    store: match resolve_target {
                        Some(_) => wgpu::StoreOp::Discard,
                        None => wgpu::StoreOp::Store,
                    },
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &attachments.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.frame_group, &[]);
        pass.set_pipeline(self.pipelines.surface.get(scene.look.cull_back));
        for (page, ranges) in scene.arena.draws(&clip_from_world) {
            pass.set_vertex_buffer(0, page.slice(..));
            for range in ranges {
                pass.draw(range, 0..1);
            }
        }
        if let Some(buffer) = &self.line_buffer {
            pass.set_pipeline(&self.pipelines.lines);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..6, 0..self.lines.len() as u32);
        }
        drop(pass);
        self.attachments = Some(attachments);
    }

    /// Asks what surface lies at `at_px` (device pixels from the top left). The answer comes
    /// through [`GpuPainter::picking`]; a question while one is open is dropped.
    pub fn pick(
        &mut self,
        at_px: Vec2,
        viewport: Viewport,
        camera: &OrbitCamera,
        scene: &Scene<'_>,
    ) {
        let (device, queue) = (&self.device, &self.queue);
        self.picker.ask(
            device,
            queue,
            &self.pipelines,
            (at_px, viewport, camera),
            scene,
        );
    }

    /// How the last [`GpuPainter::pick`] stands; a done answer is given once.
    pub fn picking(&mut self) -> Picking {
        self.picker.poll()
    }

    /// Uploads the lines when they are not those on the GPU already.
    fn update_lines(&mut self, scene: &Scene<'_>) {
        let lines = lines::of_scene(scene.arena.bounds(), scene.frusta, scene.look);
        if lines == self.lines {
            return;
        }
        let bytes: &[u8] = bytemuck::cast_slice(&lines);
        let room = self.line_buffer.as_ref().map_or(0, wgpu::Buffer::size);
        if lines.is_empty() {
            self.line_buffer = None;
        } else if room < bytes.len() as u64 {
            self.line_buffer = Some(self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("lines"),
                size: (bytes.len() as u64).next_power_of_two(),
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        if let Some(buffer) = &self.line_buffer {
            self.queue.write_buffer(buffer, 0, bytes);
        }
        self.lines = lines;
    }
}

impl Attachments {
    fn new(
        device: &wgpu::Device,
        viewport: Viewport,
        format: wgpu::TextureFormat,
        samples: u32,
    ) -> Self {
        let (width_px, height_px) = (viewport.width_px.max(1), viewport.height_px.max(1));
        let texture = |format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("scene"),
                size: wgpu::Extent3d {
                    width: width_px,
                    height: height_px,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        Self {
            width_px,
            height_px,
            color: (samples > 1).then(|| texture(format)),
            depth: texture(DEPTH_FORMAT),
        }
    }

    fn fits(&self, viewport: Viewport) -> bool {
        self.width_px == viewport.width_px.max(1) && self.height_px == viewport.height_px.max(1)
    }
}
