//! The view: what is on show, the visitor's hands on it, and when it is drawn.

use crate::{
    convert,
    handoff::Soup,
    messages::{Drawing, Event, InputEvent, LookAt, ViewOptions},
    page::Page,
    platform,
    stage::{Gpu, Stage},
};
use glam::{Vec2, Vec3};
use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};
use view::CameraPose;
use volume::{BrickMeshes, VolumeError};
use web_sys::OffscreenCanvas;

/// While a run is on and nobody touches the view, this long between two pictures leaves the device to the run.
const RUN_FRAME_MS: f64 = 200.0;

/// The canvas in the visitor's hands.
pub struct Viewer {
    page: Page,
    stage: RefCell<Stage>,
    /// Name of the scan on show.
    title: RefCell<String>,
    /// Whether a run has this thread and its device.
    busy: Cell<bool>,
    frame_asked: Cell<bool>,
    last_frame_ms: Cell<f64>,
    /// Since when there is motion that no frame has shown; `None` at rest.
    moving_since_ms: Cell<Option<f64>>,
    /// The visitor moved the view since it last came to rest.
    touched: Cell<bool>,
}

impl Viewer {
    /// Of a canvas that this adapter draws on, or the processor.
    pub fn new(canvas: OffscreenCanvas, gpu: Option<Gpu>, page: Page) -> Result<Self, String> {
        let stage = match gpu {
            Some(gpu) => Stage::on_gpu(canvas, gpu)?,
            None => Stage::on_cpu(canvas)?,
        };
        Ok(Self {
            page,
            stage: RefCell::new(stage),
            title: RefCell::new("ipdrecon".to_owned()),
            busy: Cell::new(false),
            frame_asked: Cell::new(false),
            last_frame_ms: Cell::new(0.0),
            moving_since_ms: Cell::new(None),
            touched: Cell::new(false),
        })
    }

    /// Tells whether a run has this thread.
    pub fn set_busy(&self, busy: bool) {
        self.busy.set(busy);
    }

    /// Clears the stage for bricks of another size; the visitor stays where they are, or goes home before a new run.
    pub fn clear(self: &Rc<Self>, brick_size_m: f32, home: bool) {
        self.on_stage(|stage| {
            stage.clear(brick_size_m);
            if home {
                stage.controls.home();
            }
        });
    }

    /// Shows the cameras of a scan of this name.
    pub fn set_cameras(self: &Rc<Self>, title: &str, poses: &[CameraPose]) {
        title.clone_into(&mut self.title.borrow_mut());
        self.on_stage(|stage| stage.frusta.set(poses));
    }

    /// Shows new versions of bricks that are on the viewer's own device.
    pub fn show(self: &Rc<Self>, meshes: BrickMeshes) -> Result<(), VolumeError> {
        self.stage.borrow_mut().show(meshes)?;
        self.ask_frame();
        Ok(())
    }

    /// Does what an engine in another worker asks for. `numbers` are the vertices beside [`Drawing::Bricks`].
    pub fn draw(self: &Rc<Self>, drawing: Drawing, numbers: Vec<f32>) -> Result<(), VolumeError> {
        match drawing {
            Drawing::Clear { brick_size_m, home } => self.clear(brick_size_m, home),
            Drawing::Cameras { title, poses } => {
                let poses: Vec<_> = poses.iter().map(convert::camera_pose).collect();
                self.set_cameras(&title, &poses);
            }
            Drawing::Bricks { bricks } => {
                let soup = Soup::received(&bricks, numbers);
                self.stage.borrow_mut().show_soup(&soup)?;
                self.ask_frame();
            }
        }
        Ok(())
    }

    /// Bricks and triangles on show.
    pub fn counts(&self) -> (u32, u32) {
        self.stage.borrow().counts()
    }

    /// Where the visitor stands.
    pub fn eye(&self) -> Vec3 {
        self.stage.borrow().controls.camera().eye_m()
    }

    /// Name of the scan on show.
    pub fn title(&self) -> String {
        self.title.borrow().clone()
    }

    /// The canvas, freshly painted.
    pub fn painted_canvas(&self) -> OffscreenCanvas {
        self.stage.borrow_mut().painted_canvas()
    }

    /// Changes the stage and has it drawn.
    fn on_stage(self: &Rc<Self>, change: impl FnOnce(&mut Stage)) {
        change(&mut self.stage.borrow_mut());
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
            let viewer = self.clone();
            platform::on_next_frame(move || viewer.frame());
        }
    }

    fn frame(self: &Rc<Self>) {
        self.frame_asked.set(false);
        let now_ms = platform::now_ms();
        let since_ms = now_ms - self.last_frame_ms.get();
        if self.busy.get() && !self.touched.get() && since_ms < RUN_FRAME_MS {
            return self.ask_frame();
        }
        self.last_frame_ms.set(now_ms);
        // The run may have kept this thread for seconds: the motion has gone on meanwhile, so that few frames are enough.
        let since_ms = self
            .moving_since_ms
            .take()
            .map_or(0.0, |at_ms| now_ms - at_ms);
        let mut stage = self.stage.borrow_mut();
        if stage.frame((since_ms / 1000.0) as f32) {
            self.moving_since_ms.set(Some(now_ms));
            self.ask_frame();
        } else if self.touched.replace(false) {
            self.page.tell(&Event::CameraChanged {
                description: stage.description(),
            });
        }
    }
}
