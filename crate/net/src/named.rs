//! Every tensor of a module by its path, such as `planes.backbone.stem.conv.weight`: for files, counts and tests.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

/// Float tensors of `module` in the order in which it holds them, statistics of normalisation among them. Reads from the
/// device at once, which a browser's GPU does not allow: load there, do not read.
pub fn tensors(module: &impl Module) -> Vec<(String, TensorData)> {
    let mut reader = Reader::default();
    module.visit(&mut reader);
    reader.found
}

/// Replaces every float tensor by `values(path, shape)`, numbers row by row; `None` keeps it.
pub fn replace<M: Module>(module: M, values: impl FnMut(&str, &[usize]) -> Option<Vec<f32>>) -> M {
    let mut writer = Writer {
        path: Vec::new(),
        values,
    };
    module.map(&mut writer)
}

#[derive(Default)]
struct Reader {
    path: Vec<String>,
    found: Vec<(String, TensorData)>,
}

impl ModuleVisitor for Reader {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let data = param.val().into_data();
        self.found.push((self.path.join("."), data));
    }
}

struct Writer<F> {
    path: Vec<String>,
    values: F,
}

impl<F: FnMut(&str, &[usize]) -> Option<Vec<f32>>> ModuleMapper for Writer<F> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let shape: Vec<usize> = param.lazy_shape().to_vec();
        match (self.values)(&self.path.join("."), &shape) {
            None => param,
            // The old numbers, which may not have been drawn yet, are not asked for.
            Some(values) => {
                let data = TensorData::new(values, shape);
                let (fresh, id) = (Tensor::from_data(data, &param.lazy_device()), param.id);
                param.transform_for_load(fresh, id)
            }
        }
    }
}
