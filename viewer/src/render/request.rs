//! What a frame shall show: plain data, made by the page, read by the renderer.

use crate::tools::{Bounds, OrbitCamera};
use glam::{Quat, Vec3};
use semascan_model::{Color, Taxonomy};
use semascan_protocol as wire;

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

/// Top of the scale in [`ColorMode::Sigma`]; a label is hardly worth having from there on.
pub const SIGMA_TOP: f32 = 0.5;

/// What the points' colour tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMode {
    /// The part as the camera saw it.
    #[default]
    Appearance,
    /// Component classes in their palette.
    Component,
    /// Share of the best component class, 0..=1, by [`super::colormap`].
    Confidence,
    /// Number of views, 0..=`views_top`, by [`super::colormap`].
    Views,
    /// Defect classes in their palette; sound surface is grey.
    Defect,
    /// Uncertainty of the component label (sigma), 0..=[`SIGMA_TOP`], by [`super::colormap`].
    Sigma,
    /// Signed distance of the mesh from a reference, by [`super::deviation`].
    Deviation,
}

/// Page background and furniture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark lines on light ground.
    Light,
    /// Light lines on dark ground.
    #[default]
    Dark,
}

/// A set of classes; those from 255 on are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClassMask([u64; 4]);

impl ClassMask {
    /// Every class.
    pub const ALL: Self = Self([u64::MAX; 4]);
    /// No class.
    pub const NONE: Self = Self([0; 4]);

    /// Whether `class` is in the set.
    pub fn has(&self, class: u16) -> bool {
        let bit = class.min(255);
        self.0[usize::from(bit / 64)] & (1 << (bit % 64)) != 0
    }

    /// Puts `class` in or takes it out.
    pub fn set(&mut self, class: u16, member: bool) {
        let bit = class.min(255);
        let word = &mut self.0[usize::from(bit / 64)];
        if member { *word |= 1 << (bit % 64) } else { *word &= !(1 << (bit % 64)) }
    }
}

/// Which marked points are left out of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HiddenFlags {
    /// Outliers, and points whose class was too uncertain to keep them.
    pub outliers: bool,
    /// What lies outside the measuring volume.
    pub background: bool,
}

impl Default for HiddenFlags {
    fn default() -> Self {
        Self { outliers: true, background: false }
    }
}

impl HiddenFlags {
    /// The bits of `PointFlags` that hide a point.
    pub fn bits(self) -> u16 {
        use semascan_model::PointFlags;
        let outliers = if self.outliers { PointFlags::OUTLIER | PointFlags::UNCERTAIN } else { 0 };
        let background = if self.background { PointFlags::BACKGROUND } else { 0 };
        outliers | background
    }
}

/// sRGB colours of the classes, by class.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Palette {
    /// Component classes.
    pub components: Vec<Color>,
    /// Defect classes.
    pub defects: Vec<Color>,
}

impl Palette {
    /// The colours of a taxonomy.
    pub fn from_taxonomy(taxonomy: &Taxonomy) -> Self {
        let colors = |classes: &[semascan_model::ClassDef]| classes.iter().map(|c| c.color).collect();
        Self { components: colors(&taxonomy.components), defects: colors(&taxonomy.defects) }
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
    /// From a view's report; `None` without a pose or intrinsics, or if their figures make no camera.
    pub fn from_wire(report: &wire::ViewReport, current: bool) -> Option<Self> {
        let (pose, camera) = (report.table_from_camera.as_ref()?, report.intrinsics.as_ref()?);
        let rotation = Quat::from_xyzw(pose.qx as f32, pose.qy as f32, pose.qz as f32, pose.qw as f32);
        let translation = Vec3::new(pose.tx as f32, pose.ty as f32, pose.tz as f32);
        let half = |size: u32, focal: f64| (f64::from(size) / (2.0 * focal)) as f32;
        let half_size = [half(camera.width, camera.fx), half(camera.height, camera.fy)];
        let sound = rotation.is_finite() && rotation.length_squared() > 0.5 && translation.is_finite();
        let open = half_size.iter().all(|h| h.is_finite() && *h > 0.0 && *h < 10.0);
        (sound && open).then(|| Self { rotation: rotation.normalize(), translation, half_size, current })
    }
}

/// Everything a frame depends on besides the points themselves.
#[derive(Clone, Debug)]
pub struct DrawRequest {
    /// Where from.
    pub camera: OrbitCamera,
    /// Box around the model (`LiveModel::bounds`); sets near and far planes and the floor.
    pub bounds: Option<Bounds>,
    /// What the colours tell.
    pub color_mode: ColorMode,
    /// Component classes that are shown.
    pub visible_classes: ClassMask,
    /// Marked points that are not.
    pub hidden_flags: HiddenFlags,
    /// Colours of the classes.
    pub palette: Palette,
    /// Top of the scale in [`ColorMode::Views`]; at least 1.
    pub views_top: u16,
    /// Background and furniture.
    pub theme: Theme,
    /// The disc; a floor grid where there is none.
    pub turntable: Option<Turntable>,
    /// Camera poses to draw.
    pub frusta: Vec<CameraFrustum>,
    /// Whether the model is drawn as its mesh, not as points.
    pub mesh: bool,
    /// Largest deviation within tolerance in [`ColorMode::Deviation`], metres.
    pub tolerance: f32,
    /// Voxel edge in metres: the points' size.
    pub voxel: f32,
    /// At most about so many points, evenly thinned and enlarged to keep surfaces closed; `None` for all. For slow
    /// machines while the camera moves.
    pub point_budget: Option<usize>,
}

impl Default for DrawRequest {
    fn default() -> Self {
        Self {
            camera: OrbitCamera::default(),
            bounds: None,
            color_mode: ColorMode::default(),
            visible_classes: ClassMask::ALL,
            hidden_flags: HiddenFlags::default(),
            palette: Palette::default(),
            views_top: 1,
            theme: Theme::default(),
            turntable: None,
            frusta: Vec::new(),
            mesh: false,
            tolerance: 5e-4,
            voxel: 0.001,
            point_budget: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_holds_exactly_what_was_put_in() {
        let mut mask = ClassMask::NONE;
        for class in [0, 63, 64, 200, 255] {
            mask.set(class, true);
        }
        for class in 0..256 {
            assert_eq!(mask.has(class), [0, 63, 64, 200, 255].contains(&class), "{class}");
        }
        assert!(mask.has(60_000), "classes from 255 on are one");
        mask.set(64, false);
        assert!(!mask.has(64) && mask.has(63));
    }

    #[test]
    fn cameras_from_hostile_reports_are_not_drawn() {
        let pose = wire::Pose { qw: 1.0, ..wire::Pose::default() };
        let intrinsics = wire::Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 };
        let report = |pose: &wire::Pose, camera: &wire::Intrinsics| wire::ViewReport {
            table_from_camera: Some(*pose),
            intrinsics: Some(*camera),
            ..wire::ViewReport::default()
        };
        assert!(CameraFrustum::from_wire(&report(&pose, &intrinsics), true).is_some());
        let nan = wire::Pose { tx: f64::NAN, ..pose };
        assert!(CameraFrustum::from_wire(&report(&nan, &intrinsics), true).is_none());
        let null = wire::Pose { qw: 0.0, ..pose };
        assert!(CameraFrustum::from_wire(&report(&null, &intrinsics), true).is_none());
        let flat = wire::Intrinsics { fx: 0.0, ..intrinsics };
        assert!(CameraFrustum::from_wire(&report(&pose, &flat), true).is_none());
        assert!(CameraFrustum::from_wire(&wire::ViewReport::default(), true).is_none());
    }
}
