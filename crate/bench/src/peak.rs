//! What a device can do at best, measured. Operations: on the processor a product of matrices, in burn's own loops; on a GPU a kernel whose
//! threads only multiply and add in registers. Bytes: a large copy.

use burn::backend::{DispatchDevice, TensorMetadata};
use burn::tensor::{Device, Tensor};
use burn_cubecl::{CubeBackend, ops::numeric::empty_device_contiguous_dtype, tensor::CubeTensor};
use cubecl::prelude::*;
use rayon::prelude::*;
use serde::Serialize;

use crate::input::numbers;
use crate::subject::Unread;
use crate::time::{now_ms, wait};
use crate::work::Work;

/// Rows and columns of the matrices.
const SIDE: usize = 1024;
/// Numbers that are copied: 64 MiB, more than caches hold.
const COPIED: usize = 1 << 24;
/// Numbers that are copied at a time by one task.
const COPIED_AT_ONCE: usize = 1 << 18;
/// Threads of the kernel, and how many chains of products each has under way.
const THREADS: usize = 1 << 16;
const CHAINS: usize = 16;
const GROUP: u32 = 64;
/// Runs are repeated until they take so long, and then measured so often.
const LONG_MS: f64 = 100.0;
const RUNS: usize = 3;

/// A second's worth at best.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Peak {
    /// Multiplications and additions a second.
    pub flops: f64,
    /// Bytes read and written a second.
    pub bytes: f64,
}

impl Peak {
    /// Measures `device`.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn measure(device: &Device) -> Result<Self, Unread> {
        if matches!(device.as_dispatch(), DispatchDevice::Flex(_)) {
            on_processor(device).await
        } else {
            on_gpu(device).await
        }
    }

    /// Shares of the peak that `work` in `ms` milliseconds reaches, operations and bytes.
    pub fn shares(&self, work: Work, ms: f64) -> [f64; 2] {
        let [flops, bytes] = [work.flops / self.flops, work.bytes / self.bytes];
        [flops, bytes].map(|seconds| 1e3 * seconds / ms)
    }
}

async fn on_processor(device: &Device) -> Result<Peak, Unread> {
    let [a, b] = [(); 2].map(|()| numbers([SIDE, SIDE], device));
    let product_ms = once_ms(async |times| {
        for _ in 0..times {
            wait(&a.clone().matmul(b.clone())).await?;
        }
        Ok(())
    })
    .await?;
    let from = vec![1.0_f32; COPIED];
    let mut to = vec![0.0_f32; COPIED];
    let copy_ms = once_ms(async |times| {
        for _ in 0..times {
            let parts = to.par_chunks_mut(COPIED_AT_ONCE);
            let parts = parts.zip(from.par_chunks(COPIED_AT_ONCE));
            parts.for_each(|(to, from)| to.copy_from_slice(from));
            std::hint::black_box(&mut to);
        }
        Ok(())
    })
    .await?;
    Ok(peak(2.0 * (SIDE as f64).powi(3) / product_ms, copy_ms))
}

async fn on_gpu(device: &Device) -> Result<Peak, Unread> {
    let start = cube(numbers([THREADS], device));
    let step_ms = once_ms(async |times| {
        let out = multiplied(start.clone(), times);
        wait(&Tensor::<1>::from_primitive::<CubeBackend>(out)).await?;
        Ok(())
    })
    .await?;
    let from = numbers([COPIED], device);
    let copy_ms = once_ms(async |times| {
        let mut to = from.clone();
        for _ in 0..times {
            to = from.clone() + 1.0;
        }
        wait(&to).await?;
        Ok(())
    })
    .await?;
    Ok(peak(2.0 * (THREADS * CHAINS) as f64 / step_ms, copy_ms))
}

/// From operations a millisecond and the milliseconds of a copy.
fn peak(flops_a_ms: f64, copy_ms: f64) -> Peak {
    Peak {
        flops: 1e3 * flops_a_ms,
        bytes: 1e3 * 2.0 * (size_of::<f32>() * COPIED) as f64 / copy_ms,
    }
}

/// Least milliseconds of one of the repetitions that `work` is asked for: of so many that starting and reading back do not count.
async fn once_ms(mut work: impl AsyncFnMut(u32) -> Result<(), Unread>) -> Result<f64, Unread> {
    let mut times = 1;
    work(times).await?;
    loop {
        let start = now_ms();
        work(times).await?;
        if now_ms() - start >= LONG_MS || times >= 1 << 24 {
            break;
        }
        times *= 2;
    }
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let start = now_ms();
        work(times).await?;
        least = least.min((now_ms() - start) / f64::from(times));
    }
    Ok(least)
}

/// The device's own handle of a tensor that lies on a GPU.
fn cube(tensor: Tensor<1>) -> CubeTensor {
    match tensor.try_into_primitive::<CubeBackend>() {
        Ok(cube) => cube,
        Err(error) => panic!("a tensor of a device that runs kernels: {error:?}"),
    }
}

/// Each number's chains after `times` steps, summed.
fn multiplied(start: CubeTensor, times: u32) -> CubeTensor {
    let (client, device) = (start.client.clone(), start.device.clone());
    let out = empty_device_contiguous_dtype(client, device, start.shape(), start.dtype());
    let groups = CubeCount::Static(THREADS as u32 / GROUP, 1, 1);
    // SAFETY: there is a thread for each number, and no other.
    unsafe {
        multiply_kernel::launch_unchecked(
            &out.client,
            groups,
            CubeDim::new_1d(GROUP),
            start.into_buffer_arg(),
            out.clone().into_buffer_arg(),
            times,
            CHAINS,
        );
    }
    out
}

#[cube(launch_unchecked)]
fn multiply_kernel(start: &[f32], out: &mut [f32], times: u32, #[comptime] chains: usize) {
    let factor = start[ABSOLUTE_POS];
    let mut sums = Array::<f32>::new(chains);
    #[unroll]
    for chain in 0..chains {
        sums[chain] = factor * chain as f32;
    }
    for _ in 0..times {
        #[unroll]
        for chain in 0..chains {
            sums[chain] = sums[chain] * factor + factor;
        }
    }
    let mut sum = 0.0f32;
    #[unroll]
    for chain in 0..chains {
        sum += sums[chain];
    }
    out[ABSOLUTE_POS] = sum;
}
