//! What the network's parts cost on a device, measured alike natively, under Node and in a browser.
//!
//! [`Subject`] holds a network and inputs of a stated size; its methods time one part each ([`Times`]: cold apart from warm).
//! [`work`] counts what a part must compute and move, [`peak`] measures what the device can do, [`Report`] sets both beside
//! each other.

pub mod allocation;
pub mod input;
pub mod peak;
pub mod report;
pub mod subject;
pub mod time;
#[cfg(target_family = "wasm")]
pub mod web;
pub mod work;

pub use peak::Peak;
pub use report::{Report, Row};
pub use subject::{Subject, Unread};
pub use time::Times;
