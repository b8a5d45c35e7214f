//! Other light and another lens: the same change for all pictures of a sample (method 1.10).

use crate::random::Random;

/// A change of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Times a factor.
    Brightness(f32),
    /// Away from (above 1) or towards the mean grey.
    Contrast(f32),
    /// Hue turned by a share of the circle.
    Hue(f32),
    /// Away from (above 1) or towards grey.
    Saturation(f32),
    /// Gaussian blur of this many pixels.
    Blur(f32),
}

/// Two different changes: brightness, contrast and saturation by 0.5 to 1.5, hue by up to 0.05, blur of 1 to 3 pixels of a
/// picture 640 wide.
pub fn draw(width: u32, random: &mut Random) -> [Change; 2] {
    let first = random.below(5);
    let second = (first + 1 + random.below(4)) % 5;
    [first, second].map(|kind| match kind {
        0 => Change::Brightness(random.range(0.5, 1.5)),
        1 => Change::Contrast(random.range(0.5, 1.5)),
        2 => Change::Hue(random.range(-0.05, 0.05)),
        3 => Change::Saturation(random.range(0.5, 1.5)),
        _ => Change::Blur(random.range(1.0, 3.0) * width as f32 / 640.0),
    })
}

impl Change {
    /// Changes a picture `[3, H, W]`, 0 to 255, in place; it stays within 0 to 255.
    pub fn apply(self, image: &mut [f32], width: usize) {
        let pixels = image.len() / 3;
        let grey = |image: &[f32], i: usize| {
            0.299 * image[i] + 0.587 * image[pixels + i] + 0.114 * image[2 * pixels + i]
        };
        match self {
            Self::Brightness(factor) => image.iter_mut().for_each(|v| *v *= factor),
            Self::Contrast(factor) => {
                let mean = (0..pixels).map(|i| grey(image, i)).sum::<f32>() / pixels.max(1) as f32;
                for v in image.iter_mut() {
                    *v = mean + factor * (*v - mean);
                }
            }
            Self::Saturation(factor) => {
                for i in 0..pixels {
                    let grey = grey(image, i);
                    for channel in 0..3 {
                        let v = &mut image[channel * pixels + i];
                        *v = grey + factor * (*v - grey);
                    }
                }
            }
            Self::Hue(turn) => {
                for i in 0..pixels {
                    let rgb = [0, 1, 2].map(|channel| image[channel * pixels + i]);
                    for (channel, v) in turn_hue(rgb, turn).into_iter().enumerate() {
                        image[channel * pixels + i] = v;
                    }
                }
            }
            Self::Blur(sigma) => image
                .chunks_exact_mut(pixels)
                .for_each(|plane| blur(plane, width, sigma)),
        }
        image.iter_mut().for_each(|v| *v = v.clamp(0.0, 255.0));
    }
}

/// Through HSV and back (Smith, SIGGRAPH 1978).
fn turn_hue([r, g, b]: [f32; 3], turn: f32) -> [f32; 3] {
    let most = r.max(g).max(b);
    let range = most - r.min(g).min(b);
    if range <= 0.0 {
        return [r, g, b];
    }
    let sixth = if most == r {
        (g - b) / range
    } else if most == g {
        2.0 + (b - r) / range
    } else {
        4.0 + (r - g) / range
    };
    let hue = (sixth + 6.0 * turn).rem_euclid(6.0);
    [5.0, 3.0, 1.0].map(|n| {
        let k = (n + hue) % 6.0;
        most - range * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Seven taps along rows, then along columns; edge pixels repeat.
fn blur(plane: &mut [f32], width: usize, sigma: f32) {
    let taps = [-3_isize, -2, -1, 0, 1, 2, 3];
    let weights = taps.map(|t| (-0.5 * (t as f32 / sigma).powi(2)).exp());
    let sum: f32 = weights.iter().sum();
    let height = plane.len() / width;
    let mut passed = plane.to_vec();
    let mean = |from: &[f32], at: usize, len: usize, index: &dyn Fn(usize) -> usize| {
        let tap = |t: isize| from[index(at.saturating_add_signed(t).min(len - 1))];
        taps.iter()
            .zip(weights)
            .map(|(&t, w)| w * tap(t))
            .sum::<f32>()
            / sum
    };
    for y in 0..height {
        for x in 0..width {
            passed[x + width * y] = mean(plane, x, width, &|x| x + width * y);
        }
    }
    for y in 0..height {
        for x in 0..width {
            plane[x + width * y] = mean(&passed, y, height, &|y| x + width * y);
        }
    }
}
