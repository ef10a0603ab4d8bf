//! What a frame shall show: plain data, made of the state, read by the renderer.

use super::photograph_camera::PhotographCamera;
use super::segment::Segment;
use crate::camera::{Bounds, OrbitCamera};
use crate::display::{ClassMask, ColorMode, ColorScheme, Cut, HiddenFlags, Palette, ShareScales};
use glam::{Quat, Vec3};
use semascan_protocol as wire;
use std::sync::Arc;

/// Which graphics interface to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// WebGPU if it passes the self-test, else WebGL2.
    #[default]
    Auto,
    /// WebGPU or an error.
    WebGpu,
    /// WebGL2 or an error.
    WebGl2,
}

impl BackendChoice {
    /// From the page's `renderer` parameter: `webgpu`, `webgl2`; `None` for anything else.
    pub fn from_parameter(value: &str) -> Option<Self> {
        match value {
            "auto" => Some(Self::Auto),
            "webgpu" => Some(Self::WebGpu),
            "webgl2" => Some(Self::WebGl2),
            _ => None,
        }
    }
}

/// The disc that the part stands on: centred on the table frame's z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turntable {
    /// Metres.
    pub radius: f32,
    /// Metres above the table frame's origin.
    pub height: f32,
}

impl Turntable {
    /// From the wire; `None` if the figures make no disc.
    pub fn from_wire(message: &wire::Turntable) -> Option<Self> {
        let (radius, height) = (message.radius as f32, message.height as f32);
        (radius.is_finite() && radius > 0.0 && height.is_finite()).then_some(Self { radius, height })
    }
}

/// A camera pose to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFrustum {
    /// Rotation of `table_from_camera` (camera: x right, y down, z forward).
    pub rotation: Quat,
    /// Translation of `table_from_camera`, metres.
    pub translation: Vec3,
    /// Half the picture's width and height at a distance of one.
    pub half_size: [f32; 2],
    /// The pose of the moment is drawn strongly, earlier ones faintly.
    pub current: bool,
}

impl CameraFrustum {
    /// From a view's pose `table_from_camera` and camera as the agent sent them; `None` if their figures make no camera.
    pub fn from_wire(pose: &wire::Pose, camera: &wire::Intrinsics, current: bool) -> Option<Self> {
        let rotation = Quat::from_xyzw(pose.qx as f32, pose.qy as f32, pose.qz as f32, pose.qw as f32);
        let translation = Vec3::new(pose.tx as f32, pose.ty as f32, pose.tz as f32);
        let half = |size: u32, focal: f64| (f64::from(size) / (2.0 * focal)) as f32;
        let half_size = [half(camera.width, camera.fx), half(camera.height, camera.fy)];
        let valid_pose = rotation.is_finite() && rotation.length_squared() > 0.5 && translation.is_finite();
        let valid_camera = half_size.iter().all(|h| h.is_finite() && *h > 0.0 && *h < 10.0);
        (valid_pose && valid_camera).then(|| Self { rotation: rotation.normalize(), translation, half_size, current })
    }
}

/// A photograph that lies on the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedPhotograph {
    /// The camera that took it.
    pub camera: PhotographCamera,
    /// How strongly it covers the mesh's own colours, 0..=1.
    pub strength: f32,
}

/// One of the photographs that colour the mesh in [`ColorMode::Photo`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotoLayer {
    /// Where the renderer has its pixels.
    pub slot: u32,
    /// The camera that took it.
    pub camera: PhotographCamera,
    /// How good its pixels are against those of others, 0..=1.
    pub quality: f32,
}

/// The section of the model: its outlines, and what they enclose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SectionPicture {
    /// The outlines: before everything where the section is seen from its open side, else as [`FrameContent::marks`].
    pub lines: Vec<Segment>,
    /// What is enclosed: four corners in order around (metres, table frame), each with its distance across the hatching.
    pub cap: Vec<[(Vec3, f32); 4]>,
}

/// What of the state shows in the picture; while it is equal, the picture is, too.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameContent {
    /// What the colours mean.
    pub color_mode: ColorMode,
    /// Component classes that are shown.
    pub visible_classes: ClassMask,
    /// Marked points that are not.
    pub hidden_flags: HiddenFlags,
    /// Colours of the classes.
    pub palette: Palette,
    /// Top of the scale in [`ColorMode::Views`]; at least 1.
    pub views_top: u16,
    /// Scales of [`ColorMode::Confidence`] and [`ColorMode::Sigma`].
    pub scales: ShareScales,
    /// Whether background and furniture are light or dark.
    pub color_scheme: ColorScheme,
    /// The disc; a floor grid where there is none.
    pub turntable: Option<Turntable>,
    /// Camera poses to draw.
    pub frusta: Vec<CameraFrustum>,
    /// Whether the model is drawn as its mesh, not as points.
    pub mesh: bool,
    /// Lines over the model: faint where they lie behind or inside it.
    pub marks: Vec<Segment>,
    /// Largest deviation within tolerance in [`ColorMode::Deviation`], metres.
    pub tolerance: f32,
    /// The photograph on the mesh; its pixels are given to the renderer.
    pub photograph: Option<ProjectedPhotograph>,
    /// The photographs of [`ColorMode::Photo`]; their pixels are given to the renderer.
    pub layers: Vec<PhotoLayer>,
    /// What is cut away.
    pub cut: Cut,
    /// The section of the model by the cut's plane.
    pub section: Option<Arc<SectionPicture>>,
}

impl FrameContent {
    /// The scale of the shares that the colours mean, as shaders take it: its low end, one over its length, and 1 if the
    /// share is known at all, else 0.
    pub fn share_scale(&self) -> [f32; 4] {
        let scale = match self.color_mode {
            ColorMode::Confidence => self.scales.confidence,
            ColorMode::Sigma => self.scales.sigma,
            _ => None,
        };
        scale.map_or([0.0; 4], |s| [s.low, 1.0 / (s.high - s.low), 1.0, 0.0])
    }
}

impl Default for FrameContent {
    fn default() -> Self {
        Self {
            color_mode: ColorMode::default(),
            visible_classes: ClassMask::ALL,
            hidden_flags: HiddenFlags::default(),
            palette: Palette::default(),
            views_top: 1,
            scales: ShareScales::default(),
            color_scheme: ColorScheme::default(),
            turntable: None,
            frusta: Vec::new(),
            mesh: false,
            marks: Vec::new(),
            tolerance: 5e-4,
            photograph: None,
            layers: Vec::new(),
            cut: Cut::default(),
            section: None,
        }
    }
}

/// Everything a frame depends on besides points and mesh.
#[derive(Clone, Debug)]
pub struct DrawRequest {
    /// Where from.
    pub camera: OrbitCamera,
    /// Box around what is looked at (`HeldModel::focus`); sets the floor and the size of the cameras.
    pub focus: Option<Bounds>,
    /// Box around the model (`HeldModel::bounds`), for near and far planes, within reach of `focus`: points that lie far
    /// beyond would cost the depth of all others its resolution.
    pub bounds: Option<Bounds>,
    /// Voxel edge in metres: the points' size.
    pub voxel: f32,
    /// At most about so many points, evenly thinned and enlarged to keep surfaces closed; `None` for all. For slow
    /// machines while the camera moves.
    pub point_budget: Option<usize>,
    /// Whether nothing has moved for a while: the picture may take longer and be finer.
    pub is_still: bool,
    /// What is shown.
    pub content: FrameContent,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::ScalarScale;

    #[test]
    fn a_share_that_nobody_estimated_has_no_scale() {
        let scales = ShareScales {
            confidence: Some(ScalarScale { low: 0.5, high: 1.0, reaches_below: false, reaches_above: false }),
            sigma: None,
        };
        let of = |color_mode| FrameContent { color_mode, scales, ..FrameContent::default() }.share_scale();
        assert_eq!(of(ColorMode::Confidence), [0.5, 2.0, 1.0, 0.0]);
        assert_eq!((of(ColorMode::Sigma)[2], of(ColorMode::Views)[2]), (0.0, 0.0));
    }

    #[test]
    fn cameras_from_hostile_reports_are_not_drawn() {
        let pose = wire::Pose { qw: 1.0, ..wire::Pose::default() };
        let intrinsics = wire::Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 };
        assert!(CameraFrustum::from_wire(&pose, &intrinsics, true).is_some());
        let not_a_number = wire::Pose { tx: f64::NAN, ..pose };
        assert!(CameraFrustum::from_wire(&not_a_number, &intrinsics, true).is_none());
        let no_rotation = wire::Pose { qw: 0.0, ..pose };
        assert!(CameraFrustum::from_wire(&no_rotation, &intrinsics, true).is_none());
        let no_focal_length = wire::Intrinsics { fx: 0.0, ..intrinsics };
        assert!(CameraFrustum::from_wire(&pose, &no_focal_length, true).is_none());
    }
}
