//! Everything that ends a command early, in the words of the room it comes from.

use std::path::{Path, PathBuf};

/// Why a command ended early.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file that cannot be read or written.
    #[error("expected to {action} {}: {error}; check the path and its permissions", path.display())]
    File {
        /// Read or write.
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// An output whose ending names no format.
    #[error("expected an output that ends in .ply, .glb or .obj, found {}; rename it", path.display())]
    Format {
        /// Which file.
        path: PathBuf,
    },
    /// No GPU, though one was asked for.
    #[error("expected a GPU that burn can use, found none ({0}); run with --device cpu")]
    Gpu(String),
    /// A benchmark without a result.
    #[error(transparent)]
    Unread(#[from] ::bench::Unread),
    /// The scan cannot be opened.
    #[error(transparent)]
    Scan(#[from] scan::ScanError),
    /// The folder or zip cannot be opened.
    #[error(transparent)]
    Source(#[from] scan::SourceError),
    /// The scan is colour alone.
    #[error(
        "expected depth images beside the colour images of {name}, found none; run `ipdrecon stereo`, which needs colour alone"
    )]
    NoDepth {
        /// Name of the scan.
        name: String,
    },
    /// A row of a table that nobody gave weights for.
    #[error("expected weights of the row, found none; name a file")]
    NoWeights,
    /// A table of nothing.
    #[error(
        "expected --scans with folders or zips of scans with depth, found none; `ipdrecon synth` makes some"
    )]
    NoScans,
    /// Something that should have a name before it.
    #[error(
        "expected {option} {expected}, found {found}; give it a name, such as ours=weights.safetensors"
    )]
    Named {
        /// The option.
        option: &'static str,
        /// Its form.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A file that is not the network's weights.
    #[error("{}: {error}", path.display())]
    Weights {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        error: Box<net::weights::WeightsError>,
    },
    /// A file that PyTorch did not write.
    #[error("{}: expected a checkpoint that torch.save wrote: {error}; copy it again, or save its state_dict anew", path.display())]
    Checkpoint {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        error: String,
    },
    /// A checkpoint of another network.
    #[error(transparent)]
    Import(#[from] net::weights::vortx::ImportError),
    /// The run went well, and there is no surface.
    #[error(
        "expected a surface, found none from {keyframes} keyframes, and no mesh is written; `ipdrecon doctor` looks into the scan for what may be wrong"
    )]
    NoSurface {
        /// Keyframes used.
        keyframes: usize,
    },
    /// The run cannot be planned.
    #[error(transparent)]
    Plan(#[from] recon::PlanError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] recon::RunError),
    /// The training failed.
    #[error(transparent)]
    Train(#[from] train::TrainError),
    /// The volume failed.
    #[error(transparent)]
    Volume(#[from] volume::VolumeError),
    /// The comparison failed.
    #[error(transparent)]
    Evaluate(#[from] recon::evaluate::EvaluateError),
    /// A depth map that cannot be written, or is none.
    #[error("{}: expected a 16-bit grey PNG, {error}", path.display())]
    Png {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        error: String,
    },
    /// Depth maps and a scan that have nothing in common.
    #[error(
        "expected depth maps in {} that belong to frames of {name} with depth of a sensor ({measured} frames), found none; \
         give the folder that `ipdrecon stereo --depth` wrote for this scan, and the scan with its depth images",
        folder.display()
    )]
    NoDepthMaps {
        /// The folder of depth maps.
        folder: PathBuf,
        /// Name of the scan.
        name: String,
        /// Frames of the scan with depth.
        measured: usize,
    },
    /// A mesh file that is no PLY.
    #[error("{}: {error}", path.display())]
    Ply {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        error: Box<mesh::ply::PlyError>,
    },
    /// A picture that cannot be compressed.
    #[error("{}: the picture could not be written: {error}; check the size that --size gives", path.display())]
    Picture {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        error: String,
    },
    /// No GPU that makes pictures.
    #[error(transparent)]
    Rays(#[from] synth::GpuError),
    /// Threads that the system refuses to start.
    #[error("expected to start {wanted} threads: {error}; ask for fewer with --threads")]
    Threads {
        /// How many were asked for.
        wanted: usize,
        /// What the system says.
        error: String,
    },
    /// The result cannot be put into words for programs.
    #[error("the report could not be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

impl Failure {
    /// The system refused to `action` a file or folder.
    pub fn file(action: &'static str, path: &Path, error: std::io::Error) -> Self {
        Self::File {
            action,
            path: path.to_owned(),
            error,
        }
    }
}
