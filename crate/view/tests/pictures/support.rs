//! A scene made by rule, and a GPU to draw it with, or a visible skip.

use glam::Vec3;
use mesh::soup::{Evidence, KEYS, encode};
use std::path::PathBuf;
use view::{Arena, Frusta, GpuPainter, Look, OrbitCamera, Scene, Viewport};

pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub const BRICK_M: f32 = 0.5;

pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// The first adapter, with WebGPU's default limits and any validation error turned into a
    /// panic; `None`, said aloud, where there is no adapter.
    pub fn open() -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter =
            pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
        let Ok(adapter) = adapter else {
            println!("skipped: no Vulkan, Metal or Direct3D 12 adapter");
            return None;
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
        device.on_uncaptured_error(std::sync::Arc::new(|error| panic!("{error}")));
        Some(Self { device, queue })
    }

    pub fn arena(&self) -> Arena {
        Arena::new(&self.device, 1 << 20, BRICK_M)
    }

    pub fn filled_arena(&self, bricks: &[Brick]) -> Arena {
        let mut arena = self.arena();
        for (brick, soup) in bricks {
            arena.insert_from_slice(&self.queue, *brick, soup).unwrap();
        }
        arena
    }

    /// Paints once with multisampling and reads the pixels back.
    pub fn picture(&self, arena: &Arena, view: &View) -> Picture {
        self.picture_as(FORMAT, arena, view)
    }

    pub fn picture_as(&self, format: wgpu::TextureFormat, arena: &Arena, view: &View) -> Picture {
        let mut painter = GpuPainter::new(&self.device, &self.queue, format, true);
        let size = wgpu::Extent3d {
            width: view.viewport.width_px,
            height: view.viewport.height_px,
            depth_or_array_layers: 1,
        };
        let target = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        painter.paint(
            &mut encoder,
            &target.create_view(&Default::default()),
            view.viewport,
            &view.camera,
            &Scene {
                arena,
                frusta: &view.frusta,
                look: &view.look,
            },
        );
        let row_bytes = (size.width * 4).next_multiple_of(256);
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes * size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            target.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            size,
        );
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        self.wait();
        let bytes = staging.get_mapped_range(..).unwrap();
        let rows = bytes.chunks(row_bytes as usize);
        Picture {
            width: size.width,
            rgba: rows
                .flat_map(|row| row[..size.width as usize * 4].to_vec())
                .collect(),
        }
    }

    pub fn wait(&self) {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .unwrap();
    }
}

/// Everything of a picture but the surface.
#[derive(Clone)]
pub struct View {
    pub viewport: Viewport,
    pub camera: OrbitCamera,
    pub frusta: Frusta,
    pub look: Look,
}

impl View {
    /// Looks from `eye_m` at `target_m`, without a grid.
    pub fn from(eye_m: Vec3, target_m: Vec3) -> Self {
        let way = target_m - eye_m;
        Self {
            viewport: Viewport {
                width_px: 320,
                height_px: 240,
                scale: 1.0,
            },
            camera: OrbitCamera {
                pivot_m: target_m,
                distance_m: way.length(),
                yaw_rad: way.y.atan2(way.x),
                pitch_rad: (way.z / way.length()).asin(),
                ..OrbitCamera::default()
            },
            frusta: Frusta::default(),
            look: Look {
                show_grid: false,
                ..Look::default()
            },
        }
    }

    /// The pixel that shows `point_m`.
    pub fn pixel_of(&self, point_m: Vec3) -> (u32, u32) {
        let ndc = self
            .viewport
            .clip_from_world(&self.camera)
            .project_point3(point_m);
        let x = (ndc.x * 0.5 + 0.5) * self.viewport.width_px as f32;
        let y = (0.5 - ndc.y * 0.5) * self.viewport.height_px as f32;
        (x as u32, y as u32)
    }
}

pub struct Picture {
    pub width: u32,
    pub rgba: Vec<u8>,
}

impl Picture {
    pub fn at(&self, (x, y): (u32, u32)) -> [u8; 3] {
        let i = (y * self.width + x) as usize * 4;
        assert_eq!(self.rgba[i + 3], 255, "the canvas must be opaque");
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2]]
    }

    pub fn count(&self, rgb: [u8; 3]) -> usize {
        self.rgba.chunks(4).filter(|p| p[..3] == rgb).count()
    }

    /// Writes a PNG into the folder that IPDRECON_PICTURES names, if it names one.
    pub fn save(&self, name: &str) {
        let Some(folder) = std::env::var_os("IPDRECON_PICTURES") else {
            return;
        };
        let path = PathBuf::from(folder).join(format!("{name}.png"));
        let file = std::fs::File::create(path).unwrap();
        let height = self.rgba.len() as u32 / 4 / self.width;
        let mut encoder = png::Encoder::new(file, self.width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&self.rgba).unwrap();
    }
}

pub fn assert_close(found: [u8; 3], expected: [u8; 3], tolerance: u8) {
    let off = (0..3)
        .map(|i| found[i].abs_diff(expected[i]))
        .max()
        .unwrap();
    assert!(off <= tolerance, "expected {expected:?}, found {found:?}");
}

/// A brick and its triangles.
pub type Brick = ([i32; 3], Vec<f32>);

/// A flat piece of surface: `corner`, `corner + u`, `corner + u + v`, `corner + v`, facing u x v,
/// in `cells` by `cells` squares of two triangles.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3, rgb: [u8; 3], cells: usize) -> Vec<f32> {
    let normal = u.cross(v).normalize();
    let (u, v) = (u / cells as f32, v / cells as f32);
    let mut soup = Vec::new();
    for i in 0..cells {
        for j in 0..cells {
            let at = |a: usize, b: usize| corner + u * (i + a) as f32 + v * (j + b) as f32;
            for p in [at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)] {
                soup.extend(encode(p, normal, rgb));
            }
        }
    }
    soup
}

pub const RED: [u8; 3] = [200, 60, 50];
pub const GREEN: [u8; 3] = [70, 170, 80];
pub const BLUE: [u8; 3] = [60, 90, 200];
pub const SAND: [u8; 3] = [214, 196, 160];
pub const WHITE: [u8; 3] = [236, 236, 232];

/// The box from `min` to `min + size`: its six faces outward, or inward as a room has them.
pub fn faces(min: Vec3, size: Vec3, inward: bool, rgb: [[u8; 3]; 6], cells: usize) -> Vec<f32> {
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    // -x, +x, -y, +y, -z, +z; u x v points outward.
    let sides = [
        (min, z, y),
        (min + x, y, z),
        (min, x, z),
        (min + y, z, x),
        (min, y, x),
        (min + z, x, y),
    ];
    let mut soup = Vec::new();
    for ((corner, u, v), rgb) in sides.into_iter().zip(rgb) {
        let (u, v) = if inward { (v, u) } else { (u, v) };
        soup.extend(quad(corner, u, v, rgb, cells));
    }
    soup
}

/// A unit cube about the origin, every side another colour, cut into the eight bricks around it.
pub fn cube() -> Vec<Brick> {
    let sides = [SAND, RED, BLUE, GREEN, WHITE, SAND];
    into_bricks(&faces(Vec3::splat(-0.5), Vec3::ONE, false, sides, 4))
}

/// A room of 4 x 3 x 2.5 m on the floor z = 0, with a box in it; four coloured walls.
pub fn room() -> Vec<Brick> {
    let walls = [RED, BLUE, GREEN, WHITE, SAND, WHITE];
    let mut soup = faces(Vec3::ZERO, Vec3::new(4.0, 3.0, 2.5), true, walls, 24);
    let table = [BLUE; 6];
    let at = Vec3::new(1.5, 1.0, 0.0);
    soup.extend(faces(at, Vec3::new(1.0, 0.8, 0.7), false, table, 8));
    into_bricks(&soup)
}

/// The same surface with evidence that grows along x: from 1 view to 32 in 4 m, and confidence from 0 to 1; nothing is known where
/// x is below 0.
pub fn evident(mut bricks: Vec<Brick>) -> Vec<Brick> {
    for vertex in bricks.iter_mut().flat_map(|(_, soup)| soup.chunks_mut(6)) {
        let along = vertex[0] / 4.0;
        let views = (along * 5.0).exp2().round() as usize;
        let evidence = match along >= 0.0 {
            true => Evidence::new(views, Some(along)),
            false => Evidence::default(),
        };
        vertex[5] = (evidence.packed() * KEYS) as f32;
    }
    bricks
}

/// Deals triangles to the bricks that their middles lie in.
pub fn into_bricks(soup: &[f32]) -> Vec<Brick> {
    let mut bricks = std::collections::BTreeMap::<[i32; 3], Vec<f32>>::new();
    for triangle in soup.chunks(18) {
        let corner = |i: usize| Vec3::from_slice(&triangle[i * 6..]);
        let middle = (corner(0) + corner(1) + corner(2)) / 3.0;
        // A hair inside, so that a face on the lattice goes to one definite brick.
        let brick = ((middle + 1e-4) / BRICK_M).floor().as_ivec3().to_array();
        bricks.entry(brick).or_default().extend(triangle);
    }
    bricks.into_iter().collect()
}
