//! Without a GPU the pictures are the same: against known colours, and against the GPU's.

use crate::support::*;
use glam::{Vec2, Vec3};
use view::{CpuPainter, Shading, Theme};

fn painter(bricks: &[Brick]) -> CpuPainter {
    let mut painter = CpuPainter::new(BRICK_M);
    for (brick, soup) in bricks {
        painter.insert(*brick, soup);
    }
    painter
}

fn picture(painter: &mut CpuPainter, view: &View) -> Picture {
    let rgba = painter.paint(view.viewport, &view.camera, &view.frusta, &view.look);
    Picture {
        width: view.viewport.width_px,
        rgba: rgba.to_vec(),
    }
}

/// Looks at the +X face of the cube, straight on, from 3 m.
fn facing_red() -> View {
    View::from(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO)
}

#[test]
fn known_places_have_the_colours_that_the_light_gives_them() {
    let mut painter = painter(&cube());
    let mut view = facing_red();
    let seen = picture(&mut painter, &view);
    // 0.3 + 0.45 + 0.125 = 0.875; its 1/2.2th power is 0.9411.
    assert_close(seen.at((150, 110)), [188, 56, 47], 1);
    assert_eq!(seen.at((2, 2)), Theme::LIGHT.background);
    // The face at 2.5 m is 1 m: 2 tan(0.45) * 2.5 = 2.415 m fill 240 rows, so 99.4 pixels a side.
    let red = 320 * 240 - seen.count(Theme::LIGHT.background);
    assert!((99 * 99..=100 * 100).contains(&red), "{red} pixels");

    view.look.shading = Shading::Normal;
    assert_close(
        picture(&mut painter, &view).at((150, 110)),
        [255, 128, 128],
        1,
    );
}

#[test]
fn the_cpu_draws_what_the_gpu_draws() {
    let Some(gpu) = Gpu::open() else { return };
    let room = evident(room());
    let arena = gpu.filled_arena(&room);
    let mut painter = painter(&room);
    assert_eq!(painter.bounds(), arena.bounds());
    assert_eq!(painter.triangle_count(), arena.triangle_count());
    let outside = View::from(Vec3::new(7.0, -3.0, 5.0), Vec3::new(2.0, 1.5, 1.0));
    let inside = View::from(Vec3::new(3.6, 2.6, 2.0), Vec3::new(1.0, 0.8, 0.6));
    for (place, view) in [("outside", outside), ("inside", inside)] {
        for shading in [
            Shading::Color,
            Shading::Normal,
            Shading::Depth,
            Shading::Wireframe,
            Shading::Confidence,
            Shading::Views,
        ] {
            for cull_back in [true, false] {
                let mut view = view.clone();
                view.look.shading = shading;
                view.look.cull_back = cull_back;
                view.look.show_grid = true;
                let on_gpu = gpu.picture(&arena, &view);
                let on_cpu = picture(&mut painter, &view);
                on_cpu.save(&format!("cpu_{place}_{shading:?}_{cull_back}"));
                on_gpu.save(&format!("gpu_{place}_{shading:?}_{cull_back}"));
                let pairs = on_gpu.rgba.iter().zip(&on_cpu.rgba);
                let off: u32 = pairs.map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
                let mean = f64::from(off) / (320.0 * 240.0 * 3.0);
                println!("{place} {shading:?} {cull_back}: {mean:.3} levels apart");
                assert!(
                    mean < 1.5,
                    "{place} {shading:?} {cull_back}: {mean} levels apart"
                );
            }
        }
    }
}

#[test]
fn bricks_change_and_go() {
    let mut painter = painter(&cube());
    let view = facing_red();
    let bricks = painter.brick_count();
    assert_eq!(painter.triangle_count(), 6 * 32);
    let of = |brick: [i32; 3]| cube().into_iter().find(|(b, _)| *b == brick).unwrap().1;
    // The upper right quarter of the red face (+Y is to the right from there).
    let red = [1, 0, 0];
    assert!(!of(red).is_empty());
    painter.insert(red, &[]);
    let seen = picture(&mut painter, &view);
    assert_eq!(painter.brick_count(), bricks - 1);
    assert_eq!(seen.at((200, 90)), Theme::LIGHT.background);
    painter.insert(red, &of(red));
    assert_close(
        picture(&mut painter, &view).at((200, 90)),
        seen.at((120, 90)),
        2,
    );
    painter.clear();
    let empty = picture(&mut painter, &view);
    assert_eq!(empty.count(Theme::LIGHT.background), 320 * 240);
}

#[test]
fn picking_finds_the_surface_that_is_seen() {
    let mut painter = painter(&room());
    let view = View::from(Vec3::new(9.0, -5.0, 6.0), Vec3::new(2.0, 1.5, 1.0));
    assert_eq!(
        painter.pick(Vec2::new(160.0, 120.0)),
        None,
        "nothing is drawn yet"
    );
    picture(&mut painter, &view);
    let pick = |point: Vec3| {
        let (x, y) = view.pixel_of(point);
        painter.pick(Vec2::new(x as f32 + 0.5, y as f32 + 0.5))
    };
    let floor = Vec3::new(3.2, 0.6, 0.0);
    let found = pick(floor).unwrap();
    assert!(
        found.distance(floor) < 0.05 && found.z.abs() < 1e-3,
        "{found}"
    );
    assert_eq!(pick(Vec3::new(2.0, 1.5, 7.0)), None);
    assert_eq!(painter.pick(Vec2::new(-5.0, 900.0)), None);
}

#[test]
fn walking_close_to_a_wall_breaks_nothing() {
    let mut painter = painter(&room());
    for step in 0..40 {
        let eye = Vec3::new(0.5 - 0.03 * step as f32, 1.3, 1.2);
        let mut view = View::from(eye, eye - Vec3::X);
        view.look.show_grid = true;
        view.look.show_frusta = true;
        let [r, g, _] = picture(&mut painter, &view).at((160, 100));
        // Until the wall (x = 0) is at the near plane it is there; from behind it is left out.
        let wall = r > 150 && g < 80;
        assert!(wall || eye.x < 0.03, "no wall from {eye}");
        assert!(!wall || eye.x > 0.0, "the wall's back from {eye}");
    }
}
