//! Adam (Kingma and Ba, ICLR 2015) over a module whose tensors go by their paths: so that a checkpoint can be read
//! without the process that wrote it.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use std::collections::BTreeMap;

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// The optimiser's memory.
#[derive(Debug, Default)]
pub struct Adam {
    moments: BTreeMap<String, Moments<Tensor<1>>>,
}

/// Of one tensor: how often it was stepped, and the running means of its gradient and of the gradient's square.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments<T> {
    /// Steps so far.
    pub time: u64,
    /// Mean of the gradient.
    pub first: T,
    /// Mean of its square.
    pub second: T,
}

impl Adam {
    /// One step: `m = 0.9 m + 0.1 g`, `v = 0.999 v + 0.001 g²`, `p -= rate * m̂ / (sqrt(v̂) + 1e-8)` with m̂ and v̂ freed of
    /// their start at 0. The gradients are multiplied by `scale` first. A tensor without a gradient stays.
    pub fn step<M: Module>(
        &mut self,
        module: M,
        rate: f64,
        scale: f64,
        grads: GradientsParams,
    ) -> M {
        let mut mapper = Mapper {
            adam: self,
            path: Vec::new(),
            rate,
            scale,
            grads,
        };
        module.map(&mut mapper)
    }

    /// The memory in numbers.
    pub fn numbers(&self) -> BTreeMap<String, Moments<Vec<f32>>> {
        let read = |tensor: &Tensor<1>| tensor.clone().into_data().iter::<f32>().collect();
        let entry = |(path, moments): (&String, &Moments<Tensor<1>>)| {
            let numbers = Moments {
                time: moments.time,
                first: read(&moments.first),
                second: read(&moments.second),
            };
            (path.clone(), numbers)
        };
        self.moments.iter().map(entry).collect()
    }

    /// The memory from numbers, on the device (without autodiff) of the module's tensors.
    pub fn from_numbers(numbers: BTreeMap<String, Moments<Vec<f32>>>, device: &Device) -> Self {
        let write = |numbers: Vec<f32>| {
            let shape = [numbers.len()];
            Tensor::from_data(TensorData::new(numbers, shape), device)
        };
        let entry = |(path, moments): (String, Moments<Vec<f32>>)| {
            let moments = Moments {
                time: moments.time,
                first: write(moments.first),
                second: write(moments.second),
            };
            (path, moments)
        };
        Self {
            moments: numbers.into_iter().map(entry).collect(),
        }
    }
}

struct Mapper<'a> {
    adam: &'a mut Adam,
    path: Vec<String>,
    rate: f64,
    scale: f64,
    grads: GradientsParams,
}

impl ModuleMapper for Mapper<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(grad) = self.grads.remove::<D>(param.id) else {
            return param;
        };
        let shape = param.lazy_shape();
        let grad = grad.reshape([shape.num_elements()]).mul_scalar(self.scale);
        let before = self.adam.moments.remove(&self.path.join("."));
        let square = grad.clone().square().mul_scalar(1.0 - BETA_2);
        let grad = grad.mul_scalar(1.0 - BETA_1);
        let moments = match before {
            None => Moments {
                time: 1,
                first: grad,
                second: square,
            },
            Some(old) => Moments {
                time: old.time + 1,
                first: old.first.mul_scalar(BETA_1) + grad,
                second: old.second.mul_scalar(BETA_2) + square,
            },
        };
        let time = moments.time.min(i32::MAX as u64) as i32;
        let root = moments
            .second
            .clone()
            .div_scalar(1.0 - BETA_2.powi(time))
            .sqrt();
        let step = moments.first.clone() / root.add_scalar(EPSILON);
        let step = step.mul_scalar(self.rate / (1.0 - BETA_1.powi(time)));
        self.adam.moments.insert(self.path.join("."), moments);
        param.map(|old| {
            let tracked = old.is_require_grad();
            let stepped = Tensor::from_inner(old.inner() - step.reshape(shape));
            if tracked {
                stepped.require_grad()
            } else {
                stepped
            }
        })
    }
}

/// Length of all gradients of a module as one vector.
pub fn norm<M: Module>(module: &M, grads: &GradientsParams) -> f64 {
    let mut visitor = Norm { grads, sum: None };
    module.visit(&mut visitor);
    let sum = visitor.sum.map_or(0.0, |sum| {
        sum.into_data().iter::<f32>().next().unwrap_or_default()
    });
    f64::from(sum).sqrt()
}

struct Norm<'a> {
    grads: &'a GradientsParams,
    sum: Option<Tensor<1>>,
}

impl ModuleVisitor for Norm<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if let Some(grad) = self.grads.get::<D>(param.id) {
            let square = grad.square().sum();
            self.sum = Some(match self.sum.take() {
                None => square,
                Some(sum) => sum + square,
            });
        }
    }
}
