//! What the visitor's hands do to the camera: orbit, pan, zoom, fly, touch and keys.
//!
//! Pure state: the page forwards pointer and key events as [`Input`], the frame loop calls
//! [`Controls::tick`], and drawing is needed exactly while that says so. Input moves a goal and
//! the shown camera eases after it, or jumps where the visitor asked for reduced motion.

use crate::camera::nearest_turn;
use crate::{Input, OrbitCamera, PointerKind, Viewport};
use glam::{Affine3A, Vec2, Vec3};
use mesh::camera::Pinhole;
use std::collections::BTreeSet;
use std::f32::consts::{FRAC_PI_2, PI};

/// Time in which the shown camera covers 63 % of the way to its goal.
const EASE_S: f32 = 0.06;
/// Nearest the eye gets to the pivot; zooming on from there pushes the pivot ahead.
const MIN_DISTANCE_M: f32 = 0.3;
const MAX_DISTANCE_M: f32 = 300.0;
const KEY_TURN_RAD_PER_S: f32 = 1.4;
const KEY_ZOOM_PER_S: f32 = 1.5;
const KEY_PAN_HEIGHTS_PER_S: f32 = 0.6;
/// One notch of a mouse wheel is 100 px in every browser: 1.16 times nearer or farther.
const WHEEL_ZOOM_PER_PX: f32 = 0.0015;

#[derive(Clone, Copy, Debug)]
struct Pointer {
    id: i32,
    at: Vec2,
    pans: bool,
}

/// The camera and the state of the hands on it.
#[derive(Clone, Debug)]
pub struct Controls {
    shown: OrbitCamera,
    goal: OrbitCamera,
    viewport: Viewport,
    pointers: Vec<Pointer>,
    held: BTreeSet<String>,
    outline_m: Vec<Vec3>,
    photo: Option<(Affine3A, Pinhole)>,
    reduced_motion: bool,
    untouched: bool,
    redraw: bool,
}

impl Default for Controls {
    fn default() -> Self {
        Self {
            shown: OrbitCamera::default(),
            goal: OrbitCamera::default(),
            viewport: Viewport {
                width_px: 640,
                height_px: 480,
                scale: 1.0,
            },
            pointers: Vec::new(),
            held: BTreeSet::new(),
            outline_m: Vec::new(),
            photo: None,
            reduced_motion: false,
            untouched: true,
            redraw: true,
        }
    }
}

impl Controls {
    /// The camera to draw with now.
    pub fn camera(&self) -> &OrbitCamera {
        &self.shown
    }

    /// The canvas.
    pub fn viewport(&self) -> Viewport {
        self.viewport
    }

    /// Jump instead of easing (`prefers-reduced-motion`).
    pub fn set_reduced_motion(&mut self, reduced: bool) {
        self.reduced_motion = reduced;
    }

    /// Tells where the surface is, by points around it. Until the visitor first moves the camera it follows the
    /// growing mesh; after that only [`Controls::home`] and [`Controls::fit`] use it.
    pub fn set_outline(&mut self, points_m: Vec<Vec3>) {
        self.outline_m = points_m;
        if self.untouched {
            self.goal.fit(&self.outline_m, self.viewport.aspect());
        }
    }

    /// Frames everything from the present heading.
    pub fn fit(&mut self) {
        self.photo = None;
        self.goal.fit(&self.outline_m, self.viewport.aspect());
    }

    /// Frames everything from the first view's heading, and follows the growing mesh again.
    pub fn home(&mut self) {
        self.goal.face_home();
        self.fit();
        self.untouched = true;
    }

    /// Frames everything from straight above: the floor plan.
    pub fn top(&mut self) {
        self.goal.pitch_rad = -FRAC_PI_2;
        self.fit();
        self.untouched = false;
    }

    /// Makes `point_m` the pivot and comes closer: a double click on the surface, picked by the
    /// painter.
    pub fn focus(&mut self, point_m: Vec3) {
        self.take_over();
        let reach_m = self.goal.eye_m().distance(point_m);
        self.goal.pivot_m = point_m;
        self.goal.distance_m = (reach_m * 0.6).max(0.8);
    }

    /// Looks through a captured photo: pose (camera to world, OpenCV axes) and lens.
    pub fn look_through(&mut self, world_from_camera: Affine3A, pinhole: Pinhole) {
        self.take_over();
        self.photo = Some((world_from_camera, pinhole));
        self.aim_at_photo();
    }

    /// Takes one event.
    pub fn input(&mut self, input: Input) {
        match input {
            Input::PointerDown {
                id,
                x,
                y,
                button,
                kind,
                shift,
            } => {
                self.pointers.retain(|pointer| pointer.id != id);
                // A third finger would make the gesture ambiguous.
                if self.pointers.len() < 2 {
                    self.pointers.push(Pointer {
                        id,
                        at: Vec2::new(x, y),
                        pans: kind == PointerKind::Mouse && (button != 0 || shift),
                    });
                }
            }
            Input::PointerMove { id, x, y } => self.drag(id, Vec2::new(x, y)),
            Input::PointerUp { id } => self.pointers.retain(|pointer| pointer.id != id),
            Input::Wheel { dy, x, y } => {
                self.take_over();
                let factor = (dy.clamp(-400.0, 400.0) * WHEEL_ZOOM_PER_PX).exp();
                self.zoom(Vec2::new(x, y), factor);
            }
            Input::Key { code, down: false } => {
                self.held.remove(&code);
            }
            Input::Key { code, down: true } => match code.as_str() {
                "Home" => self.home(),
                "KeyF" => self.fit(),
                _ if is_held_key(&code) => {
                    self.held.insert(code);
                }
                _ => {}
            },
            Input::Resize {
                width_px,
                height_px,
                scale,
            } => self.resize(Viewport {
                width_px,
                height_px,
                scale,
            }),
            Input::Blur => {
                self.pointers.clear();
                self.held.clear();
            }
        }
    }

    /// Lets `dt_s` seconds pass. True while the picture changes: draw, and tick again.
    pub fn tick(&mut self, dt_s: f32) -> bool {
        let dt_s = dt_s.clamp(0.0, 0.1);
        let before = self.shown;
        let keys_move = self.apply_keys(dt_s);
        let share = if self.reduced_motion {
            1.0
        } else {
            1.0 - (-dt_s / EASE_S).exp()
        };
        self.shown = self.shown.toward(&self.goal, share);
        let arrived = self.shown.is_close_to(&self.goal);
        if arrived {
            self.shown = self.goal;
        }
        let asked = std::mem::take(&mut self.redraw);
        asked || keys_move || !arrived || self.shown != before
    }

    fn resize(&mut self, viewport: Viewport) {
        self.viewport = viewport;
        self.redraw = true;
        if self.photo.is_some() {
            self.aim_at_photo();
        } else if self.untouched {
            self.fit();
        }
    }

    fn aim_at_photo(&mut self) {
        let Some((world_from_camera, pinhole)) = &self.photo else {
            return;
        };
        let distance_m = self.goal.distance_m.clamp(0.5, 3.0);
        self.goal = OrbitCamera::looking_through(
            world_from_camera,
            pinhole,
            self.viewport.aspect(),
            distance_m,
        );
        self.goal.yaw_rad = nearest_turn(self.goal.yaw_rad, self.shown.yaw_rad);
    }

    /// From here on the visitor steers: no following, and the horizon goes level again.
    fn take_over(&mut self) {
        self.untouched = false;
        self.photo = None;
        self.goal.roll_rad = 0.0;
    }

    fn drag(&mut self, id: i32, to: Vec2) {
        let Some(index) = self.pointers.iter().position(|pointer| pointer.id == id) else {
            return;
        };
        let from = std::mem::replace(&mut self.pointers[index].at, to);
        if from == to {
            return;
        }
        self.take_over();
        match self.pointers.as_slice() {
            [one] if one.pans => self.pan(to - from),
            [_] if self.is_flying() => self.look_around(to - from),
            [_] => self.orbit(to - from),
            [first, second] => {
                // The middle and the span of the two fingers before and after; the moved
                // finger's partner stands still within one event.
                let other = if index == 0 { second.at } else { first.at };
                let span = |at: Vec2| at.distance(other).max(1.0);
                let zoom = span(from) / span(to);
                self.zoom((from + other) * 0.5, zoom);
                self.pan((to - from) * 0.5);
            }
            _ => {}
        }
    }

    /// Drags the scene's near side along: half a turn per canvas height.
    fn orbit(&mut self, by: Vec2) {
        let angle = -by * (PI / self.viewport.size_px().y);
        self.goal.turn(angle.x, angle.y);
    }

    /// Turns the head about the eye, the picture following the pointer.
    fn look_around(&mut self, by: Vec2) {
        let eye_m = self.goal.eye_m();
        let angle = by * (self.goal.fov_y_rad / self.viewport.size_px().y);
        self.goal.turn(angle.x, angle.y);
        self.goal.pivot_m = eye_m + self.goal.axes().2 * self.goal.distance_m;
    }

    /// Shifts the picture so that points at the pivot's depth follow the pointer.
    fn pan(&mut self, by: Vec2) {
        let (right, up, _) = self.goal.axes();
        let metres_per_px = 2.0 * (self.goal.fov_y_rad * 0.5).tan() * self.goal.distance_m
            / self.viewport.size_px().y;
        self.goal.pivot_m += (up * by.y - right * by.x) * metres_per_px;
    }

    /// Scales the eye's way to the point under `at` by `factor`; what is under `at` stays there.
    fn zoom(&mut self, at: Vec2, factor: f32) {
        let goal = &mut self.goal;
        let tangent = goal.tangent(self.viewport.ndc(at), self.viewport.aspect());
        let (right, up, forward) = goal.axes();
        let ahead = right * tangent.x + up * tangent.y + forward;
        let point_m = goal.eye_m() + ahead * goal.distance_m;
        let wanted_m = goal.distance_m * factor;
        let distance_m = wanted_m.clamp(MIN_DISTANCE_M, MAX_DISTANCE_M);
        goal.pivot_m = point_m + (goal.pivot_m - point_m) * (distance_m / goal.distance_m);
        goal.distance_m = distance_m;
        if wanted_m < distance_m {
            // As near as it gets: walk on instead, so that walls are no dead end.
            goal.pivot_m += ahead * (distance_m - wanted_m);
        }
    }

    fn is_flying(&self) -> bool {
        self.held.iter().any(|code| fly_axis(code).is_some())
    }

    /// Moves the goal by what is held; true if anything is.
    fn apply_keys(&mut self, dt_s: f32) -> bool {
        let shift = self.holds("Shift");
        let fly: Vec3 = self.held.iter().filter_map(|code| fly_axis(code)).sum();
        let turn: Vec2 = self.held.iter().filter_map(|code| turn_axis(code)).sum();
        let zoom: f32 = self.held.iter().filter_map(|code| zoom_axis(code)).sum();
        let moves = fly != Vec3::ZERO || turn != Vec2::ZERO || zoom != 0.0;
        if !moves {
            return false;
        }
        self.take_over();
        let size_px = self.viewport.size_px();
        let (right, up, forward) = self.goal.axes();
        let hurry = if shift { 3.0 } else { 1.0 };
        // A step suits what is looked at: slow among furniture, fast above a flat.
        let speed_m_per_s = (self.goal.distance_m * 0.7).clamp(0.7, 6.0) * hurry;
        self.goal.pivot_m += (right * fly.x + up * fly.y + forward * fly.z).normalize_or_zero()
            * speed_m_per_s
            * dt_s;
        if shift {
            self.pan(turn * KEY_PAN_HEIGHTS_PER_S * size_px.y * dt_s);
        } else {
            let angle = turn * KEY_TURN_RAD_PER_S * dt_s;
            self.goal.turn(-angle.x, -angle.y);
        }
        if zoom != 0.0 {
            self.zoom(size_px * 0.5, (zoom * KEY_ZOOM_PER_S * dt_s).exp());
        }
        true
    }

    fn holds(&self, prefix: &str) -> bool {
        self.held.iter().any(|code| code.starts_with(prefix))
    }
}

/// Right, up, forward.
fn fly_axis(code: &str) -> Option<Vec3> {
    match code {
        "KeyW" => Some(Vec3::Z),
        "KeyS" => Some(-Vec3::Z),
        "KeyD" => Some(Vec3::X),
        "KeyA" => Some(-Vec3::X),
        "KeyE" => Some(Vec3::Y),
        "KeyQ" => Some(-Vec3::Y),
        _ => None,
    }
}

/// The drag an arrow key stands for: right, down.
fn turn_axis(code: &str) -> Option<Vec2> {
    match code {
        "ArrowLeft" => Some(-Vec2::X),
        "ArrowRight" => Some(Vec2::X),
        "ArrowUp" => Some(-Vec2::Y),
        "ArrowDown" => Some(Vec2::Y),
        _ => None,
    }
}

/// Negative comes closer.
fn zoom_axis(code: &str) -> Option<f32> {
    match code {
        "Equal" | "NumpadAdd" | "PageUp" => Some(-1.0),
        "Minus" | "NumpadSubtract" | "PageDown" => Some(1.0),
        _ => None,
    }
}

fn is_held_key(code: &str) -> bool {
    fly_axis(code).is_some()
        || turn_axis(code).is_some()
        || zoom_axis(code).is_some()
        || code.starts_with("Shift")
}

#[cfg(test)]
#[path = "controls_tests.rs"]
mod tests;
