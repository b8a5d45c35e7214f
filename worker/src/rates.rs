//! How fast this machine is, measured once, so that the plan can say how long it will take.

use crate::{engine::Engine, platform};
use recon::{Rates, arithmetic_rate, fusing_rate};
use std::rc::Rc;

fn now_s() -> f64 {
    platform::now_ms() / 1000.0
}

/// How often an unfinished measurement is looked at.
const LOOK_MS: i32 = 10;

/// What is known.
#[derive(Clone, Copy, Default)]
pub enum Measured {
    #[default]
    Not,
    Going,
    /// Nothing of a device that failed: the plan says no time, and the run why.
    Done(Option<Rates>),
}

impl Measured {
    pub fn rates(self) -> Option<Rates> {
        match self {
            Self::Done(rates) => rates,
            Self::Not | Self::Going => None,
        }
    }
}

/// Measures the engine's device unless that is done: some 100 ms, and the first kernels' compilation. Begun while the visitor
/// looks for a scan, and waited for before the first plan.
pub async fn measure(engine: Rc<Engine>) {
    if let Measured::Not = engine.rates.get() {
        engine.rates.set(Measured::Going);
        engine.rates.set(Measured::Done(of(&engine).await));
    }
    while let Measured::Going = engine.rates.get() {
        platform::sleep_ms(LOOK_MS).await;
    }
}

async fn of(engine: &Engine) -> Option<Rates> {
    Some(Rates {
        fusing: fusing_rate(&engine.device, now_s).await?,
        arithmetic: arithmetic_rate(&engine.device, now_s).await?,
    })
}
