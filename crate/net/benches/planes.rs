//! Where the time of the planes goes on the processor, forward and backward:
//! `cargo bench --workspace --bench net_planes`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use burn::tensor::{Device, Distribution, Tensor};
use glam::Affine3A;
use mesh::camera::Pinhole;
use net::planes::PlaneNet;
use net::{Level, NetConfig, View};

const VIEWS: usize = 8;

/// Milliseconds of the fastest of some runs, forward and backward; the gradient starts as ones everywhere.
fn timed(
    inputs: &[[usize; 4]],
    device: &Device,
    run: impl Fn(Vec<Tensor<4>>) -> Vec<Tensor<4>>,
) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..5 {
        let inputs = inputs
            .iter()
            .map(|shape| {
                Tensor::random(*shape, Distribution::Normal(0.0, 1.0), device).require_grad()
            })
            .collect();
        let start = Instant::now();
        let outputs = run(inputs);
        let forward = start.elapsed().as_secs_f64();
        let loss = outputs
            .into_iter()
            .map(Tensor::sum)
            .reduce(|a, b| a + b)
            .unwrap();
        let start = Instant::now();
        let _ = loss.backward();
        let backward = start.elapsed().as_secs_f64();
        best[0] = best[0].min(forward * 1e3);
        best[1] = best[1].min(backward * 1e3);
    }
    best
}

/// Milliseconds, the median of some runs, of a picture of 640 x 480 without gradients, as a whole and by part.
fn picture() {
    const SIZE: [usize; 2] = [640, 480];
    let device = Device::flex();
    let config = NetConfig::small();
    let net = PlaneNet::init(&config, &device);
    let [width, height] = SIZE;
    let camera = Pinhole {
        width: width as u32,
        height: height as u32,
        fx: 0.9 * width as f32,
        fy: 0.9 * width as f32,
        cx: 0.5 * width as f32,
        cy: 0.5 * height as f32,
    };
    let views = [View {
        camera,
        world_from_camera: Affine3A::IDENTITY,
    }];
    let random = |channels: usize, [w, h]: [usize; 2]| {
        Tensor::<4>::random([1, channels, h, w], Distribution::Normal(0.0, 1.0), &device)
    };
    let report = |part: &str, run: &dyn Fn()| {
        let mut times: Vec<f64> = (0..25)
            .map(|_| {
                let start = Instant::now();
                run();
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("  {part:24} {:8.2}", times[12]);
    };
    println!("small, a picture of {width} x {height} without gradients: forward in ms");
    let image = random(3, SIZE);
    report("whole", &|| drop(net.forward(image.clone(), &views)));
    report("backbone", &|| drop(net.backbone.forward(image.clone())));
    let strided = net.backbone.forward(image.clone());
    report("pyramid", &|| drop(net.pyramid.forward(strided.clone())));
    for (level, x) in Level::ALL.into_iter().zip(net.pyramid.forward(strided)) {
        let parts = &net.levels[level as usize];
        let run = |part: &str, run: &dyn Fn()| report(&format!("{level:?} {part}"), run);
        run("rays", &|| {
            drop(parts.rays.forward(x.clone(), &views, level))
        });
        let pce = parts.pce.as_ref().unwrap();
        run("pce", &|| drop(pce.forward(x.clone())));
        let acm = parts.acm.as_ref().unwrap();
        run("acm", &|| drop(acm.forward(x.clone())));
        let both = Tensor::cat(vec![x.clone(), x.clone()], 1);
        let ipsd = parts.ipsd.as_ref().unwrap();
        run("ipsd", &|| drop(ipsd.forward(both.clone(), x.clone())));
    }
}

fn main() {
    picture();
    let device = Device::flex().autodiff();
    for (name, config) in [("small", NetConfig::small()), ("full", NetConfig::full())] {
        for (width, height) in [(160, 120), (320, 240)] {
            let net = PlaneNet::init(&config, &device);
            let camera = Pinhole {
                width: width as u32,
                height: height as u32,
                fx: width as f32,
                fy: width as f32,
                cx: width as f32 / 2.0,
                cy: height as f32 / 2.0,
            };
            let views = vec![
                View {
                    camera,
                    world_from_camera: Affine3A::IDENTITY,
                };
                VIEWS
            ];
            let at = |channels: usize, level: Level| {
                let [w, h] = net::planes::plane_size(width, height, level);
                [VIEWS, channels, h, w]
            };
            println!("{name}, {VIEWS} views of {width} x {height}: forward, backward in ms");
            let report = |part: &str, [f, b]: [f64; 2]| println!("  {part:24} {f:8.2} {b:8.2}");
            let image = [VIEWS, 3, height, width];
            report(
                "whole",
                timed(&[image], &device, |x| {
                    let planes = net.forward(x.into_iter().next().unwrap(), &views);
                    let parts = planes.map(|p| [Some(p.base), p.hidden, p.confidence]);
                    parts.into_iter().flatten().flatten().collect()
                }),
            );
            report(
                "backbone",
                timed(&[image], &device, |x| {
                    net.backbone.forward(x.into_iter().next().unwrap()).to_vec()
                }),
            );
            let b = config.backbone;
            let strided = [
                at(b[4], Level::Coarse),
                at(b[3], Level::Medium),
                at(b[2], Level::Fine),
            ];
            report(
                "pyramid",
                timed(&strided, &device, |x| {
                    net.pyramid.forward(x.try_into().unwrap()).to_vec()
                }),
            );
            for level in Level::ALL {
                let channels = config.planes[level as usize];
                let parts = &net.levels[level as usize];
                let shape = at(channels, level);
                let one = |x: Vec<Tensor<4>>| x.into_iter().next().unwrap();
                report(
                    &format!("{level:?} rays"),
                    timed(&[shape], &device, |x| {
                        vec![parts.rays.forward(one(x), &views, level)]
                    }),
                );
                report(
                    &format!("{level:?} pce"),
                    timed(&[shape], &device, |x| {
                        let (r, c) = parts.pce.as_ref().unwrap().forward(one(x));
                        vec![r, c]
                    }),
                );
                report(
                    &format!("{level:?} acm"),
                    timed(&[shape], &device, |x| {
                        vec![parts.acm.as_ref().unwrap().forward(one(x))]
                    }),
                );
                report(
                    &format!("{level:?} ipsd"),
                    timed(&[at(2 * channels, level), shape], &device, |x| {
                        let [cr, f]: [Tensor<4>; 2] = x.try_into().unwrap();
                        vec![parts.ipsd.as_ref().unwrap().forward(cr, f)]
                    }),
                );
            }
        }
    }
}
