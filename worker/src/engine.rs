//! What the engine's tasks share: the device, the stage, the scan, its plan and volume, and where a run stands.

use crate::{
    convert,
    device::Found,
    given::Given,
    handoff,
    messages::{DeviceChoice, Event, InputEvent, LookAt, ViewOptions},
    platform,
    rates::Measured,
    stage::{Bricks, Stage},
    weights::Weights,
};
use burn::tensor::Device;
use glam::{Vec2, Vec3};
use js_sys::{Function, Uint8Array};
use recon::{Limits, Plan};
use scan::Scan;
use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};
use tsify::Tsify;
use view::CameraPose;
use volume::{BrickMeshes, Volume, VolumeError};
use wasm_bindgen::JsValue;
use web_sys::OffscreenCanvas;

/// While a run is on and nobody touches the view, this long between two pictures leaves the device to the run.
const RUN_FRAME_MS: f64 = 200.0;

/// Where a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunState {
    Idle,
    Running,
    Pausing,
    Paused,
    Stopping,
}

/// Everything that the tasks share.
pub struct Engine {
    emit: Function,
    pub device: Device,
    /// Where the network works: a processor that plays GPU is slower at that than the processor itself.
    pub network_device: Device,
    pub limits: Limits,
    pub weights: Weights,
    /// How fast it is; `None` until that is measured.
    pub rates: Cell<Measured>,
    stage: RefCell<Option<Stage>>,
    scan: RefCell<Option<Rc<Scan>>>,
    plan: RefCell<Option<Rc<Plan>>>,
    volume: RefCell<Option<Rc<Volume>>>,
    /// What stages of an earlier run made, for the next.
    pub given: Given,
    state: Cell<RunState>,
    frame_asked: Cell<bool>,
    last_frame_ms: Cell<f64>,
    /// Since when there is motion that no frame has shown; `None` at rest.
    moving_since_ms: Cell<Option<f64>>,
    /// The visitor moved the view since it last came to rest.
    touched: Cell<bool>,
}

impl Engine {
    /// Finds a device and sets the engine up on it.
    pub async fn find(
        canvas: Option<OffscreenCanvas>,
        choice: DeviceChoice,
        emit: Function,
        weights: Weights,
    ) -> Result<Self, String> {
        let Found {
            device,
            network_device,
            limits,
            gpu,
            ready,
        } = Found::of(choice, &emit).await;
        let stage = canvas.map(|canvas| match gpu {
            Some(gpu) => Stage::on_gpu(canvas, gpu),
            None => Stage::on_cpu(canvas),
        });
        let engine = Self {
            emit,
            device,
            network_device,
            limits,
            weights,
            rates: Cell::default(),
            stage: RefCell::new(stage.transpose()?),
            scan: RefCell::default(),
            plan: RefCell::default(),
            volume: RefCell::default(),
            given: Given::default(),
            state: Cell::new(RunState::Idle),
            frame_asked: Cell::new(false),
            last_frame_ms: Cell::new(0.0),
            moving_since_ms: Cell::new(None),
            touched: Cell::new(false),
        };
        engine.emit(&ready);
        Ok(engine)
    }

    /// Whether the network works on another device than the volume.
    pub fn network_is_apart(&self) -> bool {
        self.network_device != self.device
    }

    /// Tells the page.
    pub fn emit(&self, event: &Event) {
        if let Ok(event) = event.into_js() {
            let _ = self.emit.call1(&JsValue::NULL, &event);
        }
    }

    /// Tells the page, with bytes beside it.
    pub fn emit_with(&self, event: &Event, bytes: &Uint8Array) {
        if let Ok(event) = event.into_js() {
            let _ = self.emit.call2(&JsValue::NULL, &event, bytes);
        }
    }

    /// Tells that work cannot go on.
    pub fn fail(&self, code: &str, message: String, advice: String) {
        self.emit(&Event::Failed {
            code: code.to_owned(),
            message,
            advice,
        });
    }

    pub fn state(&self) -> RunState {
        self.state.get()
    }

    pub fn set_state(&self, state: RunState) {
        self.state.set(state);
    }

    /// From one state to another; nothing where the run is in neither.
    pub fn change(&self, from: RunState, to: RunState) {
        if self.state() == from {
            self.set_state(to);
        }
    }

    /// Asks a run that is on to end.
    pub fn stop(&self) {
        if self.state() != RunState::Idle {
            self.set_state(RunState::Stopping);
        }
    }

    /// Ends a run that is on, so that another can begin.
    pub async fn stop_and_wait(&self) {
        while self.state() != RunState::Idle {
            self.stop();
            platform::sleep_ms(10).await;
        }
    }

    /// Clears the stage for a run.
    pub fn begin(self: &Rc<Self>, brick_size_m: f32) {
        self.set_state(RunState::Running);
        self.volume.take();
        self.on_stage(|stage| {
            stage.clear(brick_size_m);
            stage.controls.home();
        });
    }

    /// Clears the stage for bricks of another size; the visitor stays where they are.
    pub fn replace_bricks(self: &Rc<Self>, brick_size_m: f32) {
        self.on_stage(|stage| stage.clear(brick_size_m));
    }

    pub fn scan(&self) -> Option<Rc<Scan>> {
        self.scan.borrow().clone()
    }

    pub fn set_scan(&self, scan: Scan) {
        self.volume.take();
        self.plan.take();
        self.given.clear();
        self.scan.replace(Some(Rc::new(scan)));
    }

    pub fn plan(&self) -> Option<Rc<Plan>> {
        self.plan.borrow().clone()
    }

    pub fn set_plan(&self, plan: Plan) {
        self.plan.replace(Some(Rc::new(plan)));
    }

    pub fn volume(&self) -> Option<Rc<Volume>> {
        self.volume.borrow().clone()
    }

    pub fn set_volume(&self, volume: Volume) {
        self.volume.replace(Some(Rc::new(volume)));
    }

    pub fn set_cameras(self: &Rc<Self>, poses: &[CameraPose]) {
        self.on_stage(|stage| stage.frusta.set(poses));
    }

    /// Bricks and triangles on show.
    pub fn counts(&self) -> (u32, u32) {
        let stage = self.stage.borrow();
        stage.as_ref().map_or((0, 0), Stage::counts)
    }

    /// Where the visitor stands; `None` where nobody watches.
    pub fn eye(&self) -> Option<Vec3> {
        let stage = self.stage.borrow();
        stage.as_ref().map(|stage| stage.controls.camera().eye_m())
    }

    /// Shows new versions of bricks.
    pub async fn show(self: &Rc<Self>, meshes: BrickMeshes) -> Result<(), VolumeError> {
        let reads = self.stage.borrow().as_ref().map(Stage::reads_bricks);
        let bricks = match reads {
            None => return Ok(()),
            Some(false) => Bricks::OnDevice(meshes),
            // The stage is not held while the device is waited for: messages that come meanwhile find it.
            Some(true) => Bricks::Read(handoff::read(meshes).await?),
        };
        if let Some(stage) = self.stage.borrow_mut().as_mut() {
            stage.show(bricks)?;
        }
        self.ask_frame();
        Ok(())
    }

    pub fn painted_canvas(&self) -> Option<OffscreenCanvas> {
        self.stage.borrow_mut().as_mut().map(Stage::painted_canvas)
    }

    /// Changes the stage and has it drawn.
    fn on_stage(self: &Rc<Self>, change: impl FnOnce(&mut Stage)) {
        if let Some(stage) = self.stage.borrow_mut().as_mut() {
            change(stage);
        }
        self.ask_frame();
    }

    /// Takes the visitor's input.
    pub fn input(self: &Rc<Self>, event: InputEvent) {
        self.touched.set(true);
        self.on_stage(|stage| match event {
            InputEvent::DoubleClick { x, y } => stage.focus_at(Vec2::new(x, y)),
            event => {
                if let Some(input) = convert::input(event) {
                    stage.input(input);
                }
            }
        });
    }

    /// Changes how the view is drawn.
    pub fn view(self: &Rc<Self>, view: ViewOptions) {
        self.on_stage(|stage| {
            stage.look = convert::look(view, stage.look.floor_height_m);
            stage.controls.set_reduced_motion(view.reduced_motion);
        });
    }

    /// Puts the camera somewhere.
    pub fn look(self: &Rc<Self>, at: LookAt) {
        self.touched.set(true);
        self.on_stage(|stage| match at {
            LookAt::Home => stage.controls.home(),
            LookAt::Top => stage.controls.top(),
            LookAt::Keyframe { index } => {
                let index = index as usize;
                if let Some(pose) = stage.frusta.poses().get(index).copied() {
                    stage.frusta.highlight(Some(index));
                    let (from, lens) = (pose.world_from_camera, pose.pinhole);
                    stage.controls.look_through(from, lens);
                }
            }
        });
    }

    /// Whether the visitor moves the view, or it has not come to rest since.
    pub fn is_touched(&self) -> bool {
        self.touched.get()
    }

    fn ask_frame(self: &Rc<Self>) {
        if self.moving_since_ms.get().is_none() {
            self.moving_since_ms.set(Some(platform::now_ms()));
        }
        if !self.frame_asked.replace(true) {
            let engine = self.clone();
            platform::on_next_frame(move || engine.frame());
        }
    }

    fn frame(self: &Rc<Self>) {
        self.frame_asked.set(false);
        let now_ms = platform::now_ms();
        let since_ms = now_ms - self.last_frame_ms.get();
        let busy = !matches!(self.state(), RunState::Idle | RunState::Paused);
        if busy && !self.touched.get() && since_ms < RUN_FRAME_MS {
            return self.ask_frame();
        }
        let mut stage = self.stage.borrow_mut();
        let Some(stage) = stage.as_mut() else {
            return;
        };
        self.last_frame_ms.set(now_ms);
        // The run may have kept this thread for seconds: the motion has gone on meanwhile, so that few frames are enough.
        let since_ms = self
            .moving_since_ms
            .take()
            .map_or(0.0, |at_ms| now_ms - at_ms);
        if stage.frame((since_ms / 1000.0) as f32) {
            self.moving_since_ms.set(Some(now_ms));
            self.ask_frame();
        } else if self.touched.replace(false) {
            self.emit(&Event::CameraChanged {
                description: stage.description(),
            });
        }
    }
}
