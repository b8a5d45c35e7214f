//! Rays of a training scan on a GPU: what they meet, and the light there. Patterns and the camera stay on the processor,
//! so that a surface has one definition.

use std::ops::Range;
use std::sync::mpsc;

use glam::{Vec2, Vec3, Vec4};

use crate::path::View;
use crate::point::Point;
use crate::solid::Shape;
use crate::training::light::{Arriving, probes};
use crate::training::plan::HALF_WALL_M;
use crate::training::room::{MOST_LIGHTS, TrainingRoom};
use crate::training::scan::TrainingScan;

/// 32-bit words that the shader writes for a pixel.
const WORDS: usize = 10;
const MOST_AREAS: usize = 8;

/// Casts the rays of training scans on a device that the caller owns.
pub struct GpuTracer {
    name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
}

/// Why a GPU gave no pictures.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is none, or only a processor that plays one.
    #[error("expected a GPU, found {0}; make the scans on the processor instead")]
    Missing(String),
    /// It stopped working.
    #[error(
        "expected the GPU to hand back what its rays met: {0}; make the scans on the processor instead"
    )]
    Lost(String),
}

/// What the rays of one frame met, before surfaces and the camera.
pub struct Gathered {
    /// Which frame.
    pub index: usize,
    words: Vec<u32>,
}

impl GpuTracer {
    /// Opens the fastest adapter; one that is a program on the processor only with `software`.
    ///
    /// # Errors
    /// There is no such adapter, or it gives no device.
    pub fn open(software: bool) -> Result<Self, GpuError> {
        let missing = |found: &dyn std::fmt::Display| GpuError::Missing(found.to_string());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let wish = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter =
            pollster::block_on(instance.request_adapter(&wish)).map_err(|e| missing(&e))?;
        let info = adapter.get_info();
        if info.device_type == wgpu::DeviceType::Cpu && !software {
            return Err(missing(&format!(
                "{}, which is slower than the processor itself",
                info.name
            )));
        }
        let wish = wgpu::DeviceDescriptor {
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&wish)).map_err(|e| missing(&e))?;
        Ok(Self {
            name: info.name,
            ..Self::new(device, queue)
        })
    }

    /// What the device calls itself, where [`GpuTracer::open`] found it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Compiles the shader for `device`.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("rays.wgsl"));
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("rays"),
            layout: None,
            module: &module,
            entry_point: Some("gather"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self {
            name: String::new(),
            device,
            queue,
            pipeline,
        }
    }

    /// How many frames of a size may be asked for at once.
    pub fn most_frames(&self, width: u32, height: u32) -> usize {
        let limits = self.device.limits();
        let bytes = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size)
            .min(64 << 20);
        let frame = u64::from(width) * u64::from(height) * WORDS as u64 * 4;
        ((bytes / frame.max(1)) as usize).max(1)
    }

    /// Casts the rays of some frames of `scan`, at most [`GpuTracer::most_frames`]; [`TrainingScan::frame_of`] makes
    /// pictures of them.
    ///
    /// # Errors
    /// The device was lost, or the frames are more than it can hold.
    pub fn gather(
        &self,
        scan: &TrainingScan,
        frames: Range<usize>,
    ) -> Result<Vec<Gathered>, GpuError> {
        let views = &scan.views()[frames.clone()];
        let Some(camera) = views.first().map(|view| view.camera) else {
            return Ok(Vec::new());
        };
        let words = camera.width as usize * camera.height as usize * WORDS;
        let (nodes, solids) = geometry(scan.room());
        let result = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("what rays met"),
            size: (words * views.len() * 4) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("what rays met, to read"),
            size: result.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let inputs = [
            self.filled("nodes", &nodes),
            self.filled("solids", &solids),
            self.filled("scene", &surroundings(scan.room(), views)),
        ];
        let buffers = inputs.iter().chain([&result]);
        let entries: Vec<_> = buffers
            .enumerate()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: binding as u32,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("rays"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(
                camera.width.div_ceil(8),
                camera.height.div_ceil(8),
                views.len() as u32,
            );
        }
        encoder.copy_buffer_to_buffer(&result, 0, &staging, 0, result.size());
        let done = self.queue.submit([encoder.finish()]);
        let (told, heard) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = told.send(result);
        });
        let wait = wgpu::PollType::Wait {
            submission_index: Some(done),
            timeout: None,
        };
        self.device
            .poll(wait)
            .map_err(|error| GpuError::Lost(error.to_string()))?;
        let mapped = heard
            .recv()
            .map_err(|error| GpuError::Lost(error.to_string()))?;
        mapped.map_err(|error| GpuError::Lost(error.to_string()))?;
        let bytes = staging
            .get_mapped_range(..)
            .map_err(|error| GpuError::Lost(error.to_string()))?;
        let gathered = frames
            .zip(bytes.chunks(words * 4))
            .map(|(index, bytes)| Gathered {
                index,
                words: bytemuck::pod_collect_to_vec(bytes),
            })
            .collect();
        Ok(gathered)
    }

    fn filled(&self, label: &str, words: &[u32]) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (words.len() * 4) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue
            .write_buffer(&buffer, 0, bytemuck::cast_slice(words));
        buffer
    }
}

fn push(words: &mut Vec<u32>, v: Vec4) {
    words.extend(v.to_array().map(f32::to_bits));
}

/// The tree's nodes and the solids in the order of its leaves, as the shader reads them.
fn geometry(room: &TrainingRoom) -> (Vec<u32>, Vec<u32>) {
    let mut nodes = Vec::new();
    for (low, high, first, count) in room.scene.bvh.nodes() {
        nodes.extend(low.to_array().map(f32::to_bits));
        nodes.push(first);
        nodes.extend(high.to_array().map(f32::to_bits));
        nodes.push(count);
    }
    let mut solids = Vec::new();
    for &index in room.scene.bvh.order() {
        let solid = &room.scene.solids[index as usize];
        let (size, kind) = match solid.shape {
            Shape::Block { half_m, round_m } => (
                half_m.extend(round_m),
                if round_m == 0.0 { 0.0 } else { 1.0 },
            ),
            Shape::Drum {
                bottom_m,
                top_m,
                half_m,
                round_m,
            } => (Vec4::new(bottom_m, top_m, half_m, round_m), 2.0),
        };
        let half = solid.shape.half_size();
        let tone = solid.look.tones[0].lerp(solid.look.tones[1], 0.5);
        let bits = u8::from(solid.casts_shadow) | u8::from(solid.look.gloss > 0.0) << 1;
        push(&mut solids, size);
        push(&mut solids, solid.center.extend(kind));
        for axis in 0..3 {
            push(&mut solids, solid.axes.col(axis).extend(half[axis]));
        }
        push(&mut solids, tone.extend(f32::from(bits)));
    }
    (nodes, solids)
}

/// Probes, lights, ambient light and cameras, as the shader reads them.
fn surroundings(room: &TrainingRoom, views: &[View]) -> Vec<u32> {
    let mut areas: Vec<_> = room
        .plan
        .spaces
        .iter()
        .zip(&room.ambient)
        .flat_map(|(space, ambient)| {
            space
                .areas
                .iter()
                .map(|area| (area.grown(HALF_WALL_M), *ambient))
        })
        .collect();
    areas.truncate(MOST_AREAS);
    let camera = views[0].camera;
    let mut words = vec![
        camera.width,
        camera.height,
        room.lights.len() as u32,
        areas.len() as u32,
    ];
    for probe in probes() {
        push(&mut words, probe.dir.extend(0.0));
        push(
            &mut words,
            Vec4::new(probe.spot[0], probe.spot[1], 0.0, 0.0),
        );
    }
    for i in 0..MOST_LIGHTS {
        let parts = room.lights.get(i).map_or([Vec4::ZERO; 5], |light| {
            let size = light.spread[0].length_squared() + light.spread[1].length_squared();
            [
                light.center.extend(0.0),
                light.spread[0].extend(0.0),
                light.spread[1].extend(0.0),
                light.facing.extend(0.0),
                light.power.extend(size),
            ]
        });
        parts.into_iter().for_each(|part| push(&mut words, part));
    }
    for i in 0..MOST_AREAS {
        let (corners, ambient) =
            areas
                .get(i)
                .map_or((Vec4::ZERO, Vec3::ZERO), |(area, ambient)| {
                    (
                        Vec4::new(area.low.x, area.low.y, area.high.x, area.high.y),
                        *ambient,
                    )
                });
        push(&mut words, corners);
        push(&mut words, ambient.extend(0.0));
    }
    for view in views {
        let lens = [
            view.camera.fx,
            view.camera.fy,
            view.camera.cx,
            view.camera.cy,
        ]
        .map(|v| v as f32);
        for axis in 0..3 {
            push(&mut words, view.rotation.col(axis).extend(0.0));
        }
        push(&mut words, view.position_m.extend(0.0));
        push(&mut words, Vec4::from(lens));
    }
    words
}

impl Gathered {
    /// Points without their albedo, and the light that arrives at them.
    pub(crate) fn read(&self, room: &TrainingRoom, view: &View) -> (Vec<Point>, Vec<Arriving>) {
        let order = room.scene.bvh.order();
        let width = view.camera.width as usize;
        self.words
            .chunks_exact(WORDS)
            .enumerate()
            .map(|(i, words)| {
                let dir = view.ray((i % width) as f32, (i / width) as f32).normalize();
                let t = f32::from_bits(words[0]);
                if t == 0.0 {
                    return (
                        Point {
                            dir,
                            ..Point::default()
                        },
                        Arriving::default(),
                    );
                }
                let [xy, zc] = [words[2], words[3]].map(signed);
                let normal = Vec3::new(xy.x, xy.y, zc.x).normalize_or(-dir);
                let light: Vec<f32> = words[4..].iter().flat_map(|word| halves(*word)).collect();
                let rgb = |at: usize| Vec3::new(light[at], light[at + 1], light[at + 2]);
                let point = Point {
                    solid: order[words[1] as usize],
                    t,
                    at: view.position_m + dir * t,
                    normal,
                    albedo: Vec3::ZERO,
                    dir,
                };
                let light = Arriving {
                    crisp: rgb(0),
                    soft: rgb(3),
                    shine: rgb(6),
                    around: rgb(9),
                    certainty: zc.y,
                };
                (point, light)
            })
            .unzip()
    }
}

/// Two numbers of -1 to 1 in 16 bits each.
fn signed(word: u32) -> Vec2 {
    let part = |bits: u16| f32::from(bits.cast_signed()) / 32767.0;
    Vec2::new(part(word as u16), part((word >> 16) as u16))
}

/// Two positive numbers of 16-bit floating point.
fn halves(word: u32) -> [f32; 2] {
    [word as u16, (word >> 16) as u16].map(|bits| {
        let (exponent, fraction) = (u32::from(bits >> 10) & 31, u32::from(bits) & 0x3FF);
        match exponent {
            // Subnormal.
            0 => fraction as f32 / (1 << 24) as f32,
            _ => f32::from_bits((exponent + 112) << 23 | fraction << 13),
        }
    })
}
