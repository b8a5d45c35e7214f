//! What the visitor looks at: the canvas, the painter that fits the device, and the camera in the visitor's hands.

use crate::handoff::{self, Soup};
use glam::Vec2;
use js_sys::Object;
use mesh::Bounds;
use view::{
    Arena, Controls, CpuPainter, Frusta, GpuPainter, Input, Look, Picking, Scene, Viewport,
};
use volume::{BrickMeshes, VolumeError};
use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{ImageData, OffscreenCanvas, OffscreenCanvasRenderingContext2d};

/// Bytes of the arena's buffers: a few thousand bricks each, far below every device's limit.
const PAGE_BYTES: u64 = 8 << 20;
/// The controls take no more than this in one step; and motion has long come to rest after this.
const CONTROLS_STEP_S: f32 = 0.1;
const MOTION_S: f32 = 2.0;
/// Bricks are as large as those of 4 cm voxels until a run says otherwise.
const FIRST_BRICK_SIZE_M: f32 = 0.32;

/// A wgpu device that burn computes on too.
pub struct Gpu {
    pub instance: wgpu::Instance,
    pub adapter: wgpu::Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// A processor plays GPU: fewer samples a pixel.
    pub is_software: bool,
}

/// The canvas and everything on it.
pub struct Stage {
    canvas: OffscreenCanvas,
    paper: Paper,
    pub controls: Controls,
    pub look: Look,
    pub frusta: Frusta,
    pick_at: Option<Vec2>,
}

// One of each in a worker: the difference in size costs nothing.
#[allow(clippy::large_enum_variant)]
enum Paper {
    Gpu {
        gpu: Gpu,
        surface: wgpu::Surface<'static>,
        config: wgpu::SurfaceConfiguration,
        painter: GpuPainter,
        arena: Arena,
    },
    Cpu {
        context: OffscreenCanvasRenderingContext2d,
        painter: CpuPainter,
    },
}

impl Stage {
    /// A stage on the device that burn computes on.
    pub fn on_gpu(canvas: OffscreenCanvas, gpu: Gpu) -> Result<Self, String> {
        let target = wgpu::SurfaceTarget::OffscreenCanvas(canvas.clone());
        let surface = gpu.instance.create_surface(target);
        let surface = surface.map_err(|error| error.to_string())?;
        let config = surface
            .get_default_config(&gpu.adapter, canvas.width().max(1), canvas.height().max(1))
            .ok_or("the canvas offers no format that this adapter can draw")?;
        surface.configure(&gpu.device, &config);
        let painter = GpuPainter::new(&gpu.device, &gpu.queue, config.format, !gpu.is_software);
        let arena = Arena::new(&gpu.device, PAGE_BYTES, FIRST_BRICK_SIZE_M);
        Ok(Self::new(
            canvas,
            Paper::Gpu {
                gpu,
                surface,
                config,
                painter,
                arena,
            },
        ))
    }

    /// A stage that is painted by the processor.
    pub fn on_cpu(canvas: OffscreenCanvas) -> Result<Self, String> {
        // Opaque: the page behind never shows, and the browser need not blend.
        let options = Object::new();
        let _ = js_sys::Reflect::set(&options, &"alpha".into(), &JsValue::FALSE);
        let context = canvas.get_context_with_context_options("2d", &options);
        let context = context
            .ok()
            .flatten()
            .ok_or("the canvas has no 2D context")?;
        let context = context.unchecked_into();
        let painter = CpuPainter::new(FIRST_BRICK_SIZE_M);
        Ok(Self::new(canvas, Paper::Cpu { context, painter }))
    }

    fn new(canvas: OffscreenCanvas, paper: Paper) -> Self {
        Self {
            canvas,
            paper,
            controls: Controls::default(),
            look: Look::default(),
            frusta: Frusta::default(),
            pick_at: None,
        }
    }

    /// Takes all bricks away, before those of another size.
    pub fn clear(&mut self, brick_size_m: f32) {
        match &mut self.paper {
            Paper::Gpu { gpu, arena, .. } => {
                *arena = Arena::new(&gpu.device, PAGE_BYTES, brick_size_m);
            }
            Paper::Cpu { painter, .. } => *painter = CpuPainter::new(brick_size_m),
        }
    }

    /// Shows new versions of bricks that are on the stage's own device.
    pub fn show(&mut self, meshes: BrickMeshes) -> Result<(), VolumeError> {
        if let Paper::Gpu { gpu, arena, .. } = &mut self.paper {
            handoff::to_arena(meshes, arena, &gpu.device, &gpu.queue)?;
        }
        self.surround();
        Ok(())
    }

    /// Shows new versions of bricks that are in main memory.
    pub fn show_soup(&mut self, soup: &Soup) -> Result<(), VolumeError> {
        match &mut self.paper {
            Paper::Gpu { gpu, arena, .. } => {
                for (brick, numbers) in soup.bricks() {
                    let inserted = arena.insert_from_slice(&gpu.queue, brick, numbers);
                    inserted.map_err(|error| VolumeError::Device(error.to_string()))?;
                }
            }
            Paper::Cpu { painter, .. } => {
                for (brick, numbers) in soup.bricks() {
                    painter.insert(brick, numbers);
                }
            }
        }
        self.surround();
        Ok(())
    }

    /// Tells the floor and the camera how large the scene is now.
    fn surround(&mut self) {
        let (outline, bounds) = match &self.paper {
            Paper::Gpu { arena, .. } => (arena.outline(), arena.bounds()),
            Paper::Cpu { painter, .. } => (painter.outline(), painter.bounds()),
        };
        if let Some(Bounds { min, .. }) = bounds {
            self.look.floor_height_m = min.z;
        }
        self.controls.set_outline(outline);
    }

    /// Bricks and triangles on show.
    pub fn counts(&self) -> (u32, u32) {
        match &self.paper {
            Paper::Gpu { arena, .. } => (arena.brick_count() as u32, arena.triangle_count() as u32),
            Paper::Cpu { painter, .. } => (
                painter.brick_count() as u32,
                painter.triangle_count() as u32,
            ),
        }
    }

    /// Takes the visitor's input.
    pub fn input(&mut self, input: Input) {
        if let Input::Resize {
            width_px,
            height_px,
            ..
        } = input
        {
            self.resize(width_px.max(1), height_px.max(1));
        }
        self.controls.input(input);
    }

    /// Asks for the surface under a pixel, to make it the centre.
    pub fn focus_at(&mut self, at_px: Vec2) {
        self.pick_at = Some(at_px);
    }

    fn resize(&mut self, width_px: u32, height_px: u32) {
        self.canvas.set_width(width_px);
        self.canvas.set_height(height_px);
        if let Paper::Gpu {
            gpu,
            surface,
            config,
            ..
        } = &mut self.paper
        {
            config.width = width_px;
            config.height = height_px;
            surface.configure(&gpu.device, config);
        }
    }

    /// Moves the camera on by `dt_s` and paints. Whether there is more to come: motion, or an answer to a pick.
    pub fn frame(&mut self, dt_s: f32) -> bool {
        let mut moving = self.controls.tick(dt_s);
        for _ in 1..(dt_s.min(MOTION_S) / CONTROLS_STEP_S) as usize {
            moving = moving && self.controls.tick(CONTROLS_STEP_S);
        }
        self.paint();
        let waiting = self.settle_pick();
        moving || waiting
    }

    fn paint(&mut self) {
        let viewport = self.controls.viewport();
        let camera = *self.controls.camera();
        match &mut self.paper {
            Paper::Gpu {
                gpu,
                surface,
                config,
                painter,
                arena,
            } => {
                use wgpu::CurrentSurfaceTexture::{Outdated, Suboptimal, Success};
                let frame = match surface.get_current_texture() {
                    Success(frame) | Suboptimal(frame) => frame,
                    Outdated => return surface.configure(&gpu.device, config),
                    // The next frame tries again.
                    _ => return,
                };
                let target = frame
                    .texture
                    .create_view(&wgpu::TextureViewDescriptor::default());
                let mut encoder =
                    gpu.device
                        .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                            label: Some("picture"),
                        });
                let scene = Scene {
                    arena,
                    frusta: &self.frusta,
                    look: &self.look,
                };
                painter.paint(&mut encoder, &target, viewport, &camera, &scene);
                gpu.queue.submit([encoder.finish()]);
                gpu.queue.present(frame);
            }
            Paper::Cpu { context, painter } => {
                let Viewport {
                    width_px,
                    height_px,
                    ..
                } = viewport;
                let rgba = painter.paint(viewport, &camera, &self.frusta, &self.look);
                let data =
                    ImageData::new_with_u8_clamped_array_and_sh(Clamped(rgba), width_px, height_px);
                if let Ok(data) = data {
                    let _ = context.put_image_data(&data, 0.0, 0.0);
                }
            }
        }
    }

    /// Whether a pick is still without an answer.
    fn settle_pick(&mut self) -> bool {
        let viewport = self.controls.viewport();
        let camera = *self.controls.camera();
        let asked = self.pick_at.take();
        match &mut self.paper {
            Paper::Gpu { painter, arena, .. } => {
                if let Some(at_px) = asked {
                    let scene = Scene {
                        arena,
                        frusta: &self.frusta,
                        look: &self.look,
                    };
                    painter.pick(at_px, viewport, &camera, &scene);
                }
                match painter.picking() {
                    Picking::Idle | Picking::Done(None) => false,
                    Picking::Pending => true,
                    Picking::Done(Some(point)) => {
                        self.controls.focus(point);
                        true
                    }
                }
            }
            Paper::Cpu { painter, .. } => match asked.and_then(|at_px| painter.pick(at_px)) {
                Some(point) => {
                    self.controls.focus(point);
                    true
                }
                None => false,
            },
        }
    }

    /// The canvas, freshly painted, for a picture of it.
    pub fn painted_canvas(&mut self) -> OffscreenCanvas {
        self.paint();
        self.canvas.clone()
    }

    /// Where the eye is, in words.
    pub fn description(&self) -> String {
        let camera = self.controls.camera();
        let eye = camera.eye_m();
        let (_, _, forward) = camera.axes();
        let pitch_deg = forward.z.clamp(-1.0, 1.0).asin().to_degrees();
        let tilt = match pitch_deg {
            pitch if pitch < -60.0 => "down on",
            pitch if pitch < -15.0 => "slightly down on",
            pitch if pitch > 15.0 => "up at",
            _ => "level at",
        };
        let heading_deg = forward.x.atan2(forward.y).to_degrees().rem_euclid(360.0);
        let height_m = eye.z - self.look.floor_height_m;
        format!(
            "Looking {tilt} the room, heading {heading_deg:.0} degrees, {height_m:.1} m above the floor"
        )
    }
}
