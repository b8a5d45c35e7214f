use super::*;
use crate::bounds::corners;

fn room() -> [Vec3; 8] {
    corners(&Bounds {
        min: Vec3::new(-2.0, 1.0, 0.0),
        max: Vec3::new(3.0, 4.0, 2.5),
    })
}

fn on_screen(camera: &OrbitCamera, aspect: f32, point: Vec3) -> Vec3 {
    camera.clip_from_world(aspect).project_point3(point)
}

#[test]
fn up_is_up_and_right_is_right() {
    // From the south, looking north: east is to the right.
    let camera = OrbitCamera {
        pivot_m: Vec3::ZERO,
        yaw_rad: FRAC_PI_2,
        pitch_rad: 0.0,
        ..Default::default()
    };
    assert!(camera.eye_m().abs_diff_eq(Vec3::new(0.0, -6.0, 0.0), 1e-5));
    assert!(on_screen(&camera, 1.5, Vec3::X).x > 0.1);
    assert!(on_screen(&camera, 1.5, Vec3::Z).y > 0.1);
    assert!(on_screen(&camera, 1.5, Vec3::ZERO).truncate().length() < 1e-6);
    // Reversed depth: nearer is larger.
    assert!(on_screen(&camera, 1.5, -Vec3::Y).z > on_screen(&camera, 1.5, Vec3::Y).z);
}

#[test]
fn nothing_flips_at_the_poles() {
    let mut camera = OrbitCamera::default();
    camera.turn(0.0, -10.0);
    assert_eq!(camera.pitch_rad, -FRAC_PI_2);
    let mut last = camera.view_from_world();
    // Turning all the way round while looking straight down moves in small steps.
    for _ in 0..360 {
        camera.turn(TAU / 360.0, 0.0);
        let now = camera.view_from_world();
        assert!(now.is_finite());
        let step = (now.matrix3 - last.matrix3).to_cols_array();
        assert!(step.iter().all(|d| d.abs() < 0.02), "{step:?}");
        last = now;
    }
    // And coming up again keeps the heading.
    let yaw = camera.yaw_rad;
    camera.turn(0.0, 0.5);
    assert_eq!(camera.yaw_rad, yaw);
}

#[test]
fn fit_shows_all_of_the_room_and_little_else() {
    for aspect in [0.5, 1.0, 2.2] {
        for yaw in [0.0, 1.0, 2.5, 4.0] {
            for pitch in [-FRAC_PI_2, -0.7, 0.0, 0.6] {
                let mut camera = OrbitCamera {
                    yaw_rad: yaw,
                    pitch_rad: pitch,
                    roll_rad: 0.4,
                    ..Default::default()
                };
                camera.fit(&room(), aspect);
                let seen = room().map(|corner| on_screen(&camera, aspect, corner).truncate());
                let low = seen.into_iter().reduce(Vec2::min).unwrap();
                let high = seen.into_iter().reduce(Vec2::max).unwrap();
                let case = format!("{low} to {high} at {aspect} {yaw} {pitch}");
                let widest = low.abs().max(high).max_element();
                assert!((0.9..0.92).contains(&widest), "{case}");
                // In the middle, both ways or in the tight one.
                let askew = (low + high).abs();
                let tight = if high.x - low.x > high.y - low.y {
                    askew.x
                } else {
                    askew.y
                };
                assert!(tight < 1e-3, "{case}");
            }
        }
    }
}

#[test]
fn rays_go_through_the_pixels_they_are_named_after() {
    let mut camera = OrbitCamera {
        lens_shift: Vec2::new(0.05, -0.02),
        roll_rad: 0.3,
        ..Default::default()
    };
    camera.turn(0.4, 0.2);
    for ndc in [Vec2::ZERO, Vec2::new(0.8, -0.5), Vec2::new(-1.0, 1.0)] {
        let ray = camera.ray(ndc, 1.6);
        let seen = on_screen(&camera, 1.6, ray.origin_m + ray.direction * 3.0);
        assert!(seen.truncate().abs_diff_eq(ndc, 1e-5), "{seen} for {ndc}");
    }
}

/// A lens with its principal point off the middle.
const LENS: Pinhole = Pinhole {
    width: 640,
    height: 480,
    fx: 520.0,
    fy: 530.0,
    cx: 330.0,
    cy: 231.0,
};

/// A camera at (1, 2, 1.4) that looks along `forward` with `down` as its y axis.
fn photo(forward: Vec3, down: Vec3) -> Affine3A {
    let right = down.cross(forward);
    Affine3A {
        matrix3: Mat3A::from_cols(right.into(), down.into(), forward.into()),
        translation: Vec3::new(1.0, 2.0, 1.4).into(),
    }
}

#[test]
fn looking_through_a_photo_puts_points_where_the_photo_has_them() {
    let poses = [
        photo(Vec3::X, -Vec3::Z),
        // Tilted, and held askew.
        photo(
            Vec3::new(0.48, 0.64, -0.6),
            Vec3::new(0.8, -0.6, 0.0)
                .lerp(Vec3::new(-0.36, -0.48, -0.8), 0.4)
                .normalize(),
        ),
        // Portrait: the picture's top points west.
        photo(Vec3::Y, Vec3::X),
        // Straight down and straight up, where headings are hard.
        photo(-Vec3::Z, -Vec3::Y),
        photo(Vec3::Z, Vec3::new(0.6, 0.8, 0.0)),
    ];
    for world_from_camera in poses {
        // A picture wider than the photo, and a narrower one: the photo fits both.
        for aspect in [2.0, 0.7] {
            let camera = OrbitCamera::looking_through(&world_from_camera, &LENS, aspect, 2.0);
            for pixel in [
                Vec2::new(0.0, 0.0),
                Vec2::new(600.0, 100.0),
                Vec2::new(40.0, 470.0),
            ] {
                let point = world_from_camera.transform_point3(LENS.ray(pixel) * 2.5);
                let found = on_screen(&camera, aspect, point).truncate();
                // Offsets from the photo's middle, in halves of the picture's height; fx and fy
                // differ, and the viewer has square pixels.
                let from_middle = (pixel - Vec2::new(319.5, 239.5)) / Vec2::new(520.0, 530.0);
                let half_height = if aspect > 1.0 {
                    240.0 / 530.0
                } else {
                    320.0 / 520.0 / aspect
                };
                let expected = from_middle / half_height * Vec2::new(1.0 / aspect, -1.0);
                assert!(
                    found.abs_diff_eq(expected, 2e-3),
                    "{found} instead of {expected} at {pixel}"
                );
            }
        }
    }
}

#[test]
fn turns_go_the_short_way() {
    assert!((nearest_turn(0.1, TAU - 0.1) - (TAU + 0.1)).abs() < 1e-5);
    assert!((nearest_turn(3.0, -3.0) - (3.0 - TAU)).abs() < 1e-5);
}
