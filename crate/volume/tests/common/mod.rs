//! One test body, run natively and in wasm, on `flex` and on a GPU (WebGPU under Node, Vulkan natively).

use burn::tensor::Device;

/// Declares `flex` and `gpu` tests that run an async body on either device, natively and in wasm.
#[macro_export]
macro_rules! on_each_device {
    ($(#[$doc:meta])* async fn $name:ident($device:ident: Device) $body:block) => {
        $(#[$doc])*
        mod $name {
            use super::*;

            async fn body($device: burn::tensor::Device) $body

            #[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
            #[cfg(target_family = "wasm")]
            async fn flex() {
                body(burn::tensor::Device::flex()).await;
            }

            #[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
            #[cfg(target_family = "wasm")]
            async fn gpu() {
                body($crate::common::gpu().await.expect("WebGPU in the test runner")).await;
            }

            #[cfg(not(target_family = "wasm"))]
            #[test]
            fn flex() {
                pollster::block_on(body(burn::tensor::Device::flex()));
            }

            #[cfg(not(target_family = "wasm"))]
            #[test]
            fn gpu() {
                match pollster::block_on($crate::common::gpu()) {
                    Some(device) => pollster::block_on(body(device)),
                    None => println!("skipped: no Vulkan, Metal or DirectX adapter on this machine"),
                }
            }
        }
    };
}

#[cfg(not(target_family = "wasm"))]
pub async fn gpu() -> Option<Device> {
    use std::sync::OnceLock;
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE
        .get_or_init(|| Device::wgpu_options().init().ok())
        .clone()
}

#[cfg(target_family = "wasm")]
pub async fn gpu() -> Option<Device> {
    use std::cell::RefCell;
    thread_local!(static DEVICE: RefCell<Option<Device>> = const { RefCell::new(None) });
    if let Some(device) = DEVICE.with_borrow(Clone::clone) {
        return Some(device);
    }
    let device = Device::wgpu_options().init_async().await.ok()?;
    DEVICE.set(Some(device.clone()));
    Some(device)
}
