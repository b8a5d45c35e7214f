//! What the engine's tasks share: the device, the screen, the scan, its plan and volume, and where a run stands.

use crate::{
    given::Given,
    messages::{Event, StageName},
    page::Page,
    platform,
    rates::Measured,
    screen::Screen,
    weights::Weights,
};
use burn::tensor::Device;
use recon::{Limits, Plan};
use scan::Scan;
use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};
use volume::Volume;

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
    pub page: Page,
    pub device: Device,
    pub limits: Limits,
    pub weights: Weights,
    /// Who shows what is made.
    pub screen: Screen,
    /// How fast the device is; `None` until that is measured.
    pub rates: Cell<Measured>,
    scan: RefCell<Option<Rc<Scan>>>,
    plan: RefCell<Option<Rc<Plan>>>,
    volume: RefCell<Option<Rc<Volume>>>,
    /// What stages of an earlier run made, for the next.
    pub given: Given,
    state: Cell<RunState>,
    stage: Cell<Option<StageName>>,
}

impl Engine {
    /// On a device.
    pub fn new(
        device: Device,
        limits: Limits,
        screen: Screen,
        page: Page,
        weights: Weights,
    ) -> Self {
        Self {
            page,
            device,
            limits,
            weights,
            screen,
            rates: Cell::default(),
            scan: RefCell::default(),
            plan: RefCell::default(),
            volume: RefCell::default(),
            given: Given::default(),
            state: Cell::new(RunState::Idle),
            stage: Cell::default(),
        }
    }

    /// Tells the page.
    pub fn emit(&self, event: &Event) {
        self.page.tell(event);
    }

    /// Tells which of a run's stages begins; one that is on already is not begun again.
    pub fn enter(&self, stage: StageName) {
        if self.stage.replace(Some(stage)) != Some(stage) {
            self.emit(&Event::Stage { stage });
        }
    }

    /// Tells that work cannot go on.
    pub fn fail(&self, code: &str, message: String, advice: String) {
        self.page.fail(code, message, advice);
    }

    pub fn state(&self) -> RunState {
        self.state.get()
    }

    pub fn set_state(&self, state: RunState) {
        self.state.set(state);
        let at_rest = matches!(state, RunState::Idle | RunState::Paused);
        self.screen.set_busy(!at_rest);
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

    /// Clears the screen for a run.
    pub fn begin(&self, brick_size_m: f32) {
        self.set_state(RunState::Running);
        self.stage.take();
        self.volume.take();
        self.screen.clear(brick_size_m, true);
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
}
