//! What the page is told: events, and bytes beside them.

use crate::messages::Event;
use js_sys::{Function, Uint8Array};
use tsify::Tsify;
use wasm_bindgen::JsValue;

/// The worker script's function that takes events.
#[derive(Clone)]
pub struct Page(Function);

impl Page {
    /// `emit` is called with every event, and with the bytes beside it.
    pub fn new(emit: Function) -> Self {
        Self(emit)
    }

    /// Tells an event.
    pub fn tell(&self, event: &Event) {
        if let Ok(event) = event.into_js() {
            let _ = self.0.call1(&JsValue::NULL, &event);
        }
    }

    /// Tells an event with bytes beside it.
    pub fn tell_with(&self, event: &Event, bytes: &Uint8Array) {
        if let Ok(event) = event.into_js() {
            let _ = self.0.call2(&JsValue::NULL, &event, bytes);
        }
    }

    /// Tells that work cannot go on.
    pub fn fail(&self, code: &str, message: String, advice: String) {
        self.tell(&Event::Failed {
            code: code.to_owned(),
            message,
            advice,
        });
    }
}
