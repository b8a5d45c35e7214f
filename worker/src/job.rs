//! The engine's work: open, plan, run, export. Each is a task of its own; between two steps the event loop turns.

use crate::{
    convert,
    engine::{Engine, RunState},
    files::{DroppedFolder, DroppedZip},
    messages::{Event, FindingMessage, MeshFormat, RunOptions, StageName},
    platform, rates,
    sink::PageSink,
    weights::Fault,
};
use js_sys::Uint8Array;
use recon::{DepthSource, Options, Preset, RunError};
use scan::{Scan, ScanError, Source, ZipSource};
use std::rc::Rc;
use stereo::StereoError;
use view::CameraPose;
use volume::VolumeError;

/// Where a scan comes from.
pub enum Origin {
    Folder(DroppedFolder),
    Zip(DroppedZip),
    Sample(u32),
}

/// Opens a scan and plans its run.
pub async fn open(engine: Rc<Engine>, origin: Origin) {
    engine.emit(&Event::Stage {
        stage: StageName::Opening,
    });
    engine.stop_and_wait().await;
    // A turn for the page to show the stage: reading a large scan takes its time.
    platform::sleep_ms(0).await;
    match open_source(origin).and_then(scan::open) {
        Ok(scan) => {
            rates::measure(engine.clone()).await;
            opened(&engine, scan);
        }
        Err(error) => fail_scan(&engine, &error),
    }
}

fn open_source(origin: Origin) -> Result<Rc<dyn Source>, ScanError> {
    Ok(match origin {
        Origin::Folder(folder) => Rc::new(folder),
        Origin::Zip(zip) => {
            let name = zip.0.name();
            Rc::new(ZipSource::open_named(&name, zip)?)
        }
        Origin::Sample(seed) => Rc::new(synth::SampleScan::walk(u64::from(seed))),
    })
}

fn fail_scan(engine: &Engine, error: &ScanError) {
    let (message, advice) = match error.finding() {
        Some(finding) => {
            engine.emit(&Event::Finding {
                finding: convert::finding(finding),
            });
            let place = finding.file.as_ref().map_or(String::new(), |file| {
                let line = finding
                    .line
                    .map_or(String::new(), |line| format!(":{line}"));
                format!("{file}{line}: ")
            });
            let text = format!(
                "{place}expected {}, found {}",
                finding.expected, finding.found
            );
            (text, finding.advice.clone())
        }
        None => {
            let text = error.to_string();
            let (message, advice) = text.split_once(". ").unwrap_or((&text, ""));
            let (message, advice) = (message.to_owned(), advice.to_owned());
            engine.emit(&Event::Finding {
                finding: source_finding(&message, &advice),
            });
            (message, advice)
        }
    };
    engine.fail("scan", message, advice);
}

/// A fault of the folder or the archive itself, whose text reads `place: expected …, found …`.
fn source_finding(message: &str, advice: &str) -> FindingMessage {
    let (file, rest) = match message.split_once(": expected ") {
        Some((file, rest)) => (Some(file.to_owned()), rest),
        None => (None, message),
    };
    let (expected, found) = rest.split_once(", found ").unwrap_or((rest, ""));
    FindingMessage {
        severity: "error".to_owned(),
        code: "source".to_owned(),
        file,
        line: None,
        expected: expected.to_owned(),
        found: found.to_owned(),
        advice: advice.to_owned(),
    }
}

fn opened(engine: &Rc<Engine>, scan: Scan) {
    engine.emit(&Event::Opened {
        name: scan.name().to_owned(),
        format: scan.format().to_string(),
        frames: scan.frames().len() as u32,
        has_depth: scan.has_depth(),
        has_color: scan.has_color(),
        gravity: convert::gravity(scan.gravity()),
    });
    for finding in scan.findings() {
        engine.emit(&Event::Finding {
            finding: convert::finding(finding),
        });
    }
    // Where there is no depth, the network makes more of the pictures than stereo alone.
    let network = scan.has_color() && !scan.has_depth();
    let network = network.then(|| DepthSource::Network(Preset::Small.config()));
    engine.set_scan(scan);
    let options = Options {
        depth: network,
        ..Options::default()
    };
    plan(engine, options);
}

/// Plans and tells; whether there is a plan.
pub fn plan(engine: &Rc<Engine>, options: Options) -> bool {
    let Some(scan) = engine.scan() else {
        return false;
    };
    match recon::plan(&scan, &engine.limits, options) {
        Ok(plan) => {
            engine.emit(&Event::Planned {
                plan: convert::plan_summary(&plan, engine.rates.get().rates()),
            });
            let frames = plan.keyframes.iter().map(|&frame| &scan.frames()[frame]);
            let poses = frames.map(|frame| CameraPose {
                world_from_camera: recon::pose(frame),
                pinhole: recon::pinhole(match plan.depth {
                    DepthSource::Sensor => &frame.depth_camera,
                    DepthSource::Stereo(_) | DepthSource::Network(_) => &frame.color_camera,
                }),
            });
            let poses: Vec<_> = poses.collect();
            engine.screen.set_cameras(scan.name(), &poses);
            engine.set_plan(plan);
            true
        }
        Err(error) => {
            let text = error.to_string();
            let (message, advice) = text.split_once("; ").unwrap_or((&text, ""));
            engine.fail("scan", message.to_owned(), advice.to_owned());
            false
        }
    }
}

/// Runs the plan.
pub async fn run(engine: Rc<Engine>, options: RunOptions) {
    engine.stop_and_wait().await;
    let planned = engine.plan().map(|plan| convert::run_options(&plan));
    if planned != Some(options) && !plan(&engine, convert::options(options)) {
        return;
    }
    let (Some(scan), Some(plan)) = (engine.scan(), engine.plan()) else {
        let advice = "Open a scan first.".to_owned();
        engine.fail("scan", "There is no scan to work on".to_owned(), advice);
        return;
    };
    engine.begin(plan.volume.voxel_size_m * volume::BRICK_EDGE as f32);
    let mut sink = PageSink::new(engine.clone());
    let result = match plan.depth {
        DepthSource::Network(config) => match engine.weights.network(&engine, &config).await {
            Ok(network) => {
                recon::reconstruct(&scan, &plan, &*network, &engine.device, &mut sink).await
            }
            Err(fault) => {
                engine.set_state(RunState::Idle);
                return without_network(&engine, fault, &sink);
            }
        },
        DepthSource::Sensor | DepthSource::Stereo(_) => {
            recon::run(&scan, &plan, &engine.device, &mut sink).await
        }
    };
    engine.set_state(RunState::Idle);
    engine.given.clear();
    match result {
        Ok(outcome) => {
            let (_, triangles) = engine.screen.counts();
            let event = Event::Finished {
                cancelled: outcome.stopped,
                frames: outcome.frames_fused as u32,
                bricks: outcome.volume.brick_count() as u32,
                triangles,
                elapsed_s: sink.elapsed_s(),
                heap_bytes: platform::heap_bytes(),
            };
            engine.set_volume(outcome.volume);
            engine.emit(&event);
        }
        Err(error) => {
            let text = error.to_string();
            let (message, advice) = text.split_once("; ").unwrap_or((&text, ""));
            let code = match error {
                RunError::Volume(VolumeError::TooManyBricks { .. }) | RunError::TooLarge { .. } => {
                    "memory"
                }
                RunError::Volume(_) | RunError::Stereo(StereoError::Device(_)) => "device",
                RunError::NoWeights => "weights",
                RunError::Stereo(_)
                | RunError::NothingFused { .. }
                | RunError::TooFewPictures { .. }
                | RunError::NoOverlap { .. }
                | RunError::NothingOccupied { .. } => "scan",
            };
            engine.fail(code, message.to_owned(), advice.to_owned());
        }
    }
}

/// The run ends before it began.
fn without_network(engine: &Engine, fault: Fault, sink: &PageSink) {
    match fault {
        Fault::Stopped => engine.emit(&Event::Finished {
            cancelled: true,
            frames: 0,
            bricks: 0,
            triangles: 0,
            elapsed_s: sink.elapsed_s(),
            heap_bytes: platform::heap_bytes(),
        }),
        failed @ Fault::Failed { .. } => failed.tell(engine),
    }
}

/// Makes a file of the mesh.
pub async fn export(engine: Rc<Engine>, id: u32, format: MeshFormat, canonical: bool) {
    let (Some(scan), Some(volume)) = (engine.scan(), engine.volume()) else {
        let advice = "Wait until the run has ended, or cancel it.".to_owned();
        engine.fail("export", "There is no finished mesh yet".to_owned(), advice);
        return;
    };
    let mut mesh = match volume.mesh().await {
        Ok(mesh) => mesh,
        Err(error) => {
            engine.fail("export", error.to_string(), "Try again.".to_owned());
            return;
        }
    };
    let up = recon::place(&mut mesh, &scan, canonical);
    let (bytes, ending, mime) = match format {
        MeshFormat::Glb => (mesh::glb::write(&mesh, up), "glb", "model/gltf-binary"),
        MeshFormat::Ply => (mesh::ply::write(&mesh), "ply", "application/octet-stream"),
        MeshFormat::Obj => (mesh::obj::write(&mesh), "obj", "model/obj"),
    };
    let event = Event::Exported {
        id,
        file_name: format!("{}.{ending}", file_stem(scan.name())),
        mime: mime.to_owned(),
    };
    engine
        .page
        .tell_with(&event, &Uint8Array::from(bytes.as_slice()));
}

/// A scan's name as a file's: without its ending, and without what file systems refuse.
pub fn file_stem(name: &str) -> String {
    let stem = name.strip_suffix(".zip").unwrap_or(name);
    let kept = stem.chars().map(|c| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    });
    let stem: String = kept.collect();
    if stem.is_empty() {
        "scan".to_owned()
    } else {
        stem
    }
}
