//! Changes of pictures stay within bounds and do what they say.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use scan::{Camera, ColorImage, DepthImage};
use train::data::augment::{Change, draw};
use train::data::picture::{Fit, mirror};
use train::random::Random;

const WIDTH: usize = 32;
const HEIGHT: usize = 16;

fn noise(seed: u64) -> Vec<f32> {
    let mut random = Random::new(seed, 0);
    (0..3 * WIDTH * HEIGHT)
        .map(|_| random.range(0.0, 255.0))
        .collect()
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

#[test]
fn every_change_stays_within_bounds_and_all_are_drawn() {
    let mut kinds = [0; 5];
    for index in 0..400 {
        let mut random = Random::new(3, index);
        let changes = draw(640, &mut random);
        let of = |change: &Change| match *change {
            Change::Brightness(f) | Change::Contrast(f) | Change::Saturation(f) => {
                assert!((0.5..=1.5).contains(&f), "{f}");
                std::mem::discriminant(change)
            }
            Change::Hue(turn) => {
                assert!(turn.abs() <= 0.05, "{turn}");
                std::mem::discriminant(change)
            }
            Change::Blur(sigma) => {
                assert!((1.0..=3.0).contains(&sigma), "{sigma}");
                std::mem::discriminant(change)
            }
        };
        assert_ne!(of(&changes[0]), of(&changes[1]), "twice the same kind");
        for change in &changes {
            let kind = match change {
                Change::Brightness(_) => 0,
                Change::Contrast(_) => 1,
                Change::Hue(_) => 2,
                Change::Saturation(_) => 3,
                Change::Blur(_) => 4,
            };
            kinds[kind] += 1;
        }
        let mut image = noise(index);
        changes
            .iter()
            .for_each(|change| change.apply(&mut image, WIDTH));
        assert!(image.iter().all(|v| (0.0..=255.0).contains(v)));
    }
    assert!(kinds.iter().all(|&n| n > 110), "{kinds:?}");
}

#[test]
fn a_factor_of_one_changes_nothing() {
    let before = noise(1);
    for change in [
        Change::Brightness(1.0),
        Change::Contrast(1.0),
        Change::Saturation(1.0),
        Change::Hue(0.0),
    ] {
        let mut image = before.clone();
        change.apply(&mut image, WIDTH);
        let off = image
            .iter()
            .zip(&before)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(off < 1e-3, "{change:?} changed by {off}");
    }
}

#[test]
fn changes_do_what_they_say() {
    let planes = |r: f32, g: f32, b: f32| -> Vec<f32> {
        [r, g, b]
            .iter()
            .flat_map(|&v| vec![v; WIDTH * HEIGHT])
            .collect()
    };
    let mut image = planes(200.0, 50.0, 50.0);
    // A third of the circle: red becomes green.
    Change::Hue(1.0 / 3.0).apply(&mut image, WIDTH);
    assert!((image[0] - 50.0).abs() < 0.01 && (image[WIDTH * HEIGHT] - 200.0).abs() < 0.01);
    let mut image = planes(200.0, 50.0, 50.0);
    Change::Saturation(0.0).apply(&mut image, WIDTH);
    assert!((image[0] - image[WIDTH * HEIGHT]).abs() < 0.01, "grey");
    let mut image = planes(100.0, 100.0, 100.0);
    Change::Brightness(0.5).apply(&mut image, WIDTH);
    assert!((image[0] - 50.0).abs() < 0.01);
    let spread = |image: &[f32]| {
        let m = mean(image);
        image.iter().map(|v| (v - m).powi(2)).sum::<f32>()
    };
    let before = noise(2);
    let mut image = before.clone();
    Change::Contrast(0.5).apply(&mut image, WIDTH);
    assert!((spread(&image) / spread(&before) - 0.25).abs() < 0.01);
    let mut image = before.clone();
    Change::Blur(1.0).apply(&mut image, WIDTH);
    assert!(spread(&image) < 0.3 * spread(&before));
    assert!(
        (mean(&image) - mean(&before)).abs() < 3.0,
        "blur keeps the mean"
    );
}

#[test]
fn resizing_keeps_what_a_pixel_shows() {
    // A picture whose red is its column and whose green is its row: after any fit the camera must say the same.
    let (width, height) = (320_u32, 240_u32);
    let rgb = (0..height).flat_map(|y| (0..width).flat_map(move |x| [(x / 2) as u8, y as u8, 0]));
    let image = ColorImage {
        width,
        height,
        rgb: rgb.collect(),
    };
    let depth_m =
        (0..height).flat_map(|y| (0..width).map(move |x| 1.0 + x as f32 + 1000.0 * y as f32));
    let depth = DepthImage {
        width,
        height,
        depth_m: depth_m.collect(),
    };
    let camera = Camera {
        width,
        height,
        fx: 250.0,
        fy: 260.0,
        cx: 150.5,
        cy: 119.0,
    };
    for size in [[160, 120], [160, 96], [96, 160], [320, 240], [112, 80]] {
        let fit = Fit::new(width, height, size);
        let small = fit.camera(&camera);
        let (w, h) = (size[0] as usize, size[1] as usize);
        let color = fit.color(&image);
        let measured = fit.depth(&camera, &depth, &camera);
        for (x, y) in [(10, 10), (w - 20, 30), (w / 2, h - 12)] {
            let ray = small.ray(glam::Vec2::new(x as f32, y as f32));
            let u = camera.fx as f32 * ray.x + camera.cx as f32;
            let v = camera.fy as f32 * ray.y + camera.cy as f32;
            let red = color[y * w + x];
            let green = color[w * h + y * w + x];
            // Red counts columns in pairs, which is a quarter less on average.
            assert!(
                (2.0 * red + 0.5 - u).abs() < 0.8,
                "{size:?}: column {red} for {u}"
            );
            assert!((green - v).abs() < 0.1, "{size:?}: row {green} for {v}");
            let here = measured[y * w + x] - 1.0;
            assert!((here % 1000.0 - u).abs() <= 0.51 && (here / 1000.0 - v).abs() < 1.0);
        }
    }
}

#[test]
fn mirroring_turns_rows_round() {
    let mut values = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    mirror(&mut values, 3);
    assert_eq!(values, [3.0, 2.0, 1.0, 6.0, 5.0, 4.0]);
}
