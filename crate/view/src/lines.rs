//! Everything drawn as lines: the floor's grid, the photos' cameras and the path between them.
//!
//! Both painters draw the same list, so it is made once, here, in world space.

use crate::look::Look;
use glam::{Affine3A, Vec2, Vec3};
use mesh::Bounds;
use mesh::camera::Pinhole;

/// A straight line in the world whose colour runs from end to end.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Line {
    pub from_m: [f32; 3],
    /// CSS pixels.
    pub width_px: f32,
    pub to_m: [f32; 3],
    /// sRGB and opacity.
    pub from_rgba: [u8; 4],
    pub to_rgba: [u8; 4],
}

/// Where a photo was taken and with which lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Camera (OpenCV axes, metres) to world.
    pub world_from_camera: Affine3A,
    /// Its lens and size.
    pub pinhole: Pinhole,
}

/// The cameras of a scan, in the order of capture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frusta {
    poses: Vec<CameraPose>,
    highlight: Option<usize>,
}

/// How far in front of the eye a frustum's picture is drawn.
const FRUSTUM_DEPTH_M: f32 = 0.12;
const HIGHLIGHT_DEPTH_M: f32 = 0.3;
/// The grid lies this far under the floor, so that the scanned floor hides it.
const GRID_DROP_M: f32 = 0.04;
const GRID_OPACITY: f32 = 0.42;

impl Frusta {
    /// Shows these cameras instead; none is highlighted.
    pub fn set(&mut self, poses: &[CameraPose]) {
        self.poses = poses.to_vec();
        self.highlight = None;
    }

    /// Marks one camera; out of range marks none.
    pub fn highlight(&mut self, index: Option<usize>) {
        self.highlight = index;
    }

    /// The cameras shown.
    pub fn poses(&self) -> &[CameraPose] {
        &self.poses
    }

    fn lines(&self, look: &Look, lines: &mut Vec<Line>) {
        let camera = with_alpha(look.theme.camera, 0.9);
        let path = with_alpha(look.theme.camera, 0.55);
        for (index, pose) in self.poses.iter().enumerate() {
            if self.highlight == Some(index) {
                let marked = with_alpha(look.theme.highlight, 1.0);
                frustum(pose, HIGHLIGHT_DEPTH_M, 2.5, marked, lines);
            } else {
                frustum(pose, FRUSTUM_DEPTH_M, 1.0, camera, lines);
            }
        }
        let eye = |pose: &CameraPose| pose.world_from_camera.translation.to_array();
        lines.extend(self.poses.windows(2).map(|pair| Line {
            from_m: eye(&pair[0]),
            width_px: 1.5,
            to_m: eye(&pair[1]),
            from_rgba: path,
            to_rgba: path,
        }));
    }
}

/// All lines of a picture.
pub(crate) fn of_scene(bounds: Option<Bounds>, frusta: &Frusta, look: &Look) -> Vec<Line> {
    let mut lines = Vec::new();
    if look.show_grid {
        grid(bounds, look, &mut lines);
    }
    if look.show_frusta {
        frusta.lines(look, &mut lines);
    }
    lines
}

/// The pyramid from the eye to the photo's corners, and the photo's frame with a mark at its top.
fn frustum(pose: &CameraPose, depth_m: f32, width_px: f32, rgba: [u8; 4], lines: &mut Vec<Line>) {
    let lens = &pose.pinhole;
    let (right, bottom) = (lens.width as f32 - 0.5, lens.height as f32 - 0.5);
    let world = |x: f32, y: f32| {
        let at_depth = lens.ray(Vec2::new(x, y)) * depth_m;
        pose.world_from_camera.transform_point3(at_depth)
    };
    let corners = [
        world(-0.5, -0.5),
        world(right, -0.5),
        world(right, bottom),
        world(-0.5, bottom),
    ];
    let eye = Vec3::from(pose.world_from_camera.translation);
    let tip = world(right * 0.5, -0.2 * bottom);
    let mut draw = |from: Vec3, to: Vec3| {
        lines.push(Line {
            from_m: from.to_array(),
            width_px,
            to_m: to.to_array(),
            from_rgba: rgba,
            to_rgba: rgba,
        });
    };
    for i in 0..4 {
        draw(eye, corners[i]);
        draw(corners[i], corners[(i + 1) % 4]);
    }
    draw(corners[0], tip);
    draw(tip, corners[1]);
}

/// Lines at whole metres around the scene, fading out in a circle.
fn grid(bounds: Option<Bounds>, look: &Look, lines: &mut Vec<Line>) {
    let (center, reach_m) = bounds.map_or((Vec2::ZERO, 0.0), |b| {
        (
            b.center().truncate().round(),
            b.size().truncate().max_element(),
        )
    });
    let radius = (reach_m * 0.5 + 4.0).clamp(6.0, 30.0).ceil();
    let count = radius as i32;
    let height_m = look.floor_height_m - GRID_DROP_M;
    let point = |along: f32, aside: f32, swap: bool| {
        let offset = if swap {
            Vec2::new(aside, along)
        } else {
            Vec2::new(along, aside)
        };
        let rest = ((offset.length() / radius - 0.3) / 0.7).clamp(0.0, 1.0);
        let fade = 1.0 - rest * rest * (3.0 - 2.0 * rest);
        let rgba = with_alpha(look.theme.grid, GRID_OPACITY * fade);
        ((center + offset).extend(height_m).to_array(), rgba)
    };
    for swap in [false, true] {
        for aside in -count..=count {
            // Two metres a piece: short enough for the fade to look round.
            for along in (-count..count).step_by(2) {
                let (from_m, from_rgba) = point(along as f32, aside as f32, swap);
                let end = (along + 2).min(count) as f32;
                let (to_m, to_rgba) = point(end, aside as f32, swap);
                if from_rgba[3] != 0 || to_rgba[3] != 0 {
                    lines.push(Line {
                        from_m,
                        width_px: 1.0,
                        to_m,
                        from_rgba,
                        to_rgba,
                    });
                }
            }
        }
    }
}

fn with_alpha([r, g, b]: [u8; 3], alpha: f32) -> [u8; 4] {
    [r, g, b, (alpha * 255.0).round() as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Pinhole = Pinhole {
        width: 4,
        height: 2,
        fx: 2.0,
        fy: 2.0,
        cx: 1.5,
        cy: 0.5,
    };

    fn at(x: f32) -> CameraPose {
        CameraPose {
            world_from_camera: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
            pinhole: LENS,
        }
    }

    #[test]
    fn a_frustum_spans_the_photo() {
        let mut lines = Vec::new();
        frustum(&at(0.0), 0.5, 1.0, [0; 4], &mut lines);
        // The pixel edges -0.5 and 3.5 are 2 px from the middle: tangent 1 across, 0.5 down.
        let corner = [0.5, 0.25, 0.5];
        assert!(lines.iter().any(|line| line.to_m == corner), "{lines:?}");
        assert!(lines.iter().any(|line| line.from_m == [0.0; 3]));
        assert_eq!(lines.len(), 10);
    }

    #[test]
    fn switches_and_the_highlight_do_what_they_say() {
        let mut frusta = Frusta::default();
        frusta.set(&[at(0.0), at(1.0), at(2.0)]);
        let mut look = Look {
            show_grid: false,
            show_frusta: true,
            ..Look::default()
        };
        let plain = of_scene(None, &frusta, &look);
        assert_eq!(
            plain.len(),
            3 * 10 + 2,
            "three frusta and two steps of path"
        );

        frusta.highlight(Some(1));
        let marked = of_scene(None, &frusta, &look);
        let [r, g, b] = look.theme.highlight;
        let hot = |line: &&Line| line.from_rgba == [r, g, b, 255];
        assert_eq!(marked.iter().filter(hot).count(), 10);

        look.show_frusta = false;
        assert!(of_scene(None, &frusta, &look).is_empty());
    }

    #[test]
    fn the_grid_lies_under_the_floor_and_fades_to_nothing() {
        let look = Look {
            floor_height_m: 1.0,
            ..Look::default()
        };
        let bounds = Bounds {
            min: Vec3::new(10.0, -2.0, 0.9),
            max: Vec3::new(14.0, 2.0, 3.0),
        };
        let lines = of_scene(Some(bounds), &Frusta::default(), &look);
        let ends = lines
            .iter()
            .flat_map(|l| [(l.from_m, l.from_rgba), (l.to_m, l.to_rgba)]);
        let mut strongest = 0;
        for (p, rgba) in ends {
            assert_eq!(p[2], 0.96);
            assert_eq!([p[0].fract(), p[1].fract()], [0.0, 0.0]);
            let from_center = Vec2::new(p[0] - 12.0, p[1]).length();
            assert!(from_center < 6.0 || rgba[3] == 0, "{from_center} {rgba:?}");
            strongest = strongest.max(rgba[3]);
        }
        assert_eq!(strongest, 107);
    }
}
