//! The messages of a view back to the view. They come from a file that anyone may have written: every size, pose and number
//! is checked.

use crate::channel::{CALIBRATION, COLOR, DEPTH, LABELS};
use crate::schema::capture;
use image::RgbImage;
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion};
use prost::Message;
use semascan_foxglove::schema as foxglove;
use semascan_inspection::ports::PixelLabels;
use semascan_inspection::source::TrueMesh;
use semascan_model::Taxonomy;
use semascan_perception::view::{Chain, DepthImage, Intrinsics, PoseEvidence, RecordedLabels, View, ViewTruth};
use std::sync::Arc;

/// How far from 1 the length of a quaternion may be.
const UNIT: f64 = 1e-6;

/// Messages of one view until its end comes.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub(crate) color: Option<Vec<u8>>,
    pub(crate) depth: Option<Vec<u8>>,
    pub(crate) calibration: Option<Vec<u8>>,
    pub(crate) labels: Option<Vec<u8>>,
}

/// The view whose messages are `parts` and whose end is `end`; the error says what is wrong.
pub(crate) fn view(parts: &Parts, end: &capture::View) -> Result<View, String> {
    let missing = |topic: crate::channel::Topic| format!("view {}: has no message on {}", end.index, topic.name);
    let wrong = |what: &str, reason: &str| format!("view {}: {what}: {reason}", end.index);
    let decoded = |error: prost::DecodeError| format!("view {}: {error}", end.index);
    let color = parts.color.as_deref().ok_or_else(|| missing(COLOR))?;
    let color = foxglove::RawImage::decode(color).map_err(decoded)?;
    if color.encoding != "rgb8" {
        return Err(wrong(COLOR.name, &format!("encoding {:?} is not rgb8", color.encoding)));
    }
    let rgb = RgbImage::from_raw(color.width, color.height, color.data)
        .filter(|rgb| rgb.as_raw().len() == 3 * color.width as usize * color.height as usize)
        .ok_or_else(|| wrong(COLOR.name, "its data do not have its size"))?;
    let depth = parts.depth.as_deref().ok_or_else(|| missing(DEPTH))?;
    let depth = foxglove::RawImage::decode(depth).map_err(decoded)?;
    if depth.encoding != "32FC1" {
        return Err(wrong(DEPTH.name, &format!("encoding {:?} is not 32FC1, depth in metres", depth.encoding)));
    }
    if depth.data.len() as u64 != 4 * u64::from(depth.width) * u64::from(depth.height) {
        return Err(wrong(DEPTH.name, "its data do not have its size"));
    }
    let metres = depth.data.as_chunks::<4>().0.iter().map(|z| f32::from_le_bytes(*z)).collect::<Vec<_>>();
    if metres.iter().any(|z| !(z.is_finite() && *z >= 0.0)) {
        return Err(wrong(DEPTH.name, "a depth is no number of metres from 0 on (0 = not measured)"));
    }
    let calibration = parts.calibration.as_deref().ok_or_else(|| missing(CALIBRATION))?;
    let calibration = foxglove::CameraCalibration::decode(calibration).map_err(decoded)?;
    let intrinsics = intrinsics(&calibration).map_err(|reason| wrong(CALIBRATION.name, &reason))?;
    let labels = match (&parts.labels, end.has_labels) {
        (Some(labels), true) => {
            let labels = capture::Labels::decode(labels.as_slice()).map_err(decoded)?;
            let column =
                |name, bytes: &[u8]| sixteen_bits(bytes).ok_or_else(|| wrong(name, "half a value is left over"));
            Some(Arc::new(RecordedLabels {
                components: column("components", &labels.components)?,
                defects: column("defects", &labels.defects)?,
                instances: column("instances", &labels.instances)?,
            }))
        }
        (None, true) => return Err(missing(LABELS)),
        (_, false) => None,
    };
    Ok(View {
        index: end.index,
        stamp: end.stamp,
        intrinsics,
        rgb: Arc::new(rgb),
        depth: Arc::new(DepthImage { width: depth.width, height: depth.height, metres }),
        pose: evidence(end).map_err(|reason| wrong("pose", &reason))?,
        labels,
        truth: match &end.true_table_from_camera {
            Some(truth) => {
                let table_from_camera = pose(Some(truth)).map_err(|reason| wrong("true pose", &reason))?;
                Some(ViewTruth { table_from_camera })
            }
            None => None,
        },
    })
}

/// What the inspection said of the pixels of a view.
pub(crate) fn segmentation(labels: capture::Segmentation) -> Result<PixelLabels, String> {
    let capture::Segmentation { view, width, height, components, component_sigma, defects, defect_sigma, instances } =
        labels;
    let pixels = u64::from(width) * u64::from(height);
    let column = |name: &str, bytes: &[u8]| {
        sixteen_bits(bytes)
            .filter(|values| values.len() as u64 == pixels)
            .ok_or_else(|| format!("labels of view {view}: {name} does not have a value for each of {pixels} pixels"))
    };
    let sigma = |name: &str, bytes: Vec<u8>| match bytes.len() as u64 {
        0 => Ok(None),
        n if n == pixels => Ok(Some(bytes)),
        n => Err(format!("labels of view {view}: {name} has {n} values for {pixels} pixels")),
    };
    Ok(PixelLabels {
        width,
        height,
        components: column("components", &components)?,
        component_sigma: sigma("component_sigma", component_sigma)?,
        defects: column("defects", &defects)?,
        defect_sigma: sigma("defect_sigma", defect_sigma)?,
        instances: column("instances", &instances)?,
    })
}

/// The true surface; its classes are those of `taxonomy`.
pub(crate) fn truth(message: &[u8], taxonomy: Option<&Taxonomy>) -> Result<TrueMesh, String> {
    let truth = capture::Truth::decode(message).map_err(|e| e.to_string())?;
    let (vertices, rest) = truth.vertices.as_chunks::<3>();
    let (triangles, more) = truth.triangles.as_chunks::<3>();
    let class = |value: &u32| u16::try_from(*value).map_err(|_| format!("class {value} is beyond 65535"));
    let mesh = TrueMesh {
        vertices: vertices.to_vec(),
        triangles: triangles.to_vec(),
        labels: truth.labels.iter().map(class).collect::<Result<_, _>>()?,
        defects: truth.defects.iter().map(class).collect::<Result<_, _>>()?,
        taxonomy: taxonomy.cloned(),
    };
    let count = mesh.vertices.len();
    let fits = |column: &[u16]| column.is_empty() || column.len() == count;
    if !rest.is_empty() || !more.is_empty() || !fits(&mesh.labels) || !fits(&mesh.defects) {
        return Err("its columns have different lengths".to_owned());
    }
    if mesh.triangles.iter().flatten().any(|vertex| *vertex as usize >= count) {
        return Err("a triangle names a vertex that is not there".to_owned());
    }
    if mesh.vertices.iter().flatten().any(|x| !x.is_finite()) {
        return Err("a vertex is no point".to_owned());
    }
    Ok(mesh)
}

fn intrinsics(calibration: &foxglove::CameraCalibration) -> Result<Intrinsics, String> {
    let [fx, skew, cx, _, fy, cy, ..] = calibration.k.as_slice() else {
        return Err(format!("K has {} values for 9", calibration.k.len()));
    };
    if calibration.k.len() != 9 {
        return Err(format!("K has {} values for 9", calibration.k.len()));
    }
    let positive = |f: f64| f.is_finite() && f > 0.0;
    if !positive(*fx) || !positive(*fy) || !cx.is_finite() || !cy.is_finite() || *skew != 0.0 {
        return Err("K is not that of a pinhole camera without skew".to_owned());
    }
    if calibration.d.iter().any(|d| *d != 0.0) {
        return Err("the pictures are distorted; only rectified ones can be inspected".to_owned());
    }
    Ok(Intrinsics { width: calibration.width, height: calibration.height, fx: *fx, fy: *fy, cx: *cx, cy: *cy })
}

fn evidence(end: &capture::View) -> Result<PoseEvidence, String> {
    let covariance = || -> Result<Matrix6<f64>, String> {
        if end.covariance.len() != 36 || end.covariance.iter().any(|c| !c.is_finite()) {
            return Err("its covariance is no 6 x 6 matrix".to_owned());
        }
        Ok(Matrix6::from_row_slice(&end.covariance))
    };
    match &end.pose {
        None => Ok(PoseEvidence::None),
        Some(capture::view::Pose::TableFromCamera(table_from_camera)) => {
            Ok(PoseEvidence::World { table_from_camera: pose(Some(table_from_camera))?, covariance: covariance()? })
        }
        Some(capture::view::Pose::Chain(chain)) => {
            if !chain.table_angle.is_finite() {
                return Err("the table angle is no number".to_owned());
            }
            let chain = Chain {
                base_from_ee: pose(chain.base_from_ee.as_ref())?,
                ee_from_camera: pose(chain.ee_from_camera.as_ref())?,
                base_from_tablebase: pose(chain.base_from_tablebase.as_ref())?,
                table_angle: chain.table_angle,
            };
            Ok(PoseEvidence::Chain { chain, covariance: covariance()? })
        }
    }
}

/// The pose bit for bit: the quaternion is not normalized again.
fn pose(pose: Option<&capture::Pose>) -> Result<Isometry3<f64>, String> {
    let pose = pose.ok_or("a reading of the chain is missing")?;
    if ![pose.x, pose.y, pose.z].iter().all(|t| t.is_finite()) {
        return Err("a translation is no number of metres".to_owned());
    }
    let quaternion = Quaternion::new(pose.qw, pose.qx, pose.qy, pose.qz);
    let is_unit = (quaternion.norm() - 1.0).abs() <= UNIT;
    if !is_unit {
        return Err("a quaternion does not have length 1".to_owned());
    }
    let rotation = UnitQuaternion::new_unchecked(quaternion);
    Ok(Isometry3::from_parts(Translation3::new(pose.x, pose.y, pose.z), rotation))
}

fn sixteen_bits(bytes: &[u8]) -> Option<Vec<u16>> {
    let (values, rest) = bytes.as_chunks::<2>();
    rest.is_empty().then(|| values.iter().map(|v| u16::from_le_bytes(*v)).collect())
}
