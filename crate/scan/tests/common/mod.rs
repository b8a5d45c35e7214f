//! Small scans made in memory.
#![allow(dead_code, clippy::unwrap_used)] // each test file uses its own part

pub mod room;
pub mod zip;

use std::rc::Rc;

use glam::DAffine3;
use scan::{MemorySource, Scan, ScanError};

/// A PNG of any kind from its raw bytes.
pub fn png(
    width: u32,
    height: u32,
    color: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(bytes).unwrap();
    writer.finish().unwrap();
    file
}

pub fn png_rgb(width: u32, height: u32, rgb: &[u8]) -> Vec<u8> {
    png(
        width,
        height,
        png::ColorType::Rgb,
        png::BitDepth::Eight,
        rgb,
    )
}

pub fn png_u16(width: u32, height: u32, values: &[u16]) -> Vec<u8> {
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_be_bytes())
        .collect();
    png(
        width,
        height,
        png::ColorType::Grayscale,
        png::BitDepth::Sixteen,
        &bytes,
    )
}

/// A picture with detail in it, so that its file has some length.
pub fn texture(width: u32, height: u32) -> Vec<u8> {
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            [
                (x * 7 + y * 3) as u8,
                (x * y) as u8,
                (255 - y * 5 % 256) as u8,
            ]
        })
        .collect()
}

pub fn jpeg(width: u32, height: u32, rgb: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    jpeg_encoder::Encoder::new(&mut file, 90)
        .encode(
            rgb,
            width as u16,
            height as u16,
            jpeg_encoder::ColorType::Rgb,
        )
        .unwrap();
    file
}

/// A row-major 4x4 matrix, as the numbered formats write it.
pub fn pose_text(pose: &DAffine3) -> String {
    let m = pose.matrix3.transpose();
    let t = pose.translation;
    format!(
        "{} {} {} {}\n{} {} {} {}\n{} {} {} {}\n0 0 0 1\n",
        m.x_axis.x,
        m.x_axis.y,
        m.x_axis.z,
        t.x,
        m.y_axis.x,
        m.y_axis.y,
        m.y_axis.z,
        t.y,
        m.z_axis.x,
        m.z_axis.y,
        m.z_axis.z,
        t.z,
    )
}

pub const WIDTH: u32 = 64;
pub const HEIGHT: u32 = 48;
pub const INTRINSICS: &str = "60 0 31.5\n0 60 23.5\n0 0 1\n";

/// Files of a scan, to be changed by a test before it is opened.
pub struct Files(pub Vec<(String, Vec<u8>)>);

impl Files {
    /// `count` frames in the 7-Scenes layout that stand upright (image up is world -y) and move along x.
    pub fn seven_scenes(count: usize) -> Files {
        let mut files = Files(vec![(
            "camera-intrinsics.txt".to_owned(),
            INTRINSICS.as_bytes().to_vec(),
        )]);
        let color = jpeg(WIDTH, HEIGHT, &texture(WIDTH, HEIGHT));
        let depth = flat_depth(WIDTH, HEIGHT, 2000);
        for index in 0..count {
            let stem = format!("frame-{index:06}");
            let pose = DAffine3::from_translation(glam::DVec3::X * 0.2 * index as f64);
            let pose = pose_text(&pose).into_bytes();
            files.0.extend([
                (format!("{stem}.color.jpg"), color.clone()),
                (format!("{stem}.depth.png"), depth.clone()),
                (format!("{stem}.pose.txt"), pose),
            ]);
        }
        files
    }

    /// Adds or replaces a file.
    pub fn set(&mut self, path: &str, content: impl Into<Vec<u8>>) {
        self.remove(path);
        self.0.push((path.to_owned(), content.into()));
    }

    pub fn remove(&mut self, path: &str) {
        self.0.retain(|(other, _)| other != path);
    }

    /// Leaves out all paths that start so.
    pub fn without(mut self, prefix: &str) -> Files {
        self.0.retain(|(path, _)| !path.starts_with(prefix));
        self
    }

    pub fn get(&self, path: &str) -> &[u8] {
        &self.0.iter().find(|(other, _)| other == path).unwrap().1
    }

    /// The same below a folder.
    pub fn under(self, folder: &str) -> Files {
        let moved = |(path, bytes)| (format!("{folder}/{path}"), bytes);
        Files(self.0.into_iter().map(moved).collect())
    }

    pub fn open(self) -> Result<Scan, ScanError> {
        scan::open(Rc::new(MemorySource::new(self.0)))
    }
}

pub fn flat_depth(width: u32, height: u32, value: u16) -> Vec<u8> {
    png_u16(width, height, &vec![value; (width * height) as usize])
}

/// The one finding with a code.
pub fn finding<'s>(scan: &'s Scan, code: &str) -> &'s scan::Finding {
    let mut found = scan
        .findings()
        .iter()
        .filter(|finding| finding.code == code);
    match (found.next(), found.next()) {
        (Some(finding), None) => finding,
        _ => panic!("expected one {code} in {:#?}", scan.findings()),
    }
}

/// Opens a scan that must be refused, and gives the text.
pub fn refused(files: Files) -> (ScanError, String) {
    match files.open() {
        Ok(scan) => panic!("opened with {} frames", scan.frames().len()),
        Err(error) => {
            let text = error.to_string();
            (error, text)
        }
    }
}

/// Every part of a text that a user needs.
pub fn assert_tells(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is not in \"{text}\"");
    }
}

/// `count` frames as ScanNet exports them, in the folder `room`: larger colour, smaller depth, Z up, facing +y.
pub fn scannet(count: usize) -> Files {
    let mut files = Files(Vec::new());
    files.set(
        "room/intrinsic/intrinsic_color.txt",
        "120 0 63.5 0\n0 121 47.5 0\n0 0 1 0\n0 0 0 1\n",
    );
    files.set(
        "room/intrinsic/intrinsic_depth.txt",
        "60 0 31.5 0\n0 61 23.5 0\n0 0 1 0\n0 0 0 1\n",
    );
    for index in 0..count {
        let pose = room::camera_at([0.2 * index as f64, 0.0, 1.5], 90.0, 0.0, 0.0);
        files.set(
            &format!("room/color/{index}.jpg"),
            jpeg(128, 96, &texture(128, 96)),
        );
        files.set(&format!("room/depth/{index}.png"), flat_depth(64, 48, 2500));
        files.set(&format!("room/pose/{index}.txt"), pose_text(&pose));
    }
    files
}

/// `count` frames in the TUM RGB-D layout, 10 a second, in a folder: depth 8 ms after colour, poses every 50 ms on
/// a straight line of 1 m/s along x, facing +y.
pub fn tum(folder: &str, count: usize) -> Files {
    let mut files = Files(Vec::new());
    let [mut rgb, mut depth, mut poses] = ["# list\n"; 3].map(str::to_owned);
    for index in 0..count {
        let time = 100.0 + 0.1 * index as f64;
        let (color, deep) = (format!("{time:.6}"), format!("{:.6}", time + 0.008));
        files.set(
            &format!("{folder}/rgb/{color}.png"),
            png_rgb(64, 48, &texture(64, 48)),
        );
        files.set(
            &format!("{folder}/depth/{deep}.png"),
            flat_depth(64, 48, 10_000),
        );
        rgb += &format!("{color} rgb/{color}.png\n");
        depth += &format!("{deep} depth/{deep}.png\n");
    }
    let turn = glam::DQuat::from_mat3(&room::camera_at([0.0; 3], 90.0, 0.0, 0.0).matrix3);
    for step in 0..=2 * count + 1 {
        let moved = 0.05 * step as f64;
        poses += &format!(
            "{:.4} {moved:.4} 0 1.5 {:.6} {:.6} {:.6} {:.6}\n",
            100.0 + moved,
            turn.x,
            turn.y,
            turn.z,
            turn.w
        );
    }
    files.set(&format!("{folder}/rgb.txt"), rgb);
    files.set(&format!("{folder}/depth.txt"), depth);
    files.set(&format!("{folder}/groundtruth.txt"), poses);
    files
}
