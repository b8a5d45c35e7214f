//! The view as a file.

use crate::{job::file_stem, messages::Event, page::Page, viewer::Viewer};
use js_sys::{Promise, Uint8Array};
use std::rc::Rc;
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Blob, ImageEncodeOptions};

/// Makes a PNG of the view.
pub async fn screenshot(viewer: Rc<Viewer>, page: Page, id: u32) {
    match picture(&viewer).await {
        Ok(bytes) => {
            let event = Event::Exported {
                id,
                file_name: format!("{}.png", file_stem(&viewer.title())),
                mime: "image/png".to_owned(),
            };
            page.tell_with(&event, &bytes);
        }
        Err(error) => {
            let message = format!("The picture could not be made ({error:?})");
            page.fail("export", message, "Try again.".to_owned());
        }
    }
}

async fn picture(viewer: &Viewer) -> Result<Uint8Array, JsValue> {
    let canvas = viewer.painted_canvas();
    let options = ImageEncodeOptions::new();
    options.set_type("image/png");
    let blob: Promise = canvas.convert_to_blob_with_options(&options)?;
    let blob: Blob = JsFuture::from(blob).await?.into();
    let buffer = blob.array_buffer();
    Ok(Uint8Array::new(&JsFuture::from(buffer).await?))
}
