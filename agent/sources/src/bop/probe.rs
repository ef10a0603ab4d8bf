//! A look at some of a scene's views before the first is handed out: for the units of its numbers, and for the pixels that
//! move with the camera. A scene with broken views still has both.

use super::metadata::{Camera, MILLIMETRE, SceneMetadata};
use super::pictures::{DepthUnit, Pictures, StoredDepth};
use super::units::{self, Finding};
use crate::OpenOptions;
use crate::camera_mask::PosedDepth;
use semascan_inspection::source::SourceError;
use semascan_perception::view::DepthImage;

/// Most views that are looked at for a camera mask, and for units alone.
pub(super) const FOR_A_MASK: usize = 40;
pub(super) const FOR_UNITS: usize = 8;
/// Views that units are compared on.
const COMPARED: usize = 8;
/// Pixels of all views that are looked at: a bound on memory, 4 bytes each.
const MOST_PIXELS: usize = 48 << 20;

/// What the numbers of a scene are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SceneUnits {
    /// Metres of a translation of 1.
    pub(super) pose: f64,
    /// Metres of a depth of 1, where that is known otherwise than by `depth_scale`.
    known_depth: Option<f64>,
    /// Metres of a depth of 1 of the depth camera that was named, for views without a `depth_scale`.
    of_device: Option<f64>,
    /// Factor on `depth_scale`.
    depth_factor: f64,
    /// Metres of a floating point depth of 1, where that is not what `depth_scale` says.
    float_depth: Option<f64>,
}

impl SceneUnits {
    /// What depths mean in a view of a camera.
    pub(super) fn depth(&self, camera: &Camera) -> DepthUnit {
        let of_device = self.of_device.filter(|_| !camera.has_depth_scale);
        let scale = of_device.unwrap_or(camera.depth_scale);
        let whole = self.known_depth.unwrap_or(scale * self.depth_factor);
        DepthUnit { whole, float: self.known_depth.or(self.float_depth).unwrap_or(whole) }
    }
}

/// What the look found.
#[derive(Debug)]
pub(super) struct Probe {
    pub(super) units: SceneUnits,
    /// The views that were looked at and have a pose.
    pub(super) posed: Vec<PosedDepth>,
    /// What was assumed, or looks wrong: a name and a sentence.
    pub(super) said: Vec<(&'static str, String)>,
}

impl Probe {
    /// Looks at up to `most` of `views`.
    ///
    /// # Errors
    /// [`SourceError::Field`] if units contradict each other and it cannot be known which is wrong.
    pub(super) fn take(
        metadata: &SceneMetadata,
        pictures: &Pictures,
        views: &[u32],
        options: &OpenOptions,
        most: usize,
    ) -> Result<Self, SourceError> {
        let mut units = SceneUnits {
            pose: options.unit.map_or(MILLIMETRE, |unit| unit.in_metres()),
            known_depth: options.depth_scale.map(|mm| mm * MILLIMETRE),
            of_device: options.recording.device.map(|device| device.metres_per_unit),
            depth_factor: 1.0,
            float_depth: None,
        };
        let mut said = Vec::new();
        let mut looked: Vec<(Camera, DepthImage)> = Vec::new();
        let mut left = MOST_PIXELS;
        for &number in spread(views, most) {
            let Ok(camera) = metadata.camera(number, units.pose) else { continue };
            let Some(stored) = pictures.depth.find(number).ok().flatten().and_then(|p| StoredDepth::read(p).ok())
            else {
                continue;
            };
            if units.float_depth.is_none() && stored.is_float() && units.known_depth.is_none() {
                let Some(median) = stored.median() else { continue };
                units.float_depth = Some(float_depth(metadata, number, median, camera.depth_scale, &mut said)?);
            }
            let (depth, _) = stored.in_metres(units.depth(&camera), options.recording.device);
            let pixels = depth.metres.len();
            looked.push((camera, depth));
            match left.checked_sub(pixels) {
                Some(rest) => left = rest,
                None => break,
            }
        }
        let has_scale = looked.iter().all(|(camera, _)| camera.has_depth_scale);
        let unposed = looked.iter().all(|(camera, _)| camera.table_from_camera.is_none());
        let median = units::median_depth(looked.iter().map(|(_, depth)| depth)).filter(|_| unposed);
        let mut posed: Vec<PosedDepth> = looked
            .into_iter()
            .filter_map(|(camera, depth)| {
                let intrinsics = camera.intrinsics(depth.width, depth.height);
                Some(PosedDepth { intrinsics, depth, table_from_camera: camera.table_from_camera? })
            })
            .collect();
        let is_assumed = units.known_depth.is_none() && units.float_depth.is_none() && units.of_device.is_none();
        if !has_scale && is_assumed {
            said.push(("depth_scale", "is missing: a depth of 1 is taken to be a millimetre".into()));
        }
        compare(metadata, &mut units, &mut posed, (options, has_scale), &mut said)?;
        let median = median.or_else(|| units::median_depth(posed.iter().map(|view| &view.depth)));
        if let Some(depth) = median.filter(|depth| !units::is_plausible(*depth)) {
            said.push((
                "depth",
                format!("its median is {depth:.4} m: is depth_scale right? --depth-scale MM overrides it"),
            ));
        }
        Ok(Self { units, posed, said })
    }
}

/// Lets poses and depth check each other, and changes `units` and `posed` where one of them is known to be wrong.
fn compare(
    metadata: &SceneMetadata,
    units: &mut SceneUnits,
    posed: &mut [PosedDepth],
    (options, has_scale): (&OpenOptions, bool),
    said: &mut Vec<(&'static str, String)>,
) -> Result<(), SourceError> {
    let compared: Vec<PosedDepth> = spread(posed, COMPARED).into_iter().cloned().collect();
    let finding = units::compare(&compared);
    let factor = match finding {
        Finding::Consistent => return Ok(()),
        Finding::Poses(factor) | Finding::Ambiguous(factor) => factor,
        Finding::Depth(factor) => 1.0 / factor,
    };
    // What was said on the command line is not in doubt: then it is the other.
    let finding = match (options.unit.is_some(), options.depth_scale.is_some()) {
        (true, true) => return Ok(()),
        (true, false) => Finding::Depth(1.0 / factor),
        (false, true) => Finding::Poses(factor),
        // What nobody wrote is what is wrong.
        (false, false) if !has_scale && matches!(finding, Finding::Ambiguous(_)) => Finding::Depth(1.0 / factor),
        (false, false) => finding,
    };
    match finding {
        Finding::Poses(factor) => {
            units.pose *= factor;
            posed.iter_mut().for_each(|view| view.table_from_camera.translation.vector *= factor);
            let text = format!(
                "cam_t_w2c is taken to be in {}: only then do the views fit together (--unit overrides it)",
                name_of(units.pose)
            );
            said.push(("pose_unit", text));
        }
        Finding::Depth(factor) => {
            units.depth_factor *= factor;
            units.float_depth = units.float_depth.map(|unit| unit * factor);
            posed.iter_mut().flat_map(|view| &mut view.depth.metres).for_each(|z| *z = (f64::from(*z) * factor) as f32);
            let text = format!(
                "depth_scale is taken to be {factor} times what is written: only then do the views fit together \
                 (--depth-scale overrides it)"
            );
            said.push(("depth_unit", text));
        }
        Finding::Ambiguous(factor) => return Err(contradiction(metadata, factor)),
        Finding::Consistent => {}
    }
    Ok(())
}

/// Poses and depth that differ by `factor`, and it cannot be known which is wrong.
fn contradiction(metadata: &SceneMetadata, factor: f64) -> SourceError {
    SourceError::Field {
        path: metadata.cameras_path().to_owned(),
        field: "cam_t_w2c, depth_scale".into(),
        reason: format!(
            "the views fit together only if translations are {factor} times what is written, or depth 1/{factor} of it; \
             say which is right with --unit mm|cm|m or --depth-scale MM"
        ),
    }
}

/// Metres of a floating point depth of 1 in the view `number`.
fn float_depth(
    metadata: &SceneMetadata,
    number: u32,
    median: f64,
    scale: f64,
    said: &mut Vec<(&'static str, String)>,
) -> Result<f64, SourceError> {
    let unit = units::float_unit(median, scale).ok_or_else(|| SourceError::Field {
        path: metadata.cameras_path().to_owned(),
        field: format!("{number}.depth_scale"),
        reason: format!(
            "floating point depths with a median of {median} are neither metres nor millimetres nor what it says; say \
             what they are with --depth-scale MM"
        ),
    })?;
    let text = format!("floating point depths are taken to be in {} (--depth-scale overrides it)", name_of(unit));
    said.push(("depth_unit", text));
    Ok(unit)
}

/// A length in metres as people call it.
fn name_of(unit: f64) -> String {
    let known = [(1.0, "metres"), (1e-2, "centimetres"), (1e-3, "millimetres"), (1e-6, "thousandths of a millimetre")];
    let found = known.iter().find(|(length, _)| (unit / length - 1.0).abs() < 1e-9);
    found.map_or_else(|| format!("units of {} mm", unit * 1e3), |(_, name)| (*name).into())
}

/// Up to `most` of `all`, evenly spread.
fn spread<T>(all: &[T], most: usize) -> Vec<&T> {
    let count = all.len().min(most);
    (0..count).map(|i| &all[i * all.len() / count]).collect()
}
