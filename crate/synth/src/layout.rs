//! A scan's files by name and text, in the layouts of the public data sets.

use glam::{Mat3, Quat, Vec3};

use crate::path::View;

/// How a scan is written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// 7-Scenes, with depth registered to colour and `camera-intrinsics.txt`. The world is the first camera's.
    SevenScenes,
    /// ScanNet as its exporter writes it, colour as PNG. The world is the room's, Z up.
    ScanNet,
    /// TUM RGB-D with `camera-intrinsics.txt`. The world is the room's, Z up.
    Tum,
}

/// What a file holds.
#[derive(Clone, Debug)]
pub(crate) enum Content {
    Text(String),
    /// Colour of a frame.
    Color(usize),
    /// Depth of a frame.
    Depth(usize),
}

/// Seconds between two frames.
const FRAME_S: f64 = 0.5;

impl Layout {
    /// Stored depth units in a metre.
    pub(crate) fn depth_units_per_m(self) -> f32 {
        match self {
            Layout::SevenScenes | Layout::ScanNet => 1000.0,
            Layout::Tum => 5000.0,
        }
    }

    /// Rotation and translation that bring the room's coordinates into the world of the files.
    pub(crate) fn world_from_room(self, views: &[View]) -> (Mat3, Vec3) {
        match (self, views.first()) {
            (Layout::SevenScenes, Some(first)) => {
                let turn = first.rotation.transpose();
                (turn, -(turn * first.position_m))
            }
            _ => (Mat3::IDENTITY, Vec3::ZERO),
        }
    }

    /// Every file of the scan.
    pub(crate) fn files(self, views: &[View]) -> Vec<(String, Content)> {
        let (turn, shift) = self.world_from_room(views);
        let poses: Vec<_> = views
            .iter()
            .map(|view| (turn * view.rotation, turn * view.position_m + shift))
            .collect();
        match self {
            Layout::SevenScenes => seven_scenes(views, &poses),
            Layout::ScanNet => scannet(views, &poses),
            Layout::Tum => tum(views, &poses),
        }
    }
}

type Pose = (Mat3, Vec3);
type Files = Vec<(String, Content)>;

fn seven_scenes(views: &[View], poses: &[Pose]) -> Files {
    let mut files = Files::new();
    if let Some(view) = views.first() {
        files.push((
            "camera-intrinsics.txt".into(),
            Content::Text(intrinsics(view, 3)),
        ));
    }
    for (i, pose) in poses.iter().enumerate() {
        let stem = format!("frame-{i:06}");
        files.push((format!("{stem}.color.png"), Content::Color(i)));
        files.push((format!("{stem}.depth.png"), Content::Depth(i)));
        files.push((format!("{stem}.pose.txt"), Content::Text(matrix(pose))));
    }
    files
}

/// The 7-Scenes layout in the room's own world, Z up.
pub(crate) fn seven_scenes_upright(views: &[View]) -> Vec<(String, Content)> {
    let poses: Vec<_> = views
        .iter()
        .map(|view| (view.rotation, view.position_m))
        .collect();
    seven_scenes(views, &poses)
}

fn scannet(views: &[View], poses: &[Pose]) -> Files {
    let mut files = Files::new();
    if let Some(view) = views.first() {
        for camera in ["color", "depth"] {
            let path = format!("intrinsic/intrinsic_{camera}.txt");
            files.push((path, Content::Text(intrinsics(view, 4))));
        }
    }
    for (i, pose) in poses.iter().enumerate() {
        files.push((format!("color/{i}.png"), Content::Color(i)));
        files.push((format!("depth/{i}.png"), Content::Depth(i)));
        files.push((format!("pose/{i}.txt"), Content::Text(matrix(pose))));
    }
    files
}

fn tum(views: &[View], poses: &[Pose]) -> Files {
    let mut files = Files::new();
    if let Some(view) = views.first() {
        files.push((
            "camera-intrinsics.txt".into(),
            Content::Text(intrinsics(view, 3)),
        ));
    }
    let mut lists = [
        String::from("# timestamp filename\n"),
        String::from("# timestamp filename\n"),
        String::from("# timestamp tx ty tz qx qy qz qw\n"),
    ];
    for (i, (rotation, position)) in poses.iter().enumerate() {
        let time = format!("{:.6}", FRAME_S * i as f64);
        let [color, depth] = ["rgb", "depth"].map(|folder| format!("{folder}/{time}.png"));
        lists[0] += &format!("{time} {color}\n");
        lists[1] += &format!("{time} {depth}\n");
        let q = Quat::from_mat3(rotation);
        let p = position;
        lists[2] += &format!(
            "{time} {:.8} {:.8} {:.8} {:.8} {:.8} {:.8} {:.8}\n",
            p.x, p.y, p.z, q.x, q.y, q.z, q.w
        );
        files.push((color, Content::Color(i)));
        files.push((depth, Content::Depth(i)));
    }
    for (name, text) in ["rgb.txt", "depth.txt", "groundtruth.txt"]
        .into_iter()
        .zip(lists)
    {
        files.push((name.into(), Content::Text(text)));
    }
    files
}

/// A calibration matrix of `size` rows and columns.
fn intrinsics(view: &View, size: usize) -> String {
    let c = &view.camera;
    let known = [[c.fx, 0.0, c.cx], [0.0, c.fy, c.cy]];
    rows((0..size).map(|row| {
        (0..size)
            .map(
                |column| match known.get(row).and_then(|values| values.get(column)) {
                    Some(value) => *value,
                    None => f64::from(u8::from(row == column)),
                },
            )
            .collect()
    }))
}

/// A camera-to-world matrix of 4 rows and columns.
fn matrix((rotation, position): &Pose) -> String {
    rows((0..4).map(|row| match row {
        3 => vec![0.0, 0.0, 0.0, 1.0],
        _ => {
            let r = rotation.row(row);
            [r.x, r.y, r.z, position[row]].map(f64::from).to_vec()
        }
    }))
}

fn rows(values: impl Iterator<Item = Vec<f64>>) -> String {
    values
        .map(|row| {
            row.iter()
                .map(|v| format!("{v:.8}"))
                .collect::<Vec<_>>()
                .join(" ")
                + "\n"
        })
        .collect()
}
