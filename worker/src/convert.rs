//! Between the messages and the rooms' own types.

use crate::handoff::Soup;
use crate::messages::{
    BrickMessage, CameraMessage, DepthSource, FindingMessage, InputEvent, PixelSize, PlanSummary,
    PresetName, RunOptions, ShadingMode, StageName, ViewOptions,
};
use crate::platform;
use glam::Affine3A;
use mesh::{camera::Pinhole, soup::VERTEX_FLOATS};
use recon::{Level, NetworkConfig, Options, Plan, Preset, Rates, Stage};
use scan::{Finding, Gravity, GravitySource};
use stereo::StereoConfig;
use view::{CameraPose, Input, Look, PointerKind, Shading, Theme};

pub fn options(message: RunOptions) -> Options {
    Options {
        voxel_size_m: message.voxel_size_m,
        every: message.every as usize,
        views: message.views.map(|views| views as usize),
        max_depth_m: message.max_depth_m,
        depth: message.depth.map(|source| match source {
            DepthSource::Sensor => recon::DepthSource::Sensor,
            DepthSource::Stereo => recon::DepthSource::Stereo(StereoConfig {
                size: (message.stereo_size.width_px, message.stereo_size.height_px),
                ..StereoConfig::default()
            }),
            DepthSource::Network => recon::DepthSource::Network(preset(message.preset).config()),
        }),
    }
}

fn preset(name: PresetName) -> Preset {
    match name {
        PresetName::Small => Preset::Small,
        PresetName::Medium => Preset::Medium,
        PresetName::Full => Preset::Full,
    }
}

/// The preset that a configuration came from.
fn preset_name(config: &NetworkConfig) -> PresetName {
    let all = [PresetName::Medium, PresetName::Full];
    let found = all
        .into_iter()
        .find(|&name| preset(name).config() == *config);
    found.unwrap_or_default()
}

/// What a plan was made with, as the page would ask for it again.
pub fn run_options(plan: &Plan) -> RunOptions {
    let options = &plan.options;
    let (width_px, height_px) = match plan.depth {
        recon::DepthSource::Stereo(config) => config.size,
        recon::DepthSource::Sensor | recon::DepthSource::Network(_) => StereoConfig::default().size,
    };
    RunOptions {
        voxel_size_m: options.voxel_size_m,
        every: options.every as u32,
        views: options.views.map(|views| views as u32),
        max_depth_m: options.max_depth_m,
        depth: Some(depth_source(plan.depth)),
        stereo_size: PixelSize {
            width_px,
            height_px,
        },
        preset: match &plan.depth {
            recon::DepthSource::Network(config) => preset_name(config),
            recon::DepthSource::Sensor | recon::DepthSource::Stereo(_) => PresetName::default(),
        },
    }
}

fn depth_source(source: recon::DepthSource) -> DepthSource {
    match source {
        recon::DepthSource::Sensor => DepthSource::Sensor,
        recon::DepthSource::Stereo(_) => DepthSource::Stereo,
        recon::DepthSource::Network(_) => DepthSource::Network,
    }
}

/// A plan for the page.
pub fn plan_summary(plan: &Plan, rates: Option<Rates>) -> PlanSummary {
    PlanSummary {
        options: run_options(plan),
        depth: depth_source(plan.depth),
        frames: plan.frames as u32,
        keyframes: plan.keyframes.len() as u32,
        bricks: plan.bricks as u32,
        device_bytes: (plan.device_bytes + plan.network_bytes) as f64,
        // What the engine holds already stays.
        heap_bytes: plan.heap_bytes as f64 + platform::heap_bytes(),
        expected_s: rates.map(|rates| plan.work.seconds(&rates)),
        download_bytes: None,
        remarks: plan.remarks.clone(),
    }
}

pub fn stage_name(stage: Stage) -> StageName {
    match stage {
        Stage::WarmingUp => StageName::WarmingUp,
        Stage::Matching => StageName::Matching,
        Stage::Fusing => StageName::Fusing,
        Stage::Features => StageName::Features,
        Stage::Decoding(Level::Coarse) => StageName::Coarse,
        Stage::Decoding(Level::Medium) => StageName::Medium,
        Stage::Decoding(Level::Fine) => StageName::Fine,
        Stage::Coloring => StageName::Coloring,
        Stage::Meshing => StageName::Meshing,
    }
}

pub fn finding(finding: &Finding) -> FindingMessage {
    FindingMessage {
        severity: finding.severity.to_string(),
        code: finding.code.to_owned(),
        file: finding.file.clone(),
        line: finding.line,
        expected: finding.expected.clone(),
        found: finding.found.clone(),
        advice: finding.advice.clone(),
    }
}

pub fn gravity(gravity: &Gravity) -> String {
    match (gravity.source, gravity.planes_from_cameras_deg) {
        (GravitySource::Format, _) => "as the files have it".to_owned(),
        (GravitySource::Estimated, Some(_)) => format!(
            "found from the cameras and the room's planes, {:.0} degrees from the files' Z",
            gravity.rotated_deg
        ),
        (GravitySource::Estimated, None) => format!(
            "guessed from the cameras alone, {:.0} degrees from the files' Z",
            gravity.rotated_deg
        ),
    }
}

pub fn look(view: ViewOptions, floor_height_m: f32) -> Look {
    Look {
        shading: match view.shading {
            ShadingMode::Color => Shading::Color,
            ShadingMode::Normal => Shading::Normal,
            ShadingMode::Wireframe => Shading::Wireframe,
            ShadingMode::Depth => Shading::Depth,
            ShadingMode::Confidence => Shading::Confidence,
            ShadingMode::Views => Shading::Views,
        },
        theme: if view.dark { Theme::DARK } else { Theme::LIGHT },
        cull_back: !view.back_faces,
        show_frusta: view.cameras,
        show_grid: true,
        floor_height_m,
    }
}

/// `None` for a double click: that is a question to the painter, not a movement.
pub fn input(event: InputEvent) -> Option<Input> {
    Some(match event {
        InputEvent::PointerDown {
            id,
            x,
            y,
            button,
            touch,
            shift,
        } => Input::PointerDown {
            id,
            x,
            y,
            button,
            kind: if touch {
                PointerKind::Touch
            } else {
                PointerKind::Mouse
            },
            shift,
        },
        InputEvent::PointerMove { id, x, y } => Input::PointerMove { id, x, y },
        InputEvent::PointerUp { id } => Input::PointerUp { id },
        InputEvent::Wheel { delta, x, y } => Input::Wheel { dy: delta, x, y },
        InputEvent::Key { code, down } => Input::Key { code, down },
        InputEvent::Resize {
            width_px,
            height_px,
            pixel_ratio,
        } => Input::Resize {
            width_px,
            height_px,
            scale: pixel_ratio,
        },
        InputEvent::Blur => Input::Blur,
        InputEvent::DoubleClick { .. } => return None,
    })
}

/// A camera for the view in another worker.
pub fn camera_message(pose: &CameraPose) -> CameraMessage {
    let lens = pose.pinhole;
    CameraMessage {
        world_from_camera: pose.world_from_camera.to_cols_array(),
        size: [lens.width, lens.height],
        lens: [lens.fx, lens.fy, lens.cx, lens.cy],
    }
}

/// A camera from the engine in another worker.
pub fn camera_pose(message: &CameraMessage) -> CameraPose {
    let ([width, height], [fx, fy, cx, cy]) = (message.size, message.lens);
    CameraPose {
        world_from_camera: Affine3A::from_cols_array(&message.world_from_camera),
        pinhole: Pinhole {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
        },
    }
}

/// Bricks for the view in another worker; their numbers travel beside them.
pub fn brick_messages(soup: &Soup) -> Vec<BrickMessage> {
    let bricks = soup.bricks();
    let message = |(brick, numbers): ([i32; 3], &[f32])| {
        BrickMessage(brick, (numbers.len() / VERTEX_FLOATS) as u32)
    };
    bricks.map(message).collect()
}
