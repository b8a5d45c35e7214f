//! What the page and the worker say to each other, defined once: the TypeScript types of these enums are generated
//! from here, so that the page cannot drift from the engine.
//!
//! Binary things travel beside the message: files as structured-clone `File`s, the canvas as a transferred
//! `OffscreenCanvas`, exports and pictures as `Uint8Array`.

mod drawing;
mod view;

pub use drawing::{BrickMessage, CameraMessage, Drawing};
use serde::{Deserialize, Serialize};
use tsify::Tsify;
pub use view::{InputEvent, LookAt, ShadingMode, ViewOptions};

/// From the page to the worker.
#[derive(Deserialize, Tsify)]
#[serde(
    tag = "type",
    rename_all = "camelCase",
    rename_all_fields = "camelCase"
)]
pub enum Request {
    /// First message. The canvas itself is passed beside it.
    Start {
        /// Size of the canvas in physical pixels.
        width_px: u32,
        /// Size of the canvas in physical pixels.
        height_px: u32,
        /// Physical pixels per CSS pixel.
        pixel_ratio: f32,
        /// Where to compute.
        device: DeviceChoice,
        /// Where the network's weights lie, if not beside the worker script.
        #[serde(default)]
        weights: Option<WeightsAddress>,
    },
    /// Open a dropped folder: the files are passed beside it, one for each path, in the same order.
    OpenFolder {
        /// Paths relative to what was dropped, forward slashes, one a line: one string, because thousands would take
        /// seconds to hand over.
        paths: String,
    },
    /// Open a dropped zip: the file is passed beside it.
    OpenZip,
    /// Open the sample room that is made by rule.
    OpenSample {
        /// Which room.
        seed: u32,
    },
    /// Take these weights for the network, here passed beside it as the only file, instead of those that would be fetched.
    UseWeights,
    /// Give the next run what an earlier run with the same scan, options and weights made in a stage: the bytes of its `Kept` event
    /// are passed beside it as the only file.
    Keep {
        /// Which stage.
        stage: StageName,
    },
    /// Run the plan that the last `Planned` event announced, with these options (a change of options plans again first).
    Run {
        /// What to do.
        options: RunOptions,
    },
    /// Plan again with other options, without starting.
    Replan {
        /// What to do.
        options: RunOptions,
    },
    /// Hold after the current frame.
    Pause,
    /// Go on.
    Resume,
    /// Stop; what was fused so far stays, can be looked at and exported.
    Cancel,
    /// Make a file of the mesh.
    Export {
        /// Echoed in the answer.
        id: u32,
        /// Which file.
        format: MeshFormat,
        /// Keep the canonical frame (Z up) instead of the scan's own.
        canonical: bool,
    },
    /// A picture of the view as PNG.
    Screenshot {
        /// Echoed in the answer.
        id: u32,
    },
    /// Pointer, wheel and keys on the canvas.
    Input {
        /// The input.
        input: InputEvent,
    },
    /// How the view is drawn.
    View {
        /// All of it, every time.
        view: ViewOptions,
    },
    /// Put the camera somewhere.
    Look {
        /// Where.
        at: LookAt,
    },
}

/// Where to compute.
#[derive(Deserialize, Tsify, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub enum DeviceChoice {
    /// WebGPU if it is there, otherwise the CPU. An adapter that is software draws, and leaves the rest to the CPU.
    Auto,
    /// WebGPU for everything, even where the adapter is software: to try on one machine what happens on another.
    Gpu,
    /// The CPU, even where there is WebGPU.
    Cpu,
}

/// Where weights are fetched from.
#[derive(Deserialize, Tsify, Clone)]
#[serde(rename_all = "camelCase")]
pub struct WeightsAddress {
    /// Absolute address of a safetensors file.
    pub url: String,
    /// What its bytes must hash to, in hexadecimal; left out, they are taken as they come.
    #[serde(default)]
    pub sha256: Option<String>,
}

/// What to do with a scan.
#[derive(Serialize, Deserialize, Tsify, Clone, Copy, PartialEq)]
#[serde(rename_all = "camelCase")]
pub struct RunOptions {
    /// Edge of a voxel in metres; 0.04 by default.
    pub voxel_size_m: f32,
    /// Take every n-th keyframe; 1 by default.
    pub every: u32,
    /// At most this many keyframes, spread evenly over those that `every` leaves; all of them by default.
    #[serde(default)]
    pub views: Option<u32>,
    /// Depth beyond this is not used, metres.
    pub max_depth_m: f32,
    /// Where depth comes from; left out, from the sensor where the scan has depth, otherwise from the pictures.
    #[serde(default)]
    pub depth: Option<DepthSource>,
    /// With stereo, pictures are scaled down to fit into this; 320 by 240 by default.
    pub stereo_size: PixelSize,
    /// With the network: how much of it; `small` by default, which a phone can do.
    pub preset: PresetName,
}

/// Where depth comes from.
#[derive(Serialize, Deserialize, Tsify, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub enum DepthSource {
    /// The depth images of the scan.
    Sensor,
    /// The colour pictures and their poses: what one sees is looked for in its neighbours.
    Stereo,
    /// The colour pictures and their poses, by a trained network, whose weights are fetched once and kept.
    Network,
}

/// How much work the network is given.
#[derive(Serialize, Deserialize, Tsify, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub enum PresetName {
    /// Pictures of 160 by 120 pixels, 20 views a tile: what the released weights were trained on.
    #[default]
    Small,
    /// Pictures of 320 by 240 pixels, 60 views a tile.
    Medium,
    /// Pictures of 640 by 480 pixels, 100 views a tile: the paper's.
    Full,
}

/// Width and height.
#[derive(Serialize, Deserialize, Tsify, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub struct PixelSize {
    /// Pixels.
    pub width_px: u32,
    /// Pixels.
    pub height_px: u32,
}

/// A file of the mesh.
#[derive(Deserialize, Tsify, Clone, Copy)]
#[serde(rename_all = "camelCase")]
pub enum MeshFormat {
    /// glTF 2.0 binary.
    Glb,
    /// Stanford PLY, binary.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

/// From the worker to the page.
#[derive(Serialize, Tsify)]
#[serde(
    tag = "type",
    rename_all = "camelCase",
    rename_all_fields = "camelCase"
)]
pub enum Event {
    /// The engine is up.
    Ready {
        /// `webgpu` or `cpu`.
        device: String,
        /// Name of the adapter, for reports.
        adapter: String,
        /// Why it is the CPU, when it is.
        note: Option<String>,
    },
    /// A scan was opened.
    Opened {
        /// Name of the folder, zip or sample.
        name: String,
        /// For example `7-Scenes`.
        format: String,
        /// Usable frames.
        frames: u32,
        /// Whether depth was recorded.
        has_depth: bool,
        /// Whether colour was recorded.
        has_color: bool,
        /// How up was found, in words.
        gravity: String,
    },
    /// Weights that were given are in use.
    Weights {
        /// Name of their file.
        name: String,
        /// Its size.
        bytes: f64,
    },
    /// What will be done, before any work.
    Planned {
        /// The plan.
        plan: PlanSummary,
    },
    /// A stage began.
    Stage {
        /// Which; their order for each source of depth is [`StageName`]'s.
        stage: StageName,
    },
    /// A count of known work within the stage.
    Progress {
        /// Done so far.
        done: u32,
        /// Of this many.
        total: u32,
        /// Triangles on show.
        triangles: u32,
        /// Seconds since the run began, pauses left out.
        elapsed_s: f64,
        /// Size of the engine's memory in bytes.
        heap_bytes: f64,
    },
    /// A stage is done; what it made is passed beside it, for another engine to go on from should this one be lost.
    Kept {
        /// Which stage.
        stage: StageName,
    },
    /// Bricks of the mesh changed on show.
    Bricks {
        /// How many bricks now have a surface.
        bricks: u32,
        /// Triangles on show.
        triangles: u32,
    },
    /// The run is held.
    Paused,
    /// The run goes on.
    Resumed,
    /// The run came to its end, or was cancelled.
    Finished {
        /// It was cancelled: the mesh is of the frames so far.
        cancelled: bool,
        /// Frames fused.
        frames: u32,
        /// Bricks of the volume.
        bricks: u32,
        /// Triangles on show.
        triangles: u32,
        /// Seconds, pauses left out.
        elapsed_s: f64,
        /// Size of the engine's memory in bytes.
        heap_bytes: f64,
    },
    /// Something about the scan that the user should know; work goes on.
    Finding {
        /// What.
        finding: FindingMessage,
    },
    /// Work cannot go on.
    Failed {
        /// One of a few words for programs: `noWebgpu`, `scan`, `memory`, `device`, `weights`, `internal`, `export`.
        code: String,
        /// One plain sentence.
        message: String,
        /// What to try.
        advice: String,
    },
    /// The file that was asked for; its bytes are passed beside it.
    Exported {
        /// From the request.
        id: u32,
        /// Suggested name.
        file_name: String,
        /// Its MIME type.
        mime: String,
    },
    /// Where the eye is, when it has come to rest.
    CameraChanged {
        /// In words, for those who cannot see the canvas.
        description: String,
    },
}

/// A plan, in numbers for the page.
#[derive(Serialize, Tsify, Clone)]
#[serde(rename_all = "camelCase")]
pub struct PlanSummary {
    /// The options planned with, those that were left to the engine filled in.
    pub options: RunOptions,
    /// Where depth will come from.
    pub depth: DepthSource,
    /// Usable frames of the scan.
    pub frames: u32,
    /// Frames that will be used: what the keyframe rule, `every` and `views` leave.
    pub keyframes: u32,
    /// Bricks expected.
    pub bricks: u32,
    /// Bytes on the device expected.
    pub device_bytes: f64,
    /// Bytes of heap expected.
    pub heap_bytes: f64,
    /// Seconds expected, within a factor of two: the work counted, over how fast this machine did a little of it.
    pub expected_s: Option<f64>,
    /// Bytes of weights that the run will fetch first, which the worker script knows: 0 where they are at hand, nothing without the
    /// network or where their size is not known.
    pub download_bytes: Option<f64>,
    /// What was turned down and why, in words; empty when everything fits.
    pub remarks: Vec<String>,
}

/// A stage of the run.
#[derive(Serialize, Deserialize, Tsify, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub enum StageName {
    /// The scan is read.
    Opening,
    /// The network's weights are fetched; counted in bytes.
    Downloading,
    /// Kernels are compiled.
    WarmingUp,
    /// Views are matched with their neighbours, and the depth that comes of it becomes a volume; counted in keyframes.
    Matching,
    /// The sensor's depth becomes a volume; counted in keyframes.
    Fusing,
    /// Pictures become the network's feature planes; counted in keyframes.
    Features,
    /// The network makes voxels of 16 cm; counted in blocks of them.
    Coarse,
    /// The network makes voxels of 8 cm; counted in blocks of them.
    Medium,
    /// The network makes voxels of 4 cm; counted in blocks of them.
    Fine,
    /// The network's surface gets its colours; counted in keyframes.
    Coloring,
    /// The last bricks of the mesh are made.
    Meshing,
}

/// Something about the scan that the user should know.
#[derive(Serialize, Tsify, Clone)]
#[serde(rename_all = "camelCase")]
pub struct FindingMessage {
    /// `error`, `warning` or `info`.
    pub severity: String,
    /// For programs.
    pub code: String,
    /// The file it is about.
    pub file: Option<String>,
    /// The line in it, from 1.
    pub line: Option<u32>,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
    /// What to do.
    pub advice: String,
}
