//! What scripts under Node and in a page ask: `tools/bench-node.mjs` and `tools/bench-web.mjs`.

use burn::tensor::Device;
use net::{Ipdrecon, weights};
use wasm_bindgen::prelude::{JsError, wasm_bindgen};

use crate::report::{Asked, Report};
use crate::subject::Subject;

/// A network on a device.
#[wasm_bindgen]
pub struct Bench {
    network: Ipdrecon,
    device: Device,
}

unsafe extern "C" {
    fn __wasm_call_ctors();
}

/// Once a module, as in the engine (`worker/src/lib.rs` says why).
#[wasm_bindgen(start)]
fn begin() {
    console_error_panic_hook::set_once();
    // SAFETY: the module's first entry, and the only one that calls it.
    unsafe { __wasm_call_ctors() };
}

#[wasm_bindgen]
impl Bench {
    /// The network in the bytes of `weights`, on WebGPU where `gpu` is set, else on the processor.
    ///
    /// # Errors
    /// No WebGPU here, or no weights.
    pub async fn open(bytes: Vec<u8>, gpu: bool) -> Result<Self, JsError> {
        let device = match gpu {
            true => Device::wgpu_options().init_async().await?,
            false => Device::flex(),
        };
        let network = weights::load(&bytes, &device)?;
        Ok(Self { network, device })
    }

    /// The report as JSON `{ markdown, peak, rows }`. `sizes` holds width and height of pictures one after the other; those of
    /// pieces are the first.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn report(
        &self,
        sizes: &[u32],
        views: Vec<usize>,
        edge: i32,
        runs: usize,
    ) -> Result<String, JsError> {
        let sizes: Vec<(u32, u32)> = sizes.chunks_exact(2).map(|s| (s[0], s[1])).collect();
        let piece_size = *sizes
            .first()
            .ok_or_else(|| JsError::new("expected a size, found none"))?;
        let asked = Asked {
            sizes,
            views,
            piece_size,
            edge,
            runs,
        };
        let report = Report::measure(&self.network, &self.device, &asked).await?;
        let markdown = report.markdown();
        let data =
            serde_json::json!({ "markdown": markdown, "peak": report.peak, "rows": report.rows });
        Ok(data.to_string())
    }

    /// Milliseconds of backbone and pyramid, cold and warm.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn pyramid(&self, width: u32, height: u32, runs: usize) -> Result<Vec<f64>, JsError> {
        let times = self.subject(width, height, runs).pyramid().await?;
        Ok(vec![times.cold_ms, times.warm_ms])
    }

    /// The numbers of backbone and pyramid, coarse to fine.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn pyramid_numbers(&self, width: u32, height: u32) -> Result<Vec<f32>, JsError> {
        let levels = self.subject(width, height, 1).pyramid_numbers().await?;
        Ok(levels.concat())
    }

    fn subject(&self, width: u32, height: u32, runs: usize) -> Subject<'_> {
        Subject {
            network: &self.network,
            device: &self.device,
            size: (width, height),
            edge: crate::input::EDGE,
            runs,
        }
    }
}
