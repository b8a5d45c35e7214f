//! What a run tells the page, and how the visitor holds or stops it.

use crate::{
    convert,
    engine::{Engine, RunState},
    messages::Event,
    platform,
};
use glam::Vec3;
use js_sys::Uint8Array;
use recon::{Flow, Sink, Stage};
use scan::Finding;
use std::rc::Rc;
use volume::{BrickMeshes, VolumeError};

/// How long a paused run waits before it looks again.
const PAUSE_TURN_MS: i32 = 40;
/// While the visitor moves the view, it gets frames for this share of a long step's time, and at most for so long.
const HAND_SHARE: f64 = 0.1;
const HAND_MS: f64 = 300.0;
const FRAME_MS: i32 = 16;

/// Tells the page about a run, and lets it hold or stop it.
pub struct PageSink {
    engine: Rc<Engine>,
    started_ms: f64,
    total: usize,
    /// When the step that is being done began.
    step_ms: f64,
}

impl PageSink {
    /// Of a run that begins now.
    pub fn new(engine: Rc<Engine>) -> Self {
        Self {
            engine,
            started_ms: platform::now_ms(),
            total: 0,
            step_ms: platform::now_ms(),
        }
    }

    /// Seconds since then, pauses left out.
    pub fn elapsed_s(&self) -> f64 {
        (platform::now_ms() - self.started_ms) / 1000.0
    }
}

impl Sink for PageSink {
    fn stage(&mut self, stage: Stage, total: usize) {
        self.total = total;
        self.engine.enter(convert::stage_name(stage));
    }

    fn progress(&mut self, done: usize) {
        let (_, triangles) = self.engine.screen.counts();
        self.engine.emit(&Event::Progress {
            done: done as u32,
            total: self.total as u32,
            triangles,
            elapsed_s: self.elapsed_s(),
            heap_bytes: platform::heap_bytes(),
        });
    }

    fn finding(&mut self, finding: Finding) {
        self.engine.emit(&Event::Finding {
            finding: convert::finding(&finding),
        });
    }

    fn keeps(&self) -> bool {
        true
    }

    fn keep(&mut self, stage: Stage, made: Vec<u8>) {
        let stage = convert::stage_name(stage);
        let bytes = Uint8Array::from(made.as_slice());
        self.engine.page.tell_with(&Event::Kept { stage }, &bytes);
    }

    fn kept(&mut self, stage: Stage) -> Option<Vec<u8>> {
        self.engine.given.take(convert::stage_name(stage))
    }

    fn eye(&self) -> Option<Vec3> {
        self.engine.screen.eye()
    }

    fn surface(&mut self, brick_size_m: f32) {
        self.engine.screen.clear(brick_size_m, false);
    }

    async fn bricks(&mut self, meshes: BrickMeshes) -> Result<(), VolumeError> {
        self.engine.screen.show(meshes).await?;
        let (bricks, triangles) = self.engine.screen.counts();
        self.engine.emit(&Event::Bricks { bricks, triangles });
        Ok(())
    }

    async fn checkpoint(&mut self) -> Flow {
        let now_ms = platform::now_ms();
        let hand_ms = ((now_ms - self.step_ms) * HAND_SHARE).min(HAND_MS);
        platform::sleep_ms(0).await;
        while self.engine.screen.is_touched() && platform::now_ms() - now_ms < hand_ms {
            platform::sleep_ms(FRAME_MS).await;
        }
        if self.engine.state() == RunState::Pausing {
            let held_ms = platform::now_ms();
            self.engine.set_state(RunState::Paused);
            self.engine.emit(&Event::Paused);
            while self.engine.state() == RunState::Paused {
                platform::sleep_ms(PAUSE_TURN_MS).await;
            }
            self.started_ms += platform::now_ms() - held_ms;
            if self.engine.state() == RunState::Running {
                self.engine.emit(&Event::Resumed);
            }
        }
        self.step_ms = platform::now_ms();
        match self.engine.state() {
            RunState::Stopping => Flow::Stop,
            _ => Flow::Continue,
        }
    }
}
