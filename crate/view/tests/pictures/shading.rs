//! What a visitor sees: colours at known places for each shading mode, culling, lines, targets.

use crate::support::*;
use glam::{Affine3A, Mat3A, Vec3};
use mesh::camera::Pinhole;
use view::{CameraPose, RAMP, Shading, Theme, UNKNOWN};

/// Looks at the +X face of the cube, straight on, from 3 m.
fn facing_red() -> View {
    View::from(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO)
}

const MIDDLE: (u32, u32) = (160, 120);
/// Off the triangles' edges on the red face.
const ON_FACE: Vec3 = Vec3::new(0.5, 0.06, 0.13);

#[test]
fn colour_is_the_scans_own_under_a_soft_light() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    let picture = gpu.picture(&arena, &facing_red());
    picture.save("cube_color");
    // Head on, half sky: 0.3 + 0.45 + 0.125 = 0.875; its 1/2.2th power is 0.9411.
    assert_close(picture.at(MIDDLE), [188, 56, 47], 1);
    assert_eq!(picture.at((2, 2)), Theme::LIGHT.background);

    // From above: the top has all the sky, and the way to the eye (2.45, -0.07, 2) makes the head
    // 2 / 3.163 = 0.632: 0.3 + 0.2845 + 0.25 = 0.8345; its 1/2.2th power is 0.9211.
    let above = View::from(Vec3::new(2.5, 0.0, 2.5), Vec3::new(0.0, 0.0, 0.0));
    let picture = gpu.picture(&arena, &above);
    let top = picture.at(above.pixel_of(Vec3::new(0.05, 0.07, 0.5)));
    assert_close(top, [197, 181, 147], 1);
}

#[test]
fn normals_show_as_colour() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    let mut view = View::from(Vec3::new(2.0, 1.6, 1.5), Vec3::ZERO);
    view.look.shading = Shading::Normal;
    let picture = gpu.picture(&arena, &view);
    picture.save("cube_normal");
    for (point, expected) in [
        (Vec3::new(0.5, 0.1, 0.1), [255, 128, 128]),
        (Vec3::new(0.1, 0.5, 0.1), [128, 255, 128]),
        (Vec3::new(0.1, 0.1, 0.5), [128, 128, 255]),
    ] {
        assert_close(picture.at(view.pixel_of(point)), expected, 1);
    }
}

#[test]
fn depth_runs_along_the_ramp_from_light_to_dark() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    let mut view = facing_red();
    view.look.shading = Shading::Depth;
    let picture = gpu.picture(&arena, &view);
    picture.save("cube_depth");
    // The bricks' box is [-0.5, 1] wide along X (the +X face lies in the bricks beyond 0.5):
    // depths 2.0 to 3.5; the face at 2.5 is a third of the way, stop 5 + 1/3 from the far end.
    let mix = |i: usize| {
        let (a, b) = (f32::from(RAMP[5][i]), f32::from(RAMP[6][i]));
        (a + (b - a) / 3.0).round() as u8
    };
    assert_close(picture.at(MIDDLE), [mix(0), mix(1), mix(2)], 1);

    let lightness = |rgb: [u8; 3]| rgb.map(u32::from).iter().sum::<u32>();
    let mut room_view = View::from(Vec3::new(3.6, 2.6, 2.0), Vec3::new(1.0, 0.8, 0.6));
    room_view.look.shading = Shading::Depth;
    let room = gpu.filled_arena(&room());
    let picture = gpu.picture(&room, &room_view);
    picture.save("room_depth");
    let near = picture.at(room_view.pixel_of(Vec3::new(2.4, 1.7, 0.7)));
    let far = picture.at(room_view.pixel_of(Vec3::new(0.0, 0.3, 1.0)));
    assert!(lightness(near) > lightness(far) + 60, "{near:?} {far:?}");
}

#[test]
fn evidence_runs_along_the_ramp_and_is_grey_where_unknown() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&evident(room()));
    // On the floor from above: light falls on it as it does in the legend but for a few levels.
    let mut view = View::from(Vec3::new(2.0, 1.4, 6.0), Vec3::new(2.0, 1.5, 0.0));
    let nearest = |rgb: [u8; 3]| {
        let off = |stop: &[u8; 3]| {
            (0..3)
                .map(|i| i32::from(stop[i].abs_diff(rgb[i])))
                .sum::<i32>()
        };
        (0..RAMP.len())
            .min_by_key(|&stop| off(&RAMP[stop]))
            .unwrap()
    };
    for shading in [Shading::Confidence, Shading::Views] {
        view.look.shading = shading;
        let picture = gpu.picture(&arena, &view);
        picture.save(&format!("room_{shading:?}"));
        // Both grow from one end of the ramp to the other in 4 m: a stop is half a metre.
        for (x, stop) in [(0.05, 0), (1.0, 2), (3.0, 6), (3.95, 8)] {
            let found = picture.at(view.pixel_of(Vec3::new(x, 0.3, 0.0)));
            assert_eq!(nearest(found), stop, "{shading:?} at {x} m: {found:?}");
        }
        let unknown = gpu.filled_arena(&cube());
        let mut view = facing_red();
        view.look.shading = shading;
        let [r, g, b] = gpu.picture(&unknown, &view).at(MIDDLE);
        assert!(
            r == g && g == b && r.abs_diff(UNKNOWN[0]) < 10,
            "{:?}",
            [r, g, b]
        );
    }
}

#[test]
fn wireframe_draws_the_edges_of_triangles() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    let mut view = facing_red();
    view.look.shading = Shading::Wireframe;
    let picture = gpu.picture(&arena, &view);
    picture.save("cube_wireframe");
    let luma = |p: Vec3| u32::from(picture.at(view.pixel_of(p))[0]);
    let inside = luma(ON_FACE);
    // The face is 4 by 4 cells: an upright edge at y = 0.25, a diagonal through (0.125, 0.125).
    assert!(luma(Vec3::new(0.5, 0.25, 0.07)) + 50 < inside, "cell edge");
    assert!(luma(Vec3::new(0.5, 0.125, 0.125)) + 50 < inside, "diagonal");
}

#[test]
fn one_looks_into_a_room_through_its_walls() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&room());
    let mut view = View::from(Vec3::new(9.0, -5.0, 6.0), Vec3::new(2.0, 1.5, 1.0));
    view.look.show_grid = true;
    let picture = gpu.picture(&arena, &view);
    picture.save("room_dollhouse");
    // The floor is seen through the near walls and the ceiling.
    let floor = view.pixel_of(Vec3::new(3.2, 0.6, 0.0));
    let [r, g, b] = picture.at(floor);
    assert!(r > g && g > b && r > 150, "sand, found {:?}", [r, g, b]);

    view.look.cull_back = false;
    let closed = gpu.picture(&arena, &view);
    closed.save("room_closed");
    let [r, g, b] = closed.at(floor);
    assert!(
        r.abs_diff(b) < 12 && g > 80,
        "white ceiling's back, found {:?}",
        [r, g, b]
    );
}

#[test]
fn an_empty_scene_still_has_its_floor() {
    let Some(gpu) = Gpu::open() else { return };
    let mut view = View::from(Vec3::new(4.0, 3.0, 3.0), Vec3::ZERO);
    view.look.show_grid = true;
    for (name, theme) in [("empty_light", Theme::LIGHT), ("empty_dark", Theme::DARK)] {
        view.look.theme = theme;
        let picture = gpu.picture(&gpu.arena(), &view);
        picture.save(name);
        let lines = 320 * 240 - picture.count(theme.background);
        assert!((1500..30_000).contains(&lines), "{lines} pixels of grid");
    }
    view.look.show_grid = false;
    let picture = gpu.picture(&gpu.arena(), &view);
    assert_eq!(picture.count(Theme::DARK.background), 320 * 240);
}

#[test]
fn frusta_are_drawn_and_hidden_by_what_is_in_front() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    let mut view = facing_red();
    view.look.show_frusta = true;
    let lens = Pinhole {
        width: 640,
        height: 480,
        fx: 400.0,
        fy: 400.0,
        cx: 319.5,
        cy: 239.5,
    };
    // Looking along +Y, upright: camera x is world x, camera y (down) is world -z.
    let axes = Mat3A::from_cols(Vec3::X.into(), (-Vec3::Z).into(), Vec3::Y.into());
    let pose = |x: f32, y: f32| CameraPose {
        world_from_camera: Affine3A {
            matrix3: axes,
            translation: Vec3::new(x, y, 0.0).into(),
        },
        pinhole: lens,
    };
    let [r, g, b] = Theme::LIGHT.highlight.map(i32::from);
    let marked = |picture: &Picture| {
        let near = |p: &&[u8]| {
            (i32::from(p[0]) - r).abs() + (i32::from(p[1]) - g).abs() + (i32::from(p[2]) - b).abs()
                < 40
        };
        picture.rgba.chunks(4).filter(near).count()
    };
    view.frusta.set(&[pose(1.0, -0.2), pose(1.2, 0.2)]);
    assert_eq!(
        marked(&gpu.picture(&arena, &view)),
        0,
        "nothing is marked yet"
    );
    view.frusta.highlight(Some(0));
    let picture = gpu.picture(&arena, &view);
    picture.save("cube_frusta");
    let in_front = marked(&picture);
    assert!(in_front > 200, "{in_front} pixels of the marked frustum");

    view.frusta.set(&[pose(-1.0, -0.2)]);
    view.frusta.highlight(Some(0));
    assert_eq!(marked(&gpu.picture(&arena, &view)), 0, "behind the cube");
}

#[test]
fn an_srgb_target_gets_the_same_picture() {
    let Some(gpu) = Gpu::open() else { return };
    let arena = gpu.filled_arena(&cube());
    for shading in [Shading::Color, Shading::Normal, Shading::Depth] {
        let mut view = facing_red();
        view.look.shading = shading;
        let plain = gpu.picture(&arena, &view);
        let srgb = gpu.picture_as(wgpu::TextureFormat::Rgba8UnormSrgb, &arena, &view);
        for at in [MIDDLE, (140, 100), (3, 3)] {
            assert_close(srgb.at(at), plain.at(at), 1);
        }
    }
}
