//! The engine as the worker script holds it: each request is handed to the view, to what the tasks share, or becomes a task of its own.

use crate::{
    convert,
    device::Found,
    engine::{Engine, RunState},
    files::{DroppedFolder, DroppedZip},
    job::{self, Origin},
    messages::{Drawing, InputEvent, Request},
    page::Page,
    picture, rates,
    screen::{Far, Screen},
    viewer::Viewer,
    weights::Weights,
};
use burn::tensor::Device;
use glam::Vec3;
use js_sys::{Array, Float32Array, Function};
use std::rc::Rc;
use tsify::Ts;
use wasm_bindgen::{JsCast, JsValue, prelude::wasm_bindgen};
use wasm_bindgen_futures::spawn_local;
use web_sys::{File, OffscreenCanvas};

/// The engine's handle for the worker script.
#[wasm_bindgen(js_name = Engine)]
pub struct Handle {
    page: Page,
    viewer: Option<Rc<Viewer>>,
    /// `None` where another worker computes.
    engine: Option<Rc<Engine>>,
}

#[wasm_bindgen(js_class = Engine)]
impl Handle {
    /// Finds a device and starts the engine on it. `emit` is called with every event, and with the bytes beside it; `bring` when
    /// the network's weights are needed, with a function that is told the bytes done and in all: it promises a `Blob`. `draw`, without a
    /// canvas, is called with every `Drawing` for the view in another worker, and with the vertices beside it.
    ///
    /// # Errors
    /// When neither WebGPU nor the CPU can be used, or `request` is not `start`.
    pub async fn start(
        canvas: Option<OffscreenCanvas>,
        request: Ts<Request>,
        emit: Function,
        bring: Function,
        draw: Option<Function>,
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
        let page = Page::new(emit);
        let found = Found::of(device, &page).await;
        let viewer = canvas.map(|canvas| Viewer::new(canvas, found.gpu, page.clone()));
        let viewer = viewer.transpose()?.map(Rc::new);
        if let Some(viewer) = &viewer {
            viewer.input(InputEvent::Resize {
                width_px,
                height_px,
                pixel_ratio,
            });
        }
        let apart = viewer.is_some() && found.device == Device::flex();
        let engine = (!apart).then(|| {
            let screen = match (&viewer, draw) {
                (Some(viewer), _) => Screen::Here(viewer.clone()),
                (None, Some(draw)) => Screen::Far(Far::new(draw)),
                (None, None) => Screen::Nobody,
            };
            let (page, weights) = (page.clone(), Weights::new(bring));
            Rc::new(Engine::new(
                found.device,
                found.limits,
                screen,
                page,
                weights,
            ))
        });
        page.tell(&found.ready);
        if let Some(engine) = &engine {
            spawn_local(rates::measure(engine.clone()));
        }
        Ok(Handle {
            page,
            viewer,
            engine,
        })
    }

    /// Whether it computes. Where the processor does, the worker that has the canvas only draws, and an engine in another worker, which
    /// is given all requests but those about the view, computes.
    #[wasm_bindgen(getter)]
    pub fn computes(&self) -> bool {
        self.engine.is_some()
    }

    /// Takes a request, and beside it the files and the contents of text files among them, each as one array: a handle for
    /// each of thousands of files would take seconds to make. The work goes on in tasks of its own.
    ///
    /// # Errors
    /// When `request` is none of the messages.
    pub fn handle(&self, request: Ts<Request>, files: Array, texts: Array) -> Result<(), JsValue> {
        let request = read(&request)?;
        if let Some(request) = self.show(request)
            && let Some(engine) = &self.engine
        {
            work(engine.clone(), request, files, texts);
        }
        Ok(())
    }

    /// Draws what an engine in another worker made. `vertices` are those beside the drawing.
    ///
    /// # Errors
    /// When `drawing` is none of the messages, or the device fails.
    pub fn draw(
        &self,
        drawing: Ts<Drawing>,
        vertices: Option<Float32Array>,
    ) -> Result<(), JsValue> {
        let wrong = |error: String| JsValue::from(js_sys::Error::new(&error));
        let drawing = drawing
            .to_rust()
            .map_err(|error| wrong(error.to_string()))?;
        let numbers = vertices.map(|vertices| vertices.to_vec());
        if let Some(viewer) = &self.viewer {
            let drawn = viewer.draw(drawing, numbers.unwrap_or_default());
            drawn.map_err(|error| wrong(error.to_string()))?;
        }
        Ok(())
    }

    /// Where the visitor stands, metres: what an engine in another worker is told, to work near it first.
    #[wasm_bindgen(getter)]
    pub fn eye(&self) -> Option<Vec<f32>> {
        let eye = self.viewer.as_ref()?.eye();
        Some(eye.to_array().to_vec())
    }

    /// Tells an engine without a view where the visitor stands.
    pub fn stand(&self, x: f32, y: f32, z: f32) {
        if let Some(engine) = &self.engine
            && let Screen::Far(far) = &engine.screen
        {
            far.stand(Vec3::new(x, y, z));
        }
    }

    /// Takes a request about the view; gives back any other.
    fn show(&self, request: Request) -> Option<Request> {
        let viewer = self.viewer.as_ref();
        match (request, viewer) {
            (Request::Input { input }, Some(viewer)) => viewer.input(input),
            (Request::View { view }, Some(viewer)) => viewer.view(view),
            (Request::Look { at }, Some(viewer)) => viewer.look(at),
            (Request::Screenshot { id }, Some(viewer)) => {
                spawn_local(picture::screenshot(viewer.clone(), self.page.clone(), id));
            }
            (Request::Screenshot { .. }, None) => {
                let advice = "Start with a canvas to have pictures.".to_owned();
                self.page
                    .fail("export", "There is no view".to_owned(), advice);
            }
            (other, _) => return Some(other),
        }
        None
    }
}

/// Does what concerns the scan, its plan and its run.
fn work(engine: Rc<Engine>, request: Request, files: Array, texts: Array) {
    match request {
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
        // The view's, which may not be there, and the first message.
        Request::Start { .. }
        | Request::Input { .. }
        | Request::View { .. }
        | Request::Look { .. }
        | Request::Screenshot { .. } => {}
    }
}

fn read(request: &Ts<Request>) -> Result<Request, JsValue> {
    let request = request.to_rust();
    request.map_err(|error| js_sys::Error::new(&error.to_string()).into())
}
