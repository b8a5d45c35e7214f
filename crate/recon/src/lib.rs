//! The job: from a scan to a mesh. What fits ([`plan`]), in what order ([`run`]), what is told on the way ([`Sink`]),
//! and how good the result is ([`evaluate`]). The same code behind the worker and the command line.

mod calibrate;
mod convert;
pub mod evaluate;
mod event;
mod plan;
mod run;

pub use calibrate::{arithmetic_rate, fusing_rate};
pub use convert::{pinhole, place, pose, up};
pub use event::{Flow, Sink, Stage};
pub use net::Level;
pub use plan::{
    DepthSource, Limits, NetworkConfig, Options, Plan, PlanError, Preset, Rates, ViewChoice, Work,
    plan,
};
pub use run::{
    Input, Network, Outcome, RunError, Seen, fused_at_once, reconstruct, run, warm_up_network,
};
