//! Where the engine works: on the adapter that the browser offers, or on the processor.

use crate::{
    messages::{DeviceChoice, Event},
    page::Page,
    stage::Gpu,
};
use burn::tensor::{Device, wgpu::WgpuSetup};
use recon::Limits;

/// The largest binding that is used even where more is allowed.
const BINDING_BYTES: u64 = 1 << 30;
/// The device takes this many of burn's tasks at a time: small submits keep the page's frames coming.
const TASKS_A_SUBMIT: usize = 16;
/// Names of adapters that are the processor in disguise.
const SOFTWARE: [&str; 3] = ["swiftshader", "llvmpipe", "lavapipe"];

/// What was found.
pub struct Found {
    /// To compute on: never an adapter that is the processor in disguise, unless that was asked for. The processor itself is several times as fast.
    pub device: Device,
    pub limits: Limits,
    /// To draw with; without it the processor draws.
    pub gpu: Option<Gpu>,
    /// What the page is told.
    pub ready: Event,
}

impl Found {
    /// The device of this choice, or the processor. The page is told if the device is lost later.
    pub async fn of(choice: DeviceChoice, page: &Page) -> Self {
        let asked = "The processor does the work, as was asked for";
        if choice == DeviceChoice::Cpu {
            return Self::processor("", asked);
        }
        let options = Device::wgpu_options().tasks_max(TASKS_A_SUBMIT);
        match options.init_with_setup_async().await {
            Ok((device, setup)) => {
                tell_loss(&setup.device, page.clone());
                Self::adapter(device, setup, choice)
            }
            // The error's words are for the report; the visitor is told what it means.
            Err(error) => Self::processor(
                &format!("; {error}"),
                "This browser offers no WebGPU: the processor does the work, which takes longer",
            ),
        }
    }

    fn processor(why: &str, note: &str) -> Self {
        Self {
            device: Device::flex(),
            limits: Limits::default(),
            gpu: None,
            ready: on_processor(why, note),
        }
    }

    fn adapter(device: Device, setup: WgpuSetup, choice: DeviceChoice) -> Self {
        let info = setup.adapter.get_info();
        let words = format!("{} {}", info.name, info.driver);
        // A browser may keep the name to itself.
        let words = match words.trim() {
            "" => "an adapter without a name",
            words => words,
        };
        let lower = words.to_lowercase();
        let is_software = SOFTWARE.iter().any(|name| lower.contains(name))
            || info.device_type == wgpu::DeviceType::Cpu;
        let binding_bytes = setup.device.limits().max_storage_buffer_binding_size;
        let gpu = Some(Gpu {
            instance: setup.instance,
            adapter: setup.adapter,
            device: setup.device,
            queue: setup.queue,
            is_software,
        });
        if is_software && choice == DeviceChoice::Auto {
            return Self {
                gpu,
                ready: on_processor(
                    &format!("; drawn by {words}"),
                    "This graphics adapter is software: it draws, and the processor does the work, which takes longer",
                ),
                ..Self::processor("", "")
            };
        }
        Self {
            device,
            limits: Limits {
                binding_bytes: binding_bytes.min(BINDING_BYTES) as usize,
                network_is_bound: true,
            },
            gpu,
            ready: Event::Ready {
                device: "webgpu".to_owned(),
                adapter: words.to_owned(),
                note: None,
            },
        }
    }
}

fn on_processor(why: &str, note: &str) -> Event {
    Event::Ready {
        device: "cpu".to_owned(),
        adapter: format!("burn flex, one thread{why}"),
        note: Some(note.to_owned()),
    }
}

fn tell_loss(device: &wgpu::Device, page: Page) {
    device.set_device_lost_callback(move |reason, message| {
        page.fail(
            "device",
            format!("The graphics device was lost ({reason:?}: {message})"),
            "Start again, with larger voxels if it happens again.".to_owned(),
        );
    });
}
