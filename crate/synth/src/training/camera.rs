//! What a camera makes of light: exposure, colour, blur, noise. Strengths differ from scan to scan.

use std::sync::OnceLock;

use glam::Vec3;
use scan::Camera;

use crate::path::View;
use crate::random::{Random, hash, hash_unit, noise};
use crate::training::render::Linear;

/// One camera with its habits, the same through a scan.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    /// Wanted mean of the picture, linear.
    target: f32,
    /// How much a frame's own brightness sets its exposure, 0 to 1; the rest is the scan's.
    automatic: f32,
    /// Sizes of slow changes of exposure (stops) and of white balance.
    drift: [f32; 2],
    white: Vec3,
    /// How much of the light's own colour is taken out, 0 to 1.
    neutral: f32,
    /// Blur of the lens as a share of the width.
    blur: f32,
    /// Open share of the time between two frames.
    shutter: f32,
    /// Noise at full and at no light.
    shot: f32,
    read: f32,
    chroma: f32,
    vignette: f32,
    /// From a straight line to a film's curve.
    film: f32,
    saturation: f32,
    sharpen: f32,
    /// JPEG quality.
    pub quality: u8,
    seed: u32,
}

/// A pinhole camera as devices have them: 50 to 85 degrees across, its axis near the middle.
pub(crate) fn pinhole(r: &mut Random, width: u32, height: u32) -> Camera {
    let half = r.range(50.0, 85.0).to_radians() * 0.5;
    let fx = 0.5 * f64::from(width) / f64::from(libm::tanf(half));
    let mut offset = |size: u32| f64::from(r.range(-0.025, 0.025)) * f64::from(size);
    let (cx, cy) = (offset(width), offset(height));
    Camera {
        width,
        height,
        fx,
        fy: fx * f64::from(r.range(0.995, 1.005)),
        cx: 0.5 * (f64::from(width) - 1.0) + cx,
        cy: 0.5 * (f64::from(height) - 1.0) + cy,
    }
}

impl Sensor {
    pub fn new(r: &mut Random) -> Self {
        // A third of the cameras are good, a third usual, a third bad.
        let bad = r.unit();
        let worse = |r: &mut Random, most: f32| most * bad * bad * r.range(0.3, 1.0);
        Self {
            target: r.range(0.13, 0.27),
            automatic: r.range(0.3, 1.0),
            drift: [r.range(0.0, 0.35), r.range(0.0, 0.06)],
            white: Vec3::new(r.range(-0.08, 0.08), 0.0, r.range(-0.1, 0.08)),
            neutral: r.range(0.5, 1.0),
            blur: worse(r, 0.0035),
            shutter: if r.chance(0.4) { 0.0 } else { worse(r, 0.5) },
            shot: 0.008 + worse(r, 0.07),
            read: 0.0015 + worse(r, 0.014),
            chroma: worse(r, 0.03),
            vignette: r.range(0.0, 0.45) * r.unit(),
            film: r.unit(),
            saturation: r.range(0.65, 1.2),
            sharpen: if r.chance(0.5) {
                r.range(0.0, 0.8)
            } else {
                0.0
            },
            quality: (96.0 - worse(r, 45.0)) as u8,
            seed: r.bits(),
        }
    }

    /// Develops frame `index`. `mean` is the scan's mean colour; `next` the view after this one.
    pub fn develop(
        &self,
        linear: &Linear,
        index: usize,
        mean: Vec3,
        view: &View,
        next: Option<&View>,
    ) -> Vec<[u8; 3]> {
        let width = linear.width;
        let mean_color = mean;
        let mean = grey(mean);
        let mut color: Vec<Vec3> = linear
            .color
            .iter()
            .map(|c| c.min(Vec3::splat(12.0 * mean)))
            .collect();
        if let Some(motion) = self.motion(index, view, next) {
            color = smear(&color, width, motion);
        }
        let hunting = if hash(index as i32, 1, 0, self.seed).is_multiple_of(11) {
            2.0
        } else {
            0.0
        };
        let sigma = self.blur * (1.0 + hunting) * width as f32;
        if sigma > 0.15 {
            color = soften(&color, width, sigma);
        }
        let gain = self.exposure(&color, index, mean);
        let balance = self.balance(index, mean_color);
        // What needs much light is noisy.
        let grain =
            (gain * mean / self.target).max(0.3) * (0.35 / mean.max(0.02)).clamp(0.5, 3.0).sqrt();
        let height = color.len() / width;
        let center = [0.5 * width as f32, 0.5 * height as f32];
        let reach = center[0] * center[0] + center[1] * center[1];
        for (i, c) in color.iter_mut().enumerate() {
            let (x, y) = (
                (i % width) as f32 - center[0],
                (i / width) as f32 - center[1],
            );
            let dark = 1.0 - self.vignette * (x * x + y * y) / reach;
            *c = *c * balance * (gain * dark);
            *c = self.add_noise(*c, i, width, index, grain);
        }
        let mut rgb: Vec<Vec3> = color.into_iter().map(|c| self.tone(c)).collect();
        if self.sharpen > 0.0 {
            let soft = soften(&rgb, width, 0.8);
            for (c, soft) in rgb.iter_mut().zip(soft) {
                *c += (*c - soft) * self.sharpen;
            }
        }
        rgb.into_iter()
            .map(|c| {
                (c.clamp(Vec3::ZERO, Vec3::ONE) * 255.0 + 0.5)
                    .to_array()
                    .map(|v| v as u8)
            })
            .collect()
    }

    /// By how many pixels, right and down, the picture moves while the shutter is open.
    fn motion(&self, index: usize, view: &View, next: Option<&View>) -> Option<[f32; 2]> {
        let next = next?;
        let local = view.rotation.transpose()
            * (next.rotation.z_axis + 0.4 * (view.position_m - next.position_m));
        let pixel = view.camera.project(local.as_dvec3())?;
        let open = self.shutter * hash_unit(index as i32, 2, 0, self.seed);
        let most = 0.045 * view.camera.width as f32;
        let move_by = |to: f64, from: f64| ((from - to) as f32 * open).clamp(-most, most);
        let motion = [
            move_by(pixel.x, view.camera.cx),
            move_by(pixel.y, view.camera.cy),
        ];
        (motion[0].abs().max(motion[1].abs()) > 0.3).then_some(motion)
    }

    fn exposure(&self, color: &[Vec3], index: usize, mean: f32) -> f32 {
        let own = grey(mean_color(color)).max(1e-4);
        let metered = libm::powf(own, self.automatic) * libm::powf(mean, 1.0 - self.automatic);
        let slow = 2.0 * noise(Vec3::new(index as f32 * 0.12, 0.0, 0.0), self.seed ^ 0xE4) - 1.0;
        self.target / metered * libm::exp2f(self.drift[0] * slow)
    }

    fn balance(&self, index: usize, mean: Vec3) -> Vec3 {
        let slow =
            |k: u32| 2.0 * noise(Vec3::new(index as f32 * 0.07, 0.0, 0.0), self.seed ^ k) - 1.0;
        let drift = Vec3::new(slow(0xA1), 0.0, slow(0xA2)) * self.drift[1];
        let cast = Vec3::ONE.lerp(grey(mean) / mean.max(Vec3::splat(1e-5)), self.neutral);
        (Vec3::ONE + self.white + drift) * cast.clamp(Vec3::splat(0.4), Vec3::splat(2.5))
    }

    fn add_noise(&self, c: Vec3, i: usize, width: usize, frame: usize, grain: f32) -> Vec3 {
        let bell = |k: i32| {
            let bits = hash(i as i32, frame as i32, k, self.seed);
            let part = |shift: u32| ((bits >> shift) & 0x3FF) as f32 / 1024.0;
            2.0 * (part(0) + part(10) + part(20)) - 3.0
        };
        let light = bell(0);
        let deviation =
            |v: f32| (self.shot * self.shot * v.max(0.0) + self.read * self.read).sqrt() * grain;
        let mut out = c;
        for channel in 0..3 {
            // Half of the noise is common to the channels after demosaicing.
            let own = 0.6 * light + 0.8 * bell(channel as i32 + 1);
            out[channel] += deviation(c[channel]) * own;
        }
        // Blotches of colour, a few pixels wide.
        let (u, v) = ((i % width) as f32 / 3.0, (i / width) as f32 / 3.0);
        let blotch = |k: u32| noise(Vec3::new(u, v, frame as f32 * 7.3), self.seed ^ k) - 0.5;
        let level = self.chroma * grain * (0.15 + c.max_element()).min(1.0);
        out + Vec3::new(
            blotch(0xB1),
            -0.5 * blotch(0xB1) - 0.5 * blotch(0xB2),
            blotch(0xB2),
        ) * level
    }

    /// Linear light to sRGB, 0 to 1 and beyond.
    fn tone(&self, c: Vec3) -> Vec3 {
        let grey = Vec3::splat(grey(c));
        let c = (grey + (c - grey) * self.saturation).max(Vec3::ZERO);
        let film = |x: f32| {
            let x = 0.8 * x;
            x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
        };
        Vec3::from(
            c.to_array()
                .map(|x| encode(self.film * film(x) + (1.0 - self.film) * x)),
        )
    }
}

fn grey(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Mean colour of a picture in which nothing counts more than twice the mean.
pub(crate) fn mean_color(color: &[Vec3]) -> Vec3 {
    let share = 1.0 / color.len().max(1) as f32;
    let most = 2.0 * share * color.iter().map(|c| grey(*c)).sum::<f32>();
    let bounded = |c: &Vec3| *c * (most / grey(*c).max(1e-6)).min(1.0);
    color.iter().map(bounded).sum::<Vec3>() * share
}

/// sRGB of linear light, both 0 to 1, between entries that lie closer where it is dark.
fn encode(x: f32) -> f32 {
    const STEPS: usize = 512;
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let curve = |i: usize| {
            let root = i as f32 / STEPS as f32;
            let x = root * root;
            if x <= 0.003_130_8 {
                x * 12.92
            } else {
                1.055 * libm::powf(x, 1.0 / 2.4) - 0.055
            }
        };
        (0..=STEPS + 1).map(curve).collect()
    });
    let at = x.clamp(0.0, 1.0).sqrt() * STEPS as f32;
    let low = at as usize;
    table[low] + (table[low + 1] - table[low]) * (at - low as f32)
}

/// The mean along a line.
fn smear(color: &[Vec3], width: usize, [x, y]: [f32; 2]) -> Vec<Vec3> {
    let height = color.len() / width;
    let taps = x.abs().max(y.abs()).ceil() as usize + 2;
    let offsets: Vec<(f32, f32)> = (0..taps)
        .map(|k| k as f32 / (taps - 1) as f32 - 0.5)
        .map(|share| (x * share, y * share))
        .collect();
    (0..color.len())
        .map(|i| {
            let (u, v) = ((i % width) as f32, (i / width) as f32);
            let sum: Vec3 = offsets
                .iter()
                .map(|(dx, dy)| sample(color, [width, height], u + dx, v + dy))
                .sum();
            sum / taps as f32
        })
        .collect()
}

fn sample(color: &[Vec3], [width, height]: [usize; 2], u: f32, v: f32) -> Vec3 {
    let (u, v) = (
        u.clamp(0.0, (width - 1) as f32),
        v.clamp(0.0, (height - 1) as f32),
    );
    let (x, y) = (u as usize, v as usize);
    let (fx, fy) = (u - x as f32, v - y as f32);
    let (x1, y1) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
    let row = |y: usize| color[y * width + x].lerp(color[y * width + x1], fx);
    row(y).lerp(row(y1), fy)
}

/// A Gaussian blur of `sigma` pixels.
fn soften(color: &[Vec3], width: usize, sigma: f32) -> Vec<Vec3> {
    let height = color.len() / width;
    let reach = ((2.5 * sigma).ceil() as i32).max(1);
    let weights: Vec<f32> = (-reach..=reach)
        .map(|k| libm::expf(-0.5 * (k * k) as f32 / (sigma * sigma)))
        .collect();
    let total: f32 = weights.iter().sum();
    let pass = |from: &[Vec3], along_x: bool| -> Vec<Vec3> {
        (0..from.len())
            .map(|i| {
                let (u, v) = ((i % width) as i32, (i / width) as i32);
                let sum: Vec3 = weights
                    .iter()
                    .zip(-reach..=reach)
                    .map(|(weight, k)| {
                        let (x, y) = if along_x { (u + k, v) } else { (u, v + k) };
                        let x = x.clamp(0, width as i32 - 1) as usize;
                        let y = y.clamp(0, height as i32 - 1) as usize;
                        from[y * width + x] * *weight
                    })
                    .sum();
                sum / total
            })
            .collect()
    };
    pass(&pass(color, true), false)
}
