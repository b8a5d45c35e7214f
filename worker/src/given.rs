//! What stages of an earlier run made, in another engine that was lost: the next run goes on from there.

use crate::{files, messages::StageName};
use std::cell::RefCell;
use web_sys::Blob;

/// By stage, each good for one run.
#[derive(Default)]
pub struct Given(RefCell<Vec<(StageName, Blob)>>);

impl Given {
    /// Takes what a stage made.
    pub fn put(&self, stage: StageName, made: Blob) {
        self.0.borrow_mut().push((stage, made));
    }

    /// Gives what a stage made; nothing where the browser does not give it back.
    pub fn take(&self, stage: StageName) -> Option<Vec<u8>> {
        let mut all = self.0.borrow_mut();
        let place = all.iter().position(|(of, _)| *of == stage)?;
        files::read(&all.swap_remove(place).1).ok()
    }

    /// Forgets what was not taken: another run is another matter.
    pub fn clear(&self) {
        self.0.take();
    }
}
