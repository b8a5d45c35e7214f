//! The render pipelines: the surface, the lines, and the surface's depth for picking.

use super::frame::Frame;
use crate::lines::Line;
use mesh::soup::VERTEX_STRIDE_BYTES;

pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const PICK_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// The same drawing with surfaces seen from behind left out or kept.
pub(super) struct BySide {
    front: wgpu::RenderPipeline,
    both: wgpu::RenderPipeline,
}

impl BySide {
    pub(super) fn get(&self, cull_back: bool) -> &wgpu::RenderPipeline {
        if cull_back { &self.front } else { &self.both }
    }
}

pub(super) struct Pipelines {
    pub(super) surface: BySide,
    pub(super) pick: BySide,
    pub(super) lines: wgpu::RenderPipeline,
    frame_layout: wgpu::BindGroupLayout,
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat, samples: u32) -> Self {
        let frame_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let maker = Maker {
            device,
            layout: device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("view"),
                bind_group_layouts: &[Some(&frame_layout)],
                immediate_size: 0,
            }),
        };
        let surface_shader = maker.shader(concat!(
            include_str!("view.wgsl"),
            include_str!("surface.wgsl")
        ));
        let line_shader = maker.shader(concat!(
            include_str!("view.wgsl"),
            include_str!("line.wgsl")
        ));
        let surface = |fragment, format, samples| {
            let side = |cull_mode| {
                maker.pipeline(&Drawing {
                    shader: &surface_shader,
                    vertex: "corner",
                    fragment,
                    vertices: wgpu::VertexBufferLayout {
                        array_stride: VERTEX_STRIDE_BYTES,
                        step_mode: wgpu::VertexStepMode::Vertex,
                        attributes: &wgpu::vertex_attr_array![
                            0 => Float32x3, 1 => Float32, 2 => Float32, 3 => Float32
                        ],
                    },
                    cull_mode,
                    writes_depth: true,
                    target: wgpu::ColorTargetState {
                        format,
                        blend: None,
                        write_mask: wgpu::ColorWrites::ALL,
                    },
                    samples,
                })
            };
            BySide {
                front: side(Some(wgpu::Face::Back)),
                both: side(None),
            }
        };
        Self {
            surface: surface("surface", target, samples),
            pick: surface("view_depth_m", PICK_FORMAT, 1),
            lines: maker.pipeline(&Drawing {
                shader: &line_shader,
                vertex: "stroke",
                fragment: "line",
                vertices: wgpu::VertexBufferLayout {
                    array_stride: size_of::<Line>() as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![
                        0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Unorm8x4, 4 => Unorm8x4
                    ],
                },
                cull_mode: None,
                writes_depth: false,
                target: wgpu::ColorTargetState {
                    format: target,
                    blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::COLOR,
                },
                samples,
            }),
            frame_layout,
        }
    }

    /// A uniform buffer for one [`Frame`] and its bind group.
    pub(super) fn frame_binding(&self, device: &wgpu::Device) -> (wgpu::Buffer, wgpu::BindGroup) {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<Frame>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &self.frame_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: buffer.as_entire_binding(),
            }],
        });
        (buffer, group)
    }
}

struct Drawing<'a> {
    shader: &'a wgpu::ShaderModule,
    vertex: &'a str,
    fragment: &'a str,
    vertices: wgpu::VertexBufferLayout<'a>,
    cull_mode: Option<wgpu::Face>,
    writes_depth: bool,
    target: wgpu::ColorTargetState,
    samples: u32,
}

struct Maker<'a> {
    device: &'a wgpu::Device,
    layout: wgpu::PipelineLayout,
}

impl Maker<'_> {
    fn shader(&self, source: &str) -> wgpu::ShaderModule {
        self.device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("view"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
    }

    fn pipeline(&self, drawing: &Drawing<'_>) -> wgpu::RenderPipeline {
        self.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(drawing.fragment),
                layout: Some(&self.layout),
                vertex: wgpu::VertexState {
                    module: drawing.shader,
                    entry_point: Some(drawing.vertex),
                    compilation_options: Default::default(),
                    buffers: &[Some(drawing.vertices.clone())],
                },
                primitive: wgpu::PrimitiveState {
                    cull_mode: drawing.cull_mode,
                    ..Default::default()
                },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(drawing.writes_depth),
                    // Depth is reversed: nearer is larger.
                    depth_compare: Some(wgpu::CompareFunction::Greater),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: drawing.samples,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: drawing.shader,
                    entry_point: Some(drawing.fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(drawing.target.clone())],
                }),
                multiview_mask: None,
                cache: None,
            })
    }
}
