//! Where the command line computes.

use crate::failure::Failure;
use burn::tensor::Device;
use clap::ValueEnum;
use recon::Limits;

/// Main memory has no such bound as a GPU's binding; the volume's indices are whole numbers of 32 bits.
const CPU_BINDING_BYTES: usize = 2 << 30;

/// Where to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeviceChoice {
    /// The processor, on all cores.
    #[value(alias = "flex")]
    Cpu,
    /// The graphics card, through Vulkan, Metal or DirectX.
    #[value(alias = "wgpu")]
    Gpu,
}

impl DeviceChoice {
    /// Where that is, in words.
    pub fn name(self, device: &Device) -> String {
        match self {
            Self::Cpu => {
                let threads = std::thread::available_parallelism().map_or(1, usize::from);
                format!("on the processor, {threads} threads")
            }
            Self::Gpu => format!("on {device:?}"),
        }
    }

    /// burn's device, and what it allows.
    pub fn device(self) -> Result<(Device, Limits), Failure> {
        match self {
            Self::Cpu => Ok((
                Device::flex(),
                Limits {
                    binding_bytes: CPU_BINDING_BYTES,
                    network_is_bound: false,
                },
            )),
            Self::Gpu => {
                let found = Device::wgpu_options().init_with_setup();
                let (device, setup) = found.map_err(|error| Failure::Gpu(error.to_string()))?;
                let bytes = setup.device.limits().max_storage_buffer_binding_size;
                let limits = Limits {
                    binding_bytes: usize::try_from(bytes).unwrap_or(usize::MAX),
                    network_is_bound: true,
                };
                Ok((device, limits))
            }
        }
    }
}
