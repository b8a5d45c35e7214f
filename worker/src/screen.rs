//! Who shows what an engine makes: a view in the same worker, one in another worker, or nobody.
//!
//! On WebGPU compute and renderer share a worker, a device and its queue: a brick never leaves the GPU. The processor's work would keep the view's
//! thread for seconds at a time, so there the engine has a worker of its own and its bricks travel as bytes.

use crate::{
    convert,
    handoff::{self, Soup},
    messages::Drawing,
    viewer::Viewer,
};
use glam::Vec3;
use js_sys::{Float32Array, Function};
use mesh::soup::VERTEX_FLOATS;
use std::{
    cell::{Cell, RefCell},
    collections::HashMap,
    rc::Rc,
};
use tsify::Tsify;
use view::CameraPose;
use volume::{BrickMeshes, VolumeError};
use wasm_bindgen::JsValue;

/// Where an engine's bricks go.
pub enum Screen {
    /// The engine computes and shows nothing.
    Nobody,
    /// To the view on the same device.
    Here(Rc<Viewer>),
    /// To the view in another worker.
    Far(Far),
}

impl Screen {
    /// Tells whether a run is on.
    pub fn set_busy(&self, busy: bool) {
        if let Self::Here(viewer) = self {
            viewer.set_busy(busy);
        }
    }

    /// Takes all bricks away, before those of another size; before a new run the visitor goes home.
    pub fn clear(&self, brick_size_m: f32, home: bool) {
        match self {
            Self::Nobody => {}
            Self::Here(viewer) => viewer.clear(brick_size_m, home),
            Self::Far(far) => {
                far.shown.take();
                far.tell(&Drawing::Clear { brick_size_m, home }, None);
            }
        }
    }

    /// Shows the cameras of a scan of this name.
    pub fn set_cameras(&self, title: &str, poses: &[CameraPose]) {
        match self {
            Self::Nobody => {}
            Self::Here(viewer) => viewer.set_cameras(title, poses),
            Self::Far(far) => {
                let cameras = Drawing::Cameras {
                    title: title.to_owned(),
                    poses: poses.iter().map(convert::camera_message).collect(),
                };
                far.tell(&cameras, None);
            }
        }
    }

    /// Bricks and triangles on show.
    pub fn counts(&self) -> (u32, u32) {
        match self {
            Self::Nobody => (0, 0),
            Self::Here(viewer) => viewer.counts(),
            Self::Far(far) => far.counts(),
        }
    }

    /// Where the visitor stands; `None` where nobody watches.
    pub fn eye(&self) -> Option<Vec3> {
        match self {
            Self::Nobody => None,
            Self::Here(viewer) => Some(viewer.eye()),
            Self::Far(far) => far.eye.get(),
        }
    }

    /// Whether the visitor moves the view on this thread, and should get it now and then.
    pub fn is_touched(&self) -> bool {
        match self {
            Self::Nobody | Self::Far(_) => false,
            Self::Here(viewer) => viewer.is_touched(),
        }
    }

    /// Shows new versions of bricks.
    pub async fn show(&self, meshes: BrickMeshes) -> Result<(), VolumeError> {
        match self {
            Self::Nobody => {}
            Self::Here(viewer) => viewer.show(meshes)?,
            Self::Far(far) => far.show(handoff::read(meshes).await?),
        }
        Ok(())
    }
}

/// A view in another worker.
pub struct Far {
    /// The worker script's: takes a [`Drawing`] and the vertices beside it.
    draw: Function,
    /// Triangles of every brick on show.
    shown: RefCell<HashMap<[i32; 3], u32>>,
    eye: Cell<Option<Vec3>>,
}

impl Far {
    /// `draw` takes each [`Drawing`], and the vertices beside it.
    pub fn new(draw: Function) -> Self {
        Self {
            draw,
            shown: RefCell::default(),
            eye: Cell::default(),
        }
    }

    /// Remembers where the visitor stands.
    pub fn stand(&self, eye_m: Vec3) {
        self.eye.set(Some(eye_m));
    }

    fn show(&self, soup: Soup) {
        let mut shown = self.shown.borrow_mut();
        for (brick, vertices) in soup.bricks() {
            match (vertices.len() / (3 * VERTEX_FLOATS)) as u32 {
                0 => shown.remove(&brick),
                triangles => shown.insert(brick, triangles),
            };
        }
        let bricks = convert::brick_messages(&soup);
        let numbers = Float32Array::from(soup.numbers.as_slice());
        self.tell(&Drawing::Bricks { bricks }, Some(numbers));
    }

    fn counts(&self) -> (u32, u32) {
        let shown = self.shown.borrow();
        (shown.len() as u32, shown.values().sum())
    }

    fn tell(&self, drawing: &Drawing, vertices: Option<Float32Array>) {
        if let Ok(drawing) = drawing.into_js() {
            let vertices = vertices.map_or(JsValue::UNDEFINED, JsValue::from);
            let _ = self.draw.call2(&JsValue::NULL, &drawing, &vertices);
        }
    }
}
