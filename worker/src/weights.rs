//! The network and its weights: fetched by the worker script when a run first needs them, or given by the visitor.

use crate::{
    engine::{Engine, RunState},
    files::WeightsBlob,
    messages::{Event, StageName},
    platform,
};
use js_sys::{Function, Promise, Reflect};
use net::{Ipdrecon, weights};
use recon::NetworkConfig;
use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};
use wasm_bindgen::{JsCast, JsValue, prelude::Closure};
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Blob, File};

/// How often a download is looked at, for a visitor who cancels.
const LOOK_MS: i32 = 40;

/// Why there is no network.
pub enum Fault {
    /// The visitor cancelled.
    Stopped,
    /// One sentence, and what to do.
    Failed { message: String, advice: String },
}

impl Fault {
    /// From a text that reads `message; advice`.
    fn of(text: &str) -> Self {
        let (message, advice) = text.split_once("; ").unwrap_or((text, ""));
        Self::Failed {
            message: message.to_owned(),
            advice: advice.to_owned(),
        }
    }
}

/// The engine's network, made once.
pub struct Weights {
    /// The worker script's: takes a function that is told bytes done and in all, promises the file.
    bring: Function,
    network: RefCell<Option<Rc<Ipdrecon>>>,
    /// Whether the device's kernels are being compiled.
    warming: Rc<Cell<bool>>,
}

impl Weights {
    /// None yet.
    pub fn new(bring: Function) -> Self {
        Self {
            bring,
            network: RefCell::default(),
            warming: Rc::default(),
        }
    }

    /// The network; its weights are fetched first, unless they are there, and its kernels compiled meanwhile.
    pub async fn network(
        &self,
        engine: &Rc<Engine>,
        config: &NetworkConfig,
    ) -> Result<Rc<Ipdrecon>, Fault> {
        if let Some(network) = self.network.borrow().clone() {
            return Ok(network);
        }
        self.warm_up(engine, *config);
        let blob = self.fetch(engine).await?;
        let network = self.take(engine, blob)?;
        if self.warming.get() {
            engine.enter(StageName::WarmingUp);
        }
        while self.warming.get() && engine.state() != RunState::Stopping {
            platform::sleep_ms(LOOK_MS).await;
        }
        Ok(network)
    }

    /// Has the kernels compiled beside whatever goes on. A device that fails at that fails the run, which says so.
    fn warm_up(&self, engine: &Rc<Engine>, config: NetworkConfig) {
        if !self.warming.replace(true) {
            let (warming, device) = (self.warming.clone(), engine.device.clone());
            spawn_local(async move {
                // Messages and the download come first.
                platform::sleep_ms(0).await;
                let _ = recon::warm_up_network(&config, &device).await;
                warming.set(false);
            });
        }
    }

    /// Takes a file that the visitor gave.
    pub fn use_file(&self, engine: &Rc<Engine>, file: File) {
        let (name, bytes) = (file.name(), file.size());
        match self.take(engine, file.into()) {
            Ok(_) => engine.emit(&Event::Weights { name, bytes }),
            Err(fault) => fault.tell(engine),
        }
    }

    fn take(&self, engine: &Engine, blob: Blob) -> Result<Rc<Ipdrecon>, Fault> {
        let network = weights::load(&WeightsBlob(blob), &engine.device);
        let network = Rc::new(network.map_err(|error| Fault::of(&error.to_string()))?);
        self.network.replace(Some(network.clone()));
        Ok(network)
    }

    async fn fetch(&self, engine: &Rc<Engine>) -> Result<Blob, Fault> {
        engine.enter(StageName::Downloading);
        let (told, began_ms) = (engine.clone(), platform::now_ms());
        let progress = Closure::<dyn FnMut(f64, f64)>::new(move |done: f64, total: f64| {
            told.emit(&Event::Progress {
                done: done as u32,
                total: total as u32,
                triangles: 0,
                elapsed_s: (platform::now_ms() - began_ms) / 1000.0,
                heap_bytes: platform::heap_bytes(),
            });
        });
        let none = JsValue::NULL;
        let promise = self.bring.call1(&none, progress.as_ref().unchecked_ref());
        let promise: Promise = promise.map_err(|error| failed(&error))?.unchecked_into();
        // The download goes on by itself when the visitor cancels: what it brings is kept for the next run.
        let answer = Rc::new(RefCell::new(None));
        let place = answer.clone();
        spawn_local(async move {
            let result = JsFuture::from(promise).await;
            drop(progress);
            place.replace(Some(result));
        });
        loop {
            if let Some(result) = answer.take() {
                let blob = result.map_err(|error| failed(&error))?;
                return Ok(blob.unchecked_into());
            }
            if engine.state() == RunState::Stopping {
                return Err(Fault::Stopped);
            }
            platform::sleep_ms(LOOK_MS).await;
        }
    }
}

impl Fault {
    /// Tells the page why work cannot go on; nothing if the visitor wanted it so.
    pub fn tell(self, engine: &Engine) {
        if let Self::Failed { message, advice } = self {
            engine.fail("weights", message, advice);
        }
    }
}

/// An error of the worker script, whose message reads `message; advice`.
fn failed(error: &JsValue) -> Fault {
    let message = Reflect::get(error, &"message".into()).ok();
    let message = message.and_then(|message| message.as_string());
    Fault::of(&message.unwrap_or_else(|| "the browser refused to fetch the weights".to_owned()))
}
