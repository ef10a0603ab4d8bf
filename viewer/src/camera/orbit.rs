//! The orbit camera: looks at a target, z stays up, moves only when asked (no inertia, so a still model costs nothing).
//!
//! Frames: the world is the table frame (z up, metres). The camera's view frame is OpenGL's (x right, y up, looking
//! along -z); clip depth is 0..1 as in WebGPU.

use super::{Bounds, CameraInput, StandardView};
use glam::camera::rh::{proj, view};
use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Closest and farthest the eye may be from the target, metres.
const DISTANCE: std::ops::RangeInclusive<f32> = 0.005..=50.0;

/// Just short of straight up or down, where azimuth would lose its meaning.
const MAX_ELEVATION: f32 = FRAC_PI_2 - 1e-3;

/// Vertical field of view: 35 degrees, narrow enough that lengths near and far compare.
const FOV_Y: f32 = 35.0 * PI / 180.0;

/// What is fitted into view leaves this much room around it.
const MARGIN: f32 = 1.08;
/// Radius of the smallest thing that fills the view, metres.
const SMALLEST: f32 = 0.002;

/// A perspective camera that orbits a target with z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitCamera {
    target: Vec3,
    distance: f32,
    azimuth: f32,
    elevation: f32,
    viewport: Vec2,
    /// Height of what lies over the upper edge of the viewport, CSS pixels.
    covered: f32,
}

impl Default for OrbitCamera {
    fn default() -> Self {
        let mut camera = Self {
            target: Vec3::new(0.0, 0.0, 0.05),
            distance: 0.6,
            azimuth: 0.0,
            elevation: 0.0,
            viewport: Vec2::new(1280.0, 720.0),
            covered: 0.0,
        };
        camera.look_from(StandardView::Isometric);
        camera
    }
}

impl OrbitCamera {
    /// Sets the size of the viewport in CSS pixels.
    pub fn set_viewport(&mut self, width: f32, height: f32) {
        self.viewport = Vec2::new(width.max(1.0), height.max(1.0));
    }

    /// Says how much of the viewport's height, in CSS pixels from its upper edge, is covered by something: what is fitted
    /// into view stays out of it.
    pub fn set_covered(&mut self, height: f32) {
        self.covered = if height.is_finite() { height.clamp(0.0, self.viewport.y / 2.0) } else { 0.0 };
    }

    /// Follows an input; `bounds` is the box around the model (see `HeldModel::focus`), for [`CameraInput::Fit`].
    pub fn apply(&mut self, input: CameraInput, bounds: Option<Bounds>) {
        match input {
            CameraInput::Orbit { pixels } => self.orbit(pixels),
            CameraInput::Pan { pixels } => self.pan(pixels),
            CameraInput::Zoom { factor, at } => self.zoom(factor, at),
            CameraInput::Fit => self.fit(bounds.unwrap_or(Bounds::EMPTY)),
            CameraInput::View(view) => {
                self.look_from(view);
                self.fit(bounds.unwrap_or(Bounds::EMPTY));
            }
            CameraInput::From { eye, target } => self.look_at(eye, target),
        }
    }

    /// Turns about the target: a drag over the viewport's height is half a turn.
    pub fn orbit(&mut self, pixels: Vec2) {
        let angle = pixels / self.viewport.y * PI;
        if angle.is_finite() {
            self.azimuth = (self.azimuth - angle.x).rem_euclid(TAU);
            self.elevation = (self.elevation + angle.y).clamp(-MAX_ELEVATION, MAX_ELEVATION);
        }
    }

    /// Moves sideways so that the point at the target's depth follows the pointer.
    pub fn pan(&mut self, pixels: Vec2) {
        let step = pixels * self.metres_per_pixel(self.distance);
        if step.is_finite() {
            let (right, up) = self.right_and_up();
            self.target += up * step.y - right * step.x;
        }
    }

    /// Multiplies the distance; the point at the target's depth under `at` (CSS pixels) stays under it.
    pub fn zoom(&mut self, factor: f32, at: Option<Vec2>) {
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let before = self.distance;
        self.distance = (self.distance * factor).clamp(*DISTANCE.start(), *DISTANCE.end());
        if let Some(at) = at.filter(|at| at.is_finite()) {
            let offset = at - self.viewport / 2.0;
            let (right, up) = self.right_and_up();
            let slip = self.metres_per_pixel(before) - self.metres_per_pixel(self.distance);
            self.target += (right * offset.x - up * offset.y) * slip;
        }
    }

    /// Shows the whole box from the present direction, as large as the viewport allows; an empty box changes nothing.
    pub fn fit(&mut self, bounds: Bounds) {
        let (center, radius) = (bounds.center(), bounds.radius());
        if bounds.is_empty() || !(center.is_finite() && radius.is_finite()) {
            return;
        }
        if radius < SMALLEST {
            return self.frame(center, radius);
        }
        let (forward, (right, up)) = (self.forward(), self.right_and_up());
        let tangent = (FOV_Y / 2.0).tan() / MARGIN;
        let aside = tangent * self.viewport.x / self.viewport.y;
        let above = tangent * (1.0 - 2.0 * self.covered / self.viewport.y).max(0.1);
        // A corner at (x, z), z along the direction of view, is inside the edges of the picture of a camera at (s, -d) if
        // x - s <= (z + d) t and s - x <= (z + d) t', where t and t' are the tangents of the edges. So d + s / t and
        // d - s / t' are at least what the most demanding corner on either side asks for.
        let demand = |axis: Vec3, edge: f32| {
            let of = |p: Vec3| (p - center).dot(axis) / edge - (p - center).dot(forward);
            bounds.corners().map(of).fold(f32::NEG_INFINITY, f32::max)
        };
        let (east, west) = (demand(right, aside), demand(-right, aside));
        let (north, south) = (demand(up, above), demand(-up, tangent));
        let across = (east + west) / 2.0;
        let along = (north * above + south * tangent) / (above + tangent);
        let distance = across.max(along);
        // In the middle of the room that there is.
        let middle = |low: f32, high: f32| (low + high) / 2.0;
        let shift_x = middle((east - distance) * aside, (distance - west) * aside);
        let shift_y = middle((north - distance) * above, (distance - south) * tangent);
        self.target = center + right * shift_x + up * shift_y;
        self.distance = distance.clamp(*DISTANCE.start(), *DISTANCE.end());
    }

    /// Shows a sphere (`center` and `radius` in metres, table frame) from the present direction.
    pub fn frame(&mut self, center: Vec3, radius: f32) {
        if !(center.is_finite() && radius.is_finite()) {
            return;
        }
        let aspect = self.viewport.x / self.viewport.y;
        let half = (FOV_Y / 2.0).min(((FOV_Y / 2.0).tan() * aspect).atan());
        self.target = center;
        self.distance = (radius.max(SMALLEST) * MARGIN / half.sin()).clamp(*DISTANCE.start(), *DISTANCE.end());
    }

    /// Looks from a standard direction at the same target.
    pub fn look_from(&mut self, view: StandardView) {
        (self.azimuth, self.elevation) = match view {
            StandardView::Isometric => (-FRAC_PI_4, 30_f32.to_radians()),
            StandardView::Front => (-FRAC_PI_2, 0.0),
            StandardView::Back => (FRAC_PI_2, 0.0),
            StandardView::Left => (PI, 0.0),
            StandardView::Right => (0.0, 0.0),
            StandardView::Top => (-FRAC_PI_2, MAX_ELEVATION),
            StandardView::Bottom => (-FRAC_PI_2, -MAX_ELEVATION),
        };
        self.azimuth = self.azimuth.rem_euclid(TAU);
    }

    /// Looks from `eye` at `target` (metres, table frame); z stays up. Places that are one, or none, change nothing.
    pub fn look_at(&mut self, eye: Vec3, target: Vec3) {
        let back = eye - target;
        let (distance, Some(direction)) = (back.length(), back.try_normalize()) else { return };
        if !target.is_finite() {
            return;
        }
        self.target = target;
        self.distance = distance.clamp(*DISTANCE.start(), *DISTANCE.end());
        self.azimuth = direction.y.atan2(direction.x).rem_euclid(TAU);
        self.elevation = direction.z.clamp(-1.0, 1.0).asin().clamp(-MAX_ELEVATION, MAX_ELEVATION);
    }

    /// The point it looks at, metres, table frame.
    pub fn target(&self) -> Vec3 {
        self.target
    }

    /// From the eye to the target, metres.
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// Where the eye is, metres, table frame.
    pub fn eye(&self) -> Vec3 {
        self.target - self.forward() * self.distance
    }

    /// Unit vector of the direction it looks in.
    pub fn forward(&self) -> Vec3 {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        -Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e)
    }

    /// Transform from the table frame to the view frame (x right, y up, looking along -z).
    pub fn view_from_table(&self) -> Mat4 {
        view::look_to_mat4(self.eye(), self.forward(), Vec3::Z)
    }

    /// Perspective projection of the view frame to clip space, depth 0..1.
    pub fn clip_from_view(&self, near: f32, far: f32) -> Mat4 {
        proj::directx::perspective(FOV_Y, self.viewport.x / self.viewport.y, near, far)
    }

    /// Near and far planes (metres from the eye) that hold `scene` entirely, as tight as depth precision likes.
    pub fn near_far(&self, scene: Bounds) -> (f32, f32) {
        let radius = scene.radius().max(0.01);
        let middle = (scene.center() - self.eye()).dot(self.forward());
        let far = (middle + radius * 1.05).max(self.distance * 0.02 + 0.001);
        let near = (middle - radius * 1.05).max(far * 2e-3);
        (near, far.max(near * 1.01))
    }

    /// Where a point of the table frame (metres) appears: CSS pixels from the viewport's top left corner, and its distance
    /// along the direction of view in metres; `None` behind the eye.
    pub fn project(&self, point: Vec3) -> Option<(Vec2, f32)> {
        let from_eye = point - self.eye();
        let distance = from_eye.dot(self.forward());
        if !(distance.is_finite() && distance > 1e-6) {
            return None;
        }
        let (right, up) = self.right_and_up();
        let aside = Vec2::new(from_eye.dot(right), -from_eye.dot(up)) * self.pixels_per_metre(distance);
        Some((self.viewport / 2.0 + aside, distance))
    }

    /// The point of the table frame (metres) that appears at `at` (CSS pixels from the viewport's top left corner) at a
    /// distance of so many metres along the direction of view: the inverse of [`OrbitCamera::project`].
    pub fn unproject(&self, at: Vec2, distance: f32) -> Vec3 {
        let (right, up) = self.right_and_up();
        let aside = (at - self.viewport / 2.0) * self.metres_per_pixel(distance);
        self.eye() + self.forward() * distance + right * aside.x - up * aside.y
    }

    /// What is at `at` (CSS pixels from the viewport's top left corner): the way from the eye to there at a distance of one metre
    /// along the direction of view, metres, table frame.
    pub fn toward(&self, at: Vec2) -> Vec3 {
        self.unproject(at, 1.0) - self.eye()
    }

    /// Size of the viewport in CSS pixels.
    pub fn viewport(&self) -> Vec2 {
        self.viewport
    }

    /// CSS pixels that one metre at `depth` metres from the eye covers.
    pub fn pixels_per_metre(&self, depth: f32) -> f32 {
        1.0 / self.metres_per_pixel(depth)
    }

    fn metres_per_pixel(&self, depth: f32) -> f32 {
        2.0 * (FOV_Y / 2.0).tan() * depth / self.viewport.y
    }

    fn right_and_up(&self) -> (Vec3, Vec3) {
        let right = self.forward().cross(Vec3::Z).normalize();
        (right, right.cross(self.forward()))
    }
}

#[cfg(test)]
mod tests;
