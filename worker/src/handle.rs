//! The engine as the worker script holds it: each request is handed to what the tasks share or becomes a task of its own.

use crate::{
    convert,
    engine::{Engine, RunState},
    files::{DroppedFolder, DroppedZip},
    job::{self, Origin},
    messages::{InputEvent, Request},
    rates,
    weights::Weights,
};
use js_sys::{Array, Function};
use std::rc::Rc;
use tsify::Ts;
use wasm_bindgen::{JsCast, JsValue, prelude::wasm_bindgen};
use wasm_bindgen_futures::spawn_local;
use web_sys::{File, OffscreenCanvas};

/// The engine's handle for the worker script.
#[wasm_bindgen(js_name = Engine)]
pub struct Handle(Rc<Engine>);

#[wasm_bindgen(js_class = Engine)]
impl Handle {
    /// Finds a device and starts the engine on it. `emit` is called with every event, and with the bytes beside it; `bring` when
    /// the network's weights are needed, with a function that is told the bytes done and in all: it promises a `Blob`.
    ///
    /// # Errors
    /// When neither WebGPU nor the CPU can be used, or `request` is not `start`.
    pub async fn start(
        canvas: Option<OffscreenCanvas>,
        request: Ts<Request>,
        emit: Function,
        bring: Function,
    ) -> Result<Handle, JsValue> {
        let Request::Start {
            width_px,
            height_px,
            pixel_ratio,
            device,
            ..
        } = read(&request)?
        else {
            return Err(js_sys::Error::new("the first message must be `start`").into());
        };
        let engine = Rc::new(Engine::find(canvas, device, emit, Weights::new(bring)).await?);
        engine.input(InputEvent::Resize {
            width_px,
            height_px,
            pixel_ratio,
        });
        spawn_local(rates::measure(engine.clone()));
        Ok(Handle(engine))
    }

    /// Takes a request, and beside it the files and the contents of text files among them, each as one array: a handle for
    /// each of thousands of files would take seconds to make. The work goes on in tasks of its own.
    ///
    /// # Errors
    /// When `request` is none of the messages.
    pub fn handle(&self, request: Ts<Request>, files: Array, texts: Array) -> Result<(), JsValue> {
        let engine = self.0.clone();
        match read(&request)? {
            Request::Start { .. } => {}
            Request::OpenFolder { paths } => {
                let folder = DroppedFolder::new(&paths, files, texts);
                spawn_local(job::open(engine, Origin::Folder(folder)));
            }
            Request::OpenZip => {
                if let Ok(file) = files.get(0).dyn_into::<File>() {
                    spawn_local(job::open(engine, Origin::Zip(DroppedZip(file))));
                }
            }
            Request::OpenSample { seed } => {
                spawn_local(job::open(engine, Origin::Sample(seed)));
            }
            Request::UseWeights => {
                if let Ok(file) = files.get(0).dyn_into::<File>() {
                    engine.weights.use_file(&engine, file);
                }
            }
            Request::Keep { stage } => {
                if let Ok(file) = files.get(0).dyn_into::<File>() {
                    engine.given.put(stage, file.into());
                }
            }
            Request::Replan { options } => {
                job::plan(&engine, convert::options(options));
            }
            Request::Run { options } => spawn_local(job::run(engine, options)),
            Request::Pause => engine.change(RunState::Running, RunState::Pausing),
            Request::Resume => {
                engine.change(RunState::Pausing, RunState::Running);
                engine.change(RunState::Paused, RunState::Running);
            }
            Request::Cancel => engine.stop(),
            Request::Export {
                id,
                format,
                canonical,
            } => spawn_local(job::export(engine, id, format, canonical)),
            Request::Screenshot { id } => spawn_local(job::screenshot(engine, id)),
            Request::Input { input } => engine.input(input),
            Request::View { view } => engine.view(view),
            Request::Look { at } => engine.look(at),
        }
        Ok(())
    }
}

fn read(request: &Ts<Request>) -> Result<Request, JsValue> {
    let request = request.to_rust();
    request.map_err(|error| js_sys::Error::new(&error.to_string()).into())
}
