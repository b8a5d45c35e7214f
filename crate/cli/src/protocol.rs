//! How meshes are compared, as a word on the command line.

use clap::ValueEnum;
use recon::evaluate;

/// A protocol of `recon::evaluate`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Protocol {
    /// Rendered into every frame, masked by the truth, fused again.
    Vortx,
    /// Samples against the truth's vertices, where the scan saw something.
    #[value(name = "transformerfusion")]
    TransformerFusion,
    /// Samples of both surfaces.
    Plain,
}

impl From<Protocol> for evaluate::Protocol {
    fn from(protocol: Protocol) -> Self {
        match protocol {
            Protocol::Vortx => Self::Vortx,
            Protocol::TransformerFusion => Self::TransformerFusion,
            Protocol::Plain => Self::Plain,
        }
    }
}
