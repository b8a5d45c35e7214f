//! Where the command line computes.

use crate::failure::Failure;
use burn::tensor::Device;
use clap::ValueEnum;

/// Where to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeviceChoice {
    /// The processor, on all cores.
    Cpu,
    /// The graphics card, through Vulkan, Metal or DirectX.
    Gpu,
}

impl DeviceChoice {
    /// burn's device.
    pub fn device(self) -> Result<Device, Failure> {
        match self {
            Self::Cpu => Ok(Device::flex()),
            Self::Gpu => Device::wgpu_options()
                .init()
                .map_err(|error| Failure::Gpu(error.to_string())),
        }
    }
}
