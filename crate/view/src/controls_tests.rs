use super::*;
use crate::bounds::corners;
use mesh::Bounds;

const WIDTH: f32 = 800.0;
const HEIGHT: f32 = 600.0;

/// The corners of a room around the origin, `half` to the sides and `half.z` high.
fn box_of(half: Vec3) -> Vec<Vec3> {
    let min = Vec3::new(-half.x, -half.y, 0.0);
    corners(&Bounds { min, max: half }).to_vec()
}

fn controls() -> Controls {
    let mut controls = Controls::default();
    controls.input(Input::Resize {
        width_px: WIDTH as u32,
        height_px: HEIGHT as u32,
        scale: 2.0,
    });
    controls.set_outline(box_of(Vec3::new(2.0, 1.5, 2.5)));
    settle(&mut controls);
    controls
}

/// Ticks until the picture stands still.
fn settle(controls: &mut Controls) {
    for _ in 0..1000 {
        if !controls.tick(1.0 / 60.0) {
            return;
        }
    }
    panic!("the camera never comes to rest");
}

fn down(id: i32, at: Vec2, button: u8, kind: PointerKind) -> Input {
    Input::PointerDown {
        id,
        x: at.x,
        y: at.y,
        button,
        kind,
        shift: false,
    }
}

fn moved(id: i32, at: Vec2) -> Input {
    Input::PointerMove {
        id,
        x: at.x,
        y: at.y,
    }
}

fn drag(controls: &mut Controls, button: u8, from: Vec2, to: Vec2) {
    controls.input(down(1, from, button, PointerKind::Mouse));
    controls.input(moved(1, to));
    controls.input(Input::PointerUp { id: 1 });
    settle(controls);
}

fn key(code: &str, down: bool) -> Input {
    Input::Key {
        code: code.into(),
        down,
    }
}

/// Pixel that shows a point.
fn pixel(controls: &Controls, point: Vec3) -> Vec2 {
    let clip = controls.viewport().clip_from_world(controls.camera());
    let ndc = clip.project_point3(point).truncate();
    (ndc * Vec2::new(0.5, -0.5) + 0.5) * Vec2::new(WIDTH, HEIGHT)
}

/// The world point under a pixel, at the pivot's depth.
fn under(controls: &Controls, at: Vec2) -> Vec3 {
    let camera = controls.camera();
    let ray = camera.ray(controls.viewport().ndc(at), WIDTH / HEIGHT);
    ray.origin_m + ray.direction * (camera.distance_m / ray.direction.dot(camera.axes().2))
}

const MIDDLE: Vec2 = Vec2::new(400.0, 300.0);

#[test]
fn dragging_takes_the_near_side_of_the_scene_along() {
    let mut controls = controls();
    let camera = *controls.camera();
    let near = camera.pivot_m + (camera.eye_m() - camera.pivot_m).normalize() * 0.5;
    let before = pixel(&controls, near);
    drag(&mut controls, 0, MIDDLE, MIDDLE + Vec2::new(60.0, 0.0));
    assert!(pixel(&controls, near).x > before.x + 5.0);
    let before = pixel(&controls, near);
    drag(&mut controls, 0, MIDDLE, MIDDLE + Vec2::new(0.0, 60.0));
    assert!(pixel(&controls, near).y > before.y + 5.0);
    // Up to the pole and beyond: it stops, the picture does not turn over.
    drag(&mut controls, 0, MIDDLE, MIDDLE + Vec2::new(0.0, 2000.0));
    let above = controls.camera().pivot_m + Vec3::Z;
    assert!((pixel(&controls, above) - MIDDLE).length() < 1.0);
    drag(&mut controls, 0, MIDDLE, MIDDLE - Vec2::new(0.0, 100.0));
    assert!(pixel(&controls, above).y < MIDDLE.y - 5.0, "up is up again");
}

#[test]
fn panning_keeps_the_point_under_the_cursor() {
    let (from, to) = (Vec2::new(300.0, 200.0), Vec2::new(420.0, 350.0));
    for (button, shift) in [(1, false), (2, false), (0, true)] {
        let mut controls = controls();
        let point = under(&controls, from);
        let heading = controls.camera().axes();
        controls.input(Input::PointerDown {
            id: 1,
            x: from.x,
            y: from.y,
            button,
            kind: PointerKind::Mouse,
            shift,
        });
        controls.input(moved(1, to));
        settle(&mut controls);
        assert!((pixel(&controls, point) - to).length() < 0.1);
        assert_eq!(controls.camera().axes(), heading);
    }
}

#[test]
fn the_wheel_zooms_to_the_cursor_on_the_way_and_in_the_end() {
    let mut controls = controls();
    let at = Vec2::new(650.0, 120.0);
    let point = under(&controls, at);
    let far = controls.camera().distance_m;
    for _ in 0..3 {
        controls.input(Input::Wheel {
            dy: -100.0,
            x: at.x,
            y: at.y,
        });
        controls.tick(0.016);
        assert!((pixel(&controls, point) - at).length() < 0.1);
    }
    settle(&mut controls);
    assert!((pixel(&controls, point) - at).length() < 0.1);
    assert!((controls.camera().distance_m / far - (-0.45f32).exp()).abs() < 1e-3);
}

#[test]
fn zooming_on_walks_through_walls_along_the_cursor() {
    let mut controls = controls();
    let at = Vec2::new(500.0, 330.0);
    let ray = controls
        .camera()
        .ray(controls.viewport().ndc(at), WIDTH / HEIGHT);
    let mut travelled = 0.0;
    for _ in 0..60 {
        controls.input(Input::Wheel {
            dy: -100.0,
            x: at.x,
            y: at.y,
        });
        settle(&mut controls);
        let way = controls.camera().eye_m() - ray.origin_m;
        assert!(way.length() > travelled, "each notch comes closer");
        travelled = way.length();
        assert!(way.normalize().dot(ray.direction) > 0.9999);
    }
    assert!(controls.camera().distance_m >= MIN_DISTANCE_M * 0.999);
}

#[test]
fn two_fingers_hold_the_points_they_touch() {
    let mut controls = controls();
    let (a, b) = (Vec2::new(300.0, 300.0), Vec2::new(450.0, 380.0));
    let (point_a, point_b) = (under(&controls, a), under(&controls, b));
    controls.input(down(7, a, 0, PointerKind::Touch));
    controls.input(down(8, b, 0, PointerKind::Touch));
    // Spread by 1.5 about (350, 330) and shift, in the many small steps of real fingers.
    let goal = |p: Vec2| (p - Vec2::new(350.0, 330.0)) * 1.5 + Vec2::new(390.0, 310.0);
    for step in 1..=20 {
        let t = step as f32 / 20.0;
        controls.input(moved(7, a.lerp(goal(a), t)));
        controls.input(moved(8, b.lerp(goal(b), t)));
    }
    settle(&mut controls);
    assert!((pixel(&controls, point_a) - goal(a)).length() < 1.0);
    assert!((pixel(&controls, point_b) - goal(b)).length() < 1.0);
}

#[test]
fn one_finger_orbits_and_the_last_one_down_goes_on_orbiting() {
    let mut controls = controls();
    let pivot = controls.camera().pivot_m;
    controls.input(down(7, MIDDLE, 0, PointerKind::Touch));
    controls.input(moved(7, MIDDLE + Vec2::new(50.0, 0.0)));
    settle(&mut controls);
    let yaw = controls.camera().yaw_rad;
    assert_eq!(controls.camera().pivot_m, pivot);
    controls.input(down(8, MIDDLE, 0, PointerKind::Touch));
    controls.input(Input::PointerUp { id: 7 });
    controls.input(moved(8, MIDDLE + Vec2::new(50.0, 0.0)));
    settle(&mut controls);
    assert!(controls.camera().yaw_rad < yaw - 0.1);
    assert_eq!(controls.camera().pivot_m, pivot);
}

#[test]
fn keys_fly_turn_and_let_go_on_blur() {
    let mut controls = controls();
    let (eye, (_, _, forward)) = (controls.camera().eye_m(), controls.camera().axes());
    controls.input(key("KeyW", true));
    for _ in 0..60 {
        assert!(controls.tick(1.0 / 60.0), "a held key keeps drawing");
    }
    controls.input(Input::Blur);
    settle(&mut controls);
    let way = controls.camera().eye_m() - eye;
    assert!(way.dot(forward) > 0.5 && way.normalize().dot(forward) > 0.999);

    let yaw = controls.camera().yaw_rad;
    controls.input(key("ArrowRight", true));
    for _ in 0..30 {
        controls.tick(1.0 / 60.0);
    }
    controls.input(key("ArrowRight", false));
    settle(&mut controls);
    assert!((yaw - controls.camera().yaw_rad - 0.5 * KEY_TURN_RAD_PER_S).abs() < 1e-3);
}

#[test]
fn dragging_while_flying_turns_the_head() {
    let mut controls = controls();
    controls.input(key("KeyW", true));
    let eye = controls.camera().eye_m();
    let ahead = under(&controls, MIDDLE);
    controls.input(down(1, MIDDLE, 0, PointerKind::Mouse));
    controls.input(moved(1, MIDDLE + Vec2::new(80.0, 0.0)));
    controls.input(key("KeyW", false));
    settle(&mut controls);
    assert!(controls.camera().eye_m().distance(eye) < 1e-3);
    // Looking down 40 degrees, a turn about the upright moves the middle by cos 40 of the drag.
    let found = pixel(&controls, ahead);
    assert!(
        (found.x - MIDDLE.x - 80.0 * 0.7f32.cos()).abs() < 8.0,
        "the picture follows: {found}"
    );
}

#[test]
fn the_view_follows_the_growing_mesh_until_it_is_touched() {
    let mut controls = controls();
    let near = controls.camera().distance_m;
    controls.set_outline(box_of(Vec3::new(8.0, 6.0, 3.0)));
    settle(&mut controls);
    assert!(controls.camera().distance_m > 2.0 * near);

    drag(&mut controls, 0, MIDDLE, MIDDLE + Vec2::new(9.0, 0.0));
    let held = *controls.camera();
    controls.set_outline(box_of(Vec3::new(30.0, 6.0, 3.0)));
    settle(&mut controls);
    assert_eq!(*controls.camera(), held);

    controls.input(key("Home", true));
    settle(&mut controls);
    assert!(controls.camera().distance_m > 1.5 * held.distance_m);
    let home = OrbitCamera::default();
    assert!((controls.camera().pitch_rad - home.pitch_rad).abs() < 1e-3);

    controls.top();
    settle(&mut controls);
    assert_eq!(controls.camera().axes().2.z, -1.0);
}

#[test]
fn focus_brings_the_point_to_the_middle_and_closer() {
    let mut controls = controls();
    let point = Vec3::new(1.2, -0.4, 0.7);
    let before = controls.camera().eye_m().distance(point);
    controls.focus(point);
    settle(&mut controls);
    assert!((pixel(&controls, point) - MIDDLE).length() < 0.5);
    assert!(controls.camera().eye_m().distance(point) < 0.7 * before);
}

#[test]
fn leaving_a_photo_levels_the_horizon_from_where_one_stands() {
    let mut controls = controls();
    let lens = Pinhole {
        width: 640,
        height: 480,
        fx: 500.0,
        fy: 500.0,
        cx: 319.5,
        cy: 239.5,
    };
    // Portrait, at eye height, looking east.
    let axes = glam::Mat3A::from_cols(Vec3::Z.into(), Vec3::Y.into(), (-Vec3::X).into());
    let pose = Affine3A {
        matrix3: axes,
        translation: Vec3::new(0.3, 0.1, 1.5).into(),
    };
    controls.look_through(pose, lens);
    settle(&mut controls);
    assert!(
        controls
            .camera()
            .eye_m()
            .abs_diff_eq(Vec3::new(0.3, 0.1, 1.5), 1e-3)
    );
    assert!((controls.camera().roll_rad.abs() - FRAC_PI_2).abs() < 1e-3);
    // The canvas turns narrow: the photo still fits.
    let fov = controls.camera().fov_y_rad;
    controls.input(Input::Resize {
        width_px: 300,
        height_px: 600,
        scale: 2.0,
    });
    settle(&mut controls);
    assert!(controls.camera().fov_y_rad > fov + 0.2);

    drag(&mut controls, 0, MIDDLE, MIDDLE + Vec2::new(5.0, 0.0));
    assert_eq!(controls.camera().roll_rad, 0.0);
}

#[test]
fn reduced_motion_jumps_and_still_asks_for_one_picture() {
    let mut controls = controls();
    controls.set_reduced_motion(true);
    controls.focus(Vec3::new(0.5, 0.5, 0.5));
    assert!(controls.tick(0.016));
    assert_eq!(controls.camera().pivot_m, Vec3::new(0.5, 0.5, 0.5));
    assert!(!controls.tick(0.016), "one picture, then rest");
}
