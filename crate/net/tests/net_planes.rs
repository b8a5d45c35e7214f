//! Pictures to planes.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Gradients, Tensor, TensorData};
use glam::{Affine3A, Quat, Vec3};
use mesh::camera::Pinhole;
use net::planes::{Plane, PlaneNet};
use net::{NetConfig, View};

const WIDTH: usize = 72;
const HEIGHT: usize = 56;

fn views() -> Vec<View> {
    let camera = Pinhole {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        fx: 64.0,
        fy: 66.0,
        cx: 35.0,
        cy: 28.5,
    };
    [(0.3, 0.2, -0.1), (-1.1, 0.4, 0.7)]
        .map(|(yaw, pitch, roll)| View {
            camera,
            world_from_camera: Affine3A::from_rotation_translation(
                Quat::from_euler(glam::EulerRot::ZYX, yaw, pitch, roll),
                Vec3::new(yaw, pitch, roll),
            ),
        })
        .to_vec()
}

fn images(device: &Device) -> Tensor<4> {
    let shape = [2, 3, HEIGHT, WIDTH];
    let values = common::numbers("images", shape.iter().product(), 127.0);
    let values: Vec<f32> = values.iter().map(|v| v + 127.5).collect();
    Tensor::from_data(TensorData::new(values, shape), device)
}

struct Missing<'a> {
    grads: &'a Gradients,
    path: Vec<String>,
    missing: Vec<String>,
}

impl ModuleVisitor for Missing<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }
    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if param.is_require_grad() {
            let zero = match param.val().grad(self.grads) {
                None => true,
                Some(grad) => {
                    let largest = grad.abs().max().into_scalar::<f32>();
                    !(largest > 0.0 && largest.is_finite())
                }
            };
            if zero {
                self.missing.push(self.path.join("."));
            }
        }
    }
}

fn loss(planes: [Plane; 3]) -> Tensor<1> {
    planes
        .into_iter()
        .flat_map(|plane| [Some(plane.base), plane.hidden, plane.confidence])
        .flatten()
        .map(|t| t.square().mean())
        .reduce(|a, b| a + b)
        .unwrap()
}

#[test]
fn every_parameter_has_a_gradient() {
    let device = Device::flex().autodiff();
    let net = common::filled(PlaneNet::init(&NetConfig::small(), &device));
    let grads = loss(net.forward(images(&device), &views())).backward();
    let mut visitor = Missing {
        grads: &grads,
        path: Vec::new(),
        missing: Vec::new(),
    };
    net.visit(&mut visitor);
    assert!(visitor.missing.is_empty(), "{:?}", visitor.missing);
}
