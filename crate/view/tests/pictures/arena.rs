//! Bricks come, change, go and are picked: seen in pixels, because that is what a stale brick shows in.

use crate::support::*;
use glam::Vec3;
use view::{Arena, ArenaError, GpuPainter, Picking, Scene};

/// A square of 0.4 m in brick (0, `y`, 0), facing +X.
fn square(y: i32, rgb: [u8; 3], cells: usize) -> Vec<f32> {
    let corner = Vec3::new(0.05, y as f32 * BRICK_M + 0.05, 0.05);
    quad(corner, Vec3::Y * 0.4, Vec3::Z * 0.4, rgb, cells)
}

/// Looks at the squares of bricks -2 to 2 from in front.
fn facing() -> View {
    View::from(Vec3::new(4.0, 0.25, 0.25), Vec3::new(0.0, 0.25, 0.25))
}

/// Which of the squares in bricks -2 to 2 are seen, by their strongest channel: r, g, b or a dot.
fn seen(gpu: &Gpu, arena: &Arena) -> String {
    let view = facing();
    let picture = gpu.picture(arena, &view);
    let spot = |y: i32| Vec3::new(0.05, y as f32 * BRICK_M + 0.27, 0.24);
    let name = |[r, g, b]: [u8; 3]| match r.max(g).max(b) {
        240.. => '.',
        most if most == r => 'r',
        most if most == g => 'g',
        _ => 'b',
    };
    (-2..=2)
        .map(|y| name(picture.at(view.pixel_of(spot(y)))))
        .collect()
}

#[test]
fn bricks_come_change_and_go() {
    let Some(gpu) = Gpu::open() else { return };
    let mut arena = gpu.arena();
    assert_eq!(seen(&gpu, &arena), ".....");
    assert_eq!((arena.triangle_count(), arena.bounds()), (0, None));

    let put = |arena: &mut Arena, y: i32, soup: &[f32]| {
        arena
            .insert_from_slice(&gpu.queue, [0, y, 0], soup)
            .unwrap();
    };
    for (y, rgb) in [(-2, RED), (-1, GREEN), (0, BLUE), (1, RED), (2, GREEN)] {
        put(&mut arena, y, &square(y, rgb, 5));
    }
    assert_eq!(seen(&gpu, &arena), "rgbrg");
    assert_eq!((arena.brick_count(), arena.triangle_count()), (5, 250));
    let bounds = arena.bounds().unwrap();
    assert_eq!(bounds.min, Vec3::new(0.0, -1.0, 0.0));
    assert_eq!(bounds.max, Vec3::new(0.5, 1.5, 0.5));

    // A smaller new version, then one that needs another place; nothing of the old stays.
    put(&mut arena, -1, &square(-1, BLUE, 1));
    put(&mut arena, 1, &square(1, GREEN, 12));
    assert_eq!(seen(&gpu, &arena), "rbbgg");
    assert_eq!(arena.triangle_count(), 3 * 50 + 2 + 288);

    // The neighbours' draw runs across what is gone.
    put(&mut arena, 0, &[]);
    assert_eq!(seen(&gpu, &arena), "rb.gg");
    put(&mut arena, 0, &square(0, RED, 2));
    assert_eq!(seen(&gpu, &arena), "rbrgg");

    arena.clear();
    assert_eq!(seen(&gpu, &arena), ".....");
    assert_eq!((arena.bytes(), arena.brick_count()), (0, 0));
}

#[test]
fn bricks_are_copied_on_the_gpu_from_any_place_in_a_buffer() {
    let Some(gpu) = Gpu::open() else { return };
    let mut arena = gpu.arena();
    for y in [0, 1, 2] {
        let soup = square(y, BLUE, 6);
        arena
            .insert_from_slice(&gpu.queue, [0, y, 0], &soup)
            .unwrap();
    }
    assert_eq!(seen(&gpu, &arena), "..bbb");
    let (first, second) = (square(-1, RED, 3), square(0, GREEN, 2));
    let all = [vec![9.0; 7], first.clone(), second.clone()].concat();
    let source = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: size_of_val(&all[..]) as u64,
        usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue
        .write_buffer(&source, 0, bytemuck::cast_slice(&all));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut copy = |brick, offset: usize, vertices: usize| {
        let (at, count) = (offset as u64 * 4, vertices as u32);
        arena
            .insert(&mut encoder, brick, &source, at, count)
            .unwrap();
    };
    copy([0, -1, 0], 7, first.len() / 6);
    copy([0, 0, 0], 7 + first.len(), second.len() / 6);
    copy([0, 1, 0], 0, 0);
    gpu.queue.submit([encoder.finish()]);
    assert_eq!(seen(&gpu, &arena), ".rg.b");
    assert_eq!(arena.triangle_count(), 18 + 8 + 72);
}

#[test]
fn pages_are_added_as_needed_and_places_used_again() {
    let Some(gpu) = Gpu::open() else { return };
    let page_bytes = 64 * 96 * 24;
    let mut arena = Arena::new(&gpu.device, page_bytes, BRICK_M);
    // 50 triangles, 150 vertices, two blocks of 96: 32 bricks fill a page.
    for y in 0..100 {
        let soup = square(y - 2, RED, 5);
        arena
            .insert_from_slice(&gpu.queue, [0, y - 2, 0], &soup)
            .unwrap();
    }
    assert_eq!(arena.bytes(), 4 * page_bytes);
    // Ten rounds of new versions of other sizes fit where the old ones were.
    for round in 0..10 {
        for y in 0..100 {
            let soup = square(y - 2, GREEN, 4 + (round + y as usize) % 2);
            arena
                .insert_from_slice(&gpu.queue, [0, y - 2, 0], &soup)
                .unwrap();
        }
    }
    assert_eq!(arena.bytes(), 4 * page_bytes);
    assert_eq!(seen(&gpu, &arena), "ggggg");

    // A brick larger than a page gets a page of its own.
    let large = square(0, BLUE, 60);
    arena
        .insert_from_slice(&gpu.queue, [0, 0, 0], &large)
        .unwrap();
    assert!(arena.bytes() >= 4 * page_bytes + size_of_val(&large[..]) as u64);
    assert_eq!(seen(&gpu, &arena).chars().nth(2), Some('b'));
}

#[test]
fn what_does_not_fit_is_said_and_nothing_breaks() {
    let Some(gpu) = Gpu::open() else { return };
    let mut arena = gpu.arena();
    let error = arena.insert_from_slice(&gpu.queue, [1, 2, 3], &[0.0; 17]);
    let expected =
        "brick [1, 2, 3]: expected a multiple of 18 numbers (3 vertices a triangle), found 17";
    assert_eq!(error.unwrap_err().to_string(), expected);

    let source = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 72,
        usage: wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let error = arena.insert(&mut encoder, [0, 0, 0], &source, 0, 12_000_000);
    assert!(
        matches!(error, Err(ArenaError::BrickTooLarge { .. })),
        "{error:?}"
    );
    arena
        .insert_from_slice(&gpu.queue, [0, 0, 0], &square(0, RED, 1))
        .unwrap();
    assert_eq!(seen(&gpu, &arena), "..r..");
}

#[test]
fn picking_finds_the_surface_that_is_seen() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&room());
    let mut view = View::from(Vec3::new(9.0, -5.0, 6.0), Vec3::new(2.0, 1.5, 1.0));
    let mut painter = GpuPainter::new(&gpu.device, &gpu.queue, FORMAT, true);
    let mut pick = |view: &View, point: Vec3| {
        let (x, y) = view.pixel_of(point);
        let at_px = glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let scene = Scene {
            arena: &arena,
            frusta: &view.frusta,
            look: &view.look,
        };
        assert_eq!(painter.picking(), Picking::Idle);
        painter.pick(at_px, view.viewport, &view.camera, &scene);
        gpu.wait();
        match painter.picking() {
            Picking::Done(found) => found,
            other => panic!("{other:?} after waiting"),
        }
    };
    // Through the near walls, which are left out, onto the floor; a pixel is 4 cm wide here.
    let floor = Vec3::new(3.2, 0.6, 0.0);
    let found = pick(&view, floor).unwrap();
    assert!(found.distance(floor) < 0.05, "{found}");
    assert!(found.z.abs() < 1e-3, "{found}");
    assert_eq!(pick(&view, Vec3::new(2.0, 1.5, 7.0)), None);
    view.look.cull_back = false;
    let found = pick(&view, floor).unwrap();
    assert!(
        found.z > 0.5,
        "the wall or the ceiling in front, found {found}"
    );
}
