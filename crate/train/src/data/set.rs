//! The scans of a run: their frames in memory, their truth made when first asked for.

use super::guide::StereoMaps;
use super::picture::{pinhole, single};
use super::volume::{Building, DepthView, TruthVolume, VOXEL_M};
use crate::error::TrainError;
use glam::{IVec3, Vec2, Vec3};
use scan::{FolderSource, Frame, KeyframeRule, Scan, ScanError, ZipSource};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};

/// Depth images held in memory at a time while a truth is made.
const FRAMES_AT_ONCE: usize = 32;
/// Room around what was measured, in metres: the truncation distance and a voxel.
const MARGIN_M: f32 = 0.16;
/// Points of a volume: 268 million are a hall of 60 x 60 m.
const MOST_POINTS: usize = 1 << 28;

/// Opens scan number `i`. A [`Scan`] stays on the thread that opened it, so every thread opens its own.
pub type Opener = Arc<dyn Fn(usize) -> Result<Scan, TrainError> + Send + Sync>;

/// What is known of a scan without its pictures.
pub struct ScanEntry {
    /// What to call it.
    pub name: String,
    /// Frames that have colour.
    pub frames: Vec<Frame>,
    /// The numbers that the scan itself gives those frames.
    pub numbers: Vec<usize>,
    /// Which of `frames` are keyframes.
    pub keyframes: Vec<usize>,
    truth: Mutex<Option<Arc<TruthVolume>>>,
    guide: Mutex<Option<Arc<StereoMaps>>>,
}

/// Scans with depth.
pub struct ScanSet {
    /// The scans.
    pub entries: Vec<ScanEntry>,
    open: Opener,
    max_depth_m: f32,
    cache: Option<PathBuf>,
}

impl ScanSet {
    /// The scans that [`scans_at`] finds at each path.
    ///
    /// # Errors
    /// When nothing matches, or a scan cannot be opened, has no depth or has fewer than `views` frames.
    pub fn from_paths(
        paths: &[PathBuf],
        views: usize,
        max_depth_m: f32,
        cache: Option<PathBuf>,
    ) -> Result<Self, TrainError> {
        let mut folders = Vec::new();
        for path in paths {
            folders.extend(scans_at(path)?);
        }
        let names: Vec<String> = folders.iter().map(|f| f.display().to_string()).collect();
        let open: Opener = Arc::new(move |i| open_path(&folders[i]));
        let mut set = Self::new(&names, open, views, max_depth_m)?;
        set.cache = cache;
        Ok(set)
    }

    /// The scans that `open` gives, one for each name.
    ///
    /// # Errors
    /// When a scan cannot be opened, has no depth or has fewer than `views` frames.
    pub fn new(
        names: &[String],
        open: Opener,
        views: usize,
        max_depth_m: f32,
    ) -> Result<Self, TrainError> {
        if names.is_empty() {
            return Err(TrainError::unfit(
                "data.scans",
                "at least one scan",
                "none",
                "make rooms with `ipdrecon synth`, or name folders of scans with depth",
            ));
        }
        let entry = |(i, name): (usize, &String)| entry(name, &open(i)?, views);
        let entries: Result<Vec<_>, _> = names.iter().enumerate().map(entry).collect();
        Ok(Self {
            entries: entries?,
            open,
            max_depth_m,
            cache: None,
        })
    }

    /// Opens scan number `index` for the calling thread.
    ///
    /// # Errors
    /// When it is no longer what it was.
    pub fn open(&self, index: usize) -> Result<Scan, TrainError> {
        (self.open)(index)
    }

    /// The truth of scan number `index`: made at the first call, kept after.
    ///
    /// # Errors
    /// When a depth image cannot be read, or nothing is near a surface.
    pub fn truth(&self, index: usize, scan: &Scan) -> Result<Arc<TruthVolume>, TrainError> {
        let entry = &self.entries[index];
        let depth_mm = (self.max_depth_m * 1000.0).round();
        let file = self.cache_file(entry, &format!("-{depth_mm}mm.tsdf"));
        let make = || self.fuse(entry, scan);
        let volume = kept(
            &entry.truth,
            file,
            TruthVolume::read,
            TruthVolume::write,
            make,
        )?;
        if volume.near == 0 {
            return Err(TrainError::unfit(
                &entry.name,
                format!("surfaces within {} m of the cameras", self.max_depth_m),
                "none",
                "raise data.max_depth_m, or leave the scan out",
            ));
        }
        Ok(volume)
    }

    /// Stereo's depth of scan number `index`: made at the first call, kept after.
    ///
    /// # Errors
    /// When stereo cannot read a picture.
    pub fn guide(&self, index: usize, scan: &Scan) -> Result<Arc<StereoMaps>, TrainError> {
        let entry = &self.entries[index];
        let file = self.cache_file(entry, ".stereo");
        let make = || {
            let keyframes: Vec<usize> = entry.keyframes.iter().map(|&k| entry.numbers[k]).collect();
            StereoMaps::make(scan, &keyframes).map_err(|error| TrainError::Stereo {
                scan: entry.name.clone(),
                error,
            })
        };
        kept(
            &entry.guide,
            file,
            StereoMaps::read,
            StereoMaps::write,
            make,
        )
    }

    /// Where something that is made of a scan is kept between runs.
    fn cache_file(&self, entry: &ScanEntry, ending: &str) -> Option<PathBuf> {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let name: String = entry.name.chars().map(plain).collect();
        Some(self.cache.as_deref()?.join(name + ending))
    }

    fn fuse(&self, entry: &ScanEntry, scan: &Scan) -> Result<TruthVolume, TrainError> {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &number in &entry.numbers {
            for point in self
                .depth_view(entry, scan, number)?
                .iter()
                .flat_map(corners)
            {
                low = low.min(point);
                high = high.max(point);
            }
        }
        if low.cmpgt(high).any() {
            return Ok(TruthVolume::fuse(IVec3::ZERO, [0; 3], &[]));
        }
        let start = ((low - MARGIN_M) / VOXEL_M).floor().as_ivec3();
        let end = ((high + MARGIN_M) / VOXEL_M).ceil().as_ivec3() + 1;
        let size = (end - start).as_usizevec3().to_array();
        if size.iter().product::<usize>() > MOST_POINTS {
            return Err(TrainError::unfit(
                &entry.name,
                format!("a scan of at most {MOST_POINTS} voxels of 4 cm"),
                format!("{} x {} x {}", size[0], size[1], size[2]),
                "cut the scan into rooms",
            ));
        }
        let mut building = Building::new(start, size);
        for numbers in entry.numbers.chunks(FRAMES_AT_ONCE) {
            let mut views = Vec::new();
            for &number in numbers {
                views.extend(self.depth_view(entry, scan, number)?);
            }
            building.add(&views);
        }
        Ok(building.finish())
    }

    fn depth_view(
        &self,
        entry: &ScanEntry,
        scan: &Scan,
        number: usize,
    ) -> Result<Option<DepthView>, TrainError> {
        let image = scan.depth(number).map_err(|error| TrainError::Picture {
            scan: entry.name.clone(),
            error,
        })?;
        let frame = &scan.frames()[number];
        Ok(image.map(|mut image| {
            for depth in &mut image.depth_m {
                if *depth > self.max_depth_m {
                    *depth = 0.0;
                }
            }
            DepthView {
                camera: pinhole(&frame.depth_camera),
                world_from_camera: single(&frame.pose),
                depth_m: image.depth_m,
            }
        }))
    }
}

/// What `place` holds; if that is nothing yet, what the file holds; else what `make` gives, which is written to both.
fn kept<T>(
    place: &Mutex<Option<Arc<T>>>,
    file: Option<PathBuf>,
    read: impl Fn(&Path) -> Option<T>,
    write: impl Fn(&T, &Path) -> std::io::Result<()>,
    make: impl FnOnce() -> Result<T, TrainError>,
) -> Result<Arc<T>, TrainError> {
    let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = place.as_ref() {
        return Ok(found.clone());
    }
    let found = match file.as_deref().and_then(read) {
        Some(found) => found,
        None => {
            let made = make()?;
            if let Some(file) = &file {
                write(&made, file).map_err(|error| TrainError::file("write", file, error))?;
            }
            made
        }
    };
    let found = Arc::new(found);
    *place = Some(found.clone());
    Ok(found)
}

/// The camera's place and every eighth measured point of every eighth row, in the world.
fn corners(view: &DepthView) -> Vec<Vec3> {
    const APART: usize = 8;
    let width = view.camera.width as usize;
    let mut points = vec![Vec3::from(view.world_from_camera.translation)];
    for v in (0..view.camera.height as usize).step_by(APART) {
        for u in (0..width).step_by(APART) {
            let depth = view.depth_m[u + width * v];
            if depth > 0.0 {
                let ray = view.camera.ray(Vec2::new(u as f32, v as f32));
                points.push(view.world_from_camera.transform_point3(ray * depth));
            }
        }
    }
    points
}

fn entry(name: &str, scan: &Scan, views: usize) -> Result<ScanEntry, TrainError> {
    if !scan.has_depth() {
        return Err(TrainError::unfit(
            name,
            "depth images beside the colour images",
            "none",
            "leave it out: what is true is made of depth",
        ));
    }
    let with_color = scan.frames().iter().enumerate();
    let with_color = with_color.filter(|(_, frame)| frame.color.is_some());
    let (numbers, frames): (Vec<usize>, Vec<Frame>) =
        with_color.map(|(i, frame)| (i, frame.clone())).unzip();
    if frames.len() < views {
        return Err(TrainError::unfit(
            name,
            format!("at least {views} frames with colour, as data.views asks"),
            frames.len(),
            "lower data.views, or leave the scan out",
        ));
    }
    Ok(ScanEntry {
        name: name.to_owned(),
        keyframes: scan::keyframes(&frames, KeyframeRule::default()),
        frames,
        numbers,
        truth: Mutex::new(None),
        guide: Mutex::new(None),
    })
}

fn open_path(path: &Path) -> Result<Scan, TrainError> {
    let failed = |error: ScanError| TrainError::Scan {
        scan: path.display().to_string(),
        error,
    };
    let source = |error: scan::SourceError| {
        TrainError::unfit(path.display(), "a scan", error, "check the path")
    };
    if path.is_file() {
        let file = std::fs::File::open(path).map_err(|e| TrainError::file("read", path, e))?;
        return scan::open(Rc::new(ZipSource::open(file).map_err(source)?)).map_err(failed);
    }
    scan::open(Rc::new(FolderSource::open(path).map_err(source)?)).map_err(failed)
}

/// The scans that a path names: `FOLDER/*` all folders and zips in it that are not hidden, in the order of their names;
/// `FILE.txt` one on each of its lines, from where the file lies, but for empty lines and those that begin with `#`;
/// anything else itself.
///
/// # Errors
/// A folder or a list that cannot be read, or that holds none.
pub fn scans_at(path: &Path) -> Result<Vec<PathBuf>, TrainError> {
    if path.extension().is_some_and(|ending| ending == "txt") {
        return listed(path);
    }
    if path.file_name().is_none_or(|name| name != "*") {
        return Ok(vec![path.to_owned()]);
    }
    let parent = path.parent().unwrap_or(Path::new("."));
    let listing = std::fs::read_dir(parent).map_err(|e| TrainError::file("read", parent, e))?;
    let mut found: Vec<PathBuf> = listing
        .filter_map(|item| Some(item.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().map(|name| name.to_string_lossy());
            let hidden = name.is_none_or(|name| name.starts_with('.'));
            let zip = path.extension().is_some_and(|ending| ending == "zip");
            !hidden && (path.is_dir() || zip)
        })
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(TrainError::unfit(
            path.display(),
            "folders of scans",
            "none",
            "make rooms with `ipdrecon synth`, or name another folder",
        ));
    }
    Ok(found)
}

fn listed(path: &Path) -> Result<Vec<PathBuf>, TrainError> {
    let text = std::fs::read_to_string(path).map_err(|e| TrainError::file("read", path, e))?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let lines = text.lines().map(str::trim);
    let named = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let scans: Vec<PathBuf> = named.map(|line| folder.join(line)).collect();
    if scans.is_empty() {
        return Err(TrainError::unfit(
            path.display(),
            "a scan on each line",
            "none",
            "write folders or zips of scans into it, from where it lies",
        ));
    }
    Ok(scans)
}
