//! Tests that run on the processor and on a GPU, natively and in wasm.

use burn::tensor::{Device, Tensor};

/// Declares the tests `name::flex` and `name::gpu` of one async body. Without an adapter the second says that it is skipped.
#[macro_export]
macro_rules! on_each_device {
    ($(#[$doc:meta])* async fn $name:ident($device:ident: Device) $body:block) => {
        $(#[$doc])*
        mod $name {
            use super::*;

            async fn body($device: Device) $body

            #[cfg(not(target_family = "wasm"))]
            #[test]
            fn flex() {
                pollster::block_on(body(Device::flex()));
            }

            #[cfg(not(target_family = "wasm"))]
            #[test]
            fn gpu() {
                match $crate::common::devices::gpu() {
                    Some(device) => pollster::block_on(body(device)),
                    None => println!("skipped: no Vulkan, Metal or DirectX adapter on this machine"),
                }
            }

            #[cfg(target_family = "wasm")]
            #[wasm_bindgen_test::wasm_bindgen_test]
            async fn flex() {
                body(Device::flex()).await;
            }

            #[cfg(target_family = "wasm")]
            #[wasm_bindgen_test::wasm_bindgen_test]
            async fn gpu() {
                body($crate::common::devices::gpu().await).await;
            }
        }
    };
}

/// The machine's GPU.
#[cfg(not(target_family = "wasm"))]
pub fn gpu() -> Option<Device> {
    use std::sync::OnceLock;
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE
        .get_or_init(|| Device::wgpu_options().init().ok())
        .clone()
}

/// WebGPU under Node.
#[cfg(target_family = "wasm")]
pub async fn gpu() -> Device {
    use std::cell::RefCell;
    thread_local!(static DEVICE: RefCell<Option<Device>> = const { RefCell::new(None) });
    if let Some(device) = DEVICE.with_borrow(Clone::clone) {
        return device;
    }
    let device = Device::wgpu_options().init_async().await;
    let device = device.expect("WebGPU in the test runner");
    DEVICE.set(Some(device.clone()));
    device
}

/// The numbers of a tensor, row by row.
pub async fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    let data = tensor.into_data_async().await.unwrap();
    data.try_to_vec::<f32>().unwrap()
}
