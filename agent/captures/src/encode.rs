//! A view to the messages that it is kept as.

use crate::channel::{CALIBRATION, COLOR, DEPTH, LABELS, SEGMENTATION, TRANSFORM, TRUTH, Topic, VIEW};
use crate::schema::capture;
use nalgebra::{Isometry3, Matrix6};
use prost::Message;
use prost_types::Timestamp;
use semascan_foxglove::schema as foxglove;
use semascan_inspection::event::ProcessedView;
use semascan_inspection::source::TrueMesh;
use semascan_perception::segment::ClassField;
use semascan_perception::view::{PoseEvidence, View};
use std::time::{Duration, UNIX_EPOCH};

/// A message with the topic that it goes to.
pub(crate) type Encoded = (Topic, Vec<u8>);

/// The messages of a view that is the `index`-th of its source, at `nanoseconds` after 1970; the view's end comes last.
pub(crate) fn view(index: u32, view: &View, settings: &[(String, String)], nanoseconds: u64) -> Vec<Encoded> {
    let timestamp = Some(Timestamp::from(UNIX_EPOCH + Duration::from_nanos(nanoseconds)));
    let frame_id = "camera".to_owned();
    let (width, height) = view.rgb.dimensions();
    let color = foxglove::RawImage {
        timestamp,
        frame_id: frame_id.clone(),
        width,
        height,
        encoding: "rgb8".to_owned(),
        step: width.saturating_mul(3),
        data: view.rgb.as_raw().clone(),
    };
    let depth = foxglove::RawImage {
        timestamp,
        frame_id: frame_id.clone(),
        width: view.depth.width,
        height: view.depth.height,
        encoding: "32FC1".to_owned(),
        step: view.depth.width.saturating_mul(4),
        data: view.depth.metres.iter().flat_map(|z| z.to_le_bytes()).collect(),
    };
    let k = &view.intrinsics;
    let calibration = foxglove::CameraCalibration {
        timestamp,
        frame_id,
        width: k.width,
        height: k.height,
        distortion_model: String::new(),
        d: Vec::new(),
        k: vec![k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![k.fx, 0.0, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    };
    let mut messages = vec![
        (COLOR, color.encode_to_vec()),
        (DEPTH, depth.encode_to_vec()),
        (CALIBRATION, calibration.encode_to_vec()),
    ];
    messages.extend(transforms(&view.pose, timestamp).iter().map(|t| (TRANSFORM, t.encode_to_vec())));
    if let Some(labels) = &view.labels {
        let labels = capture::Labels {
            components: sixteen_bits(labels.components.iter()),
            defects: sixteen_bits(labels.defects.iter()),
            instances: sixteen_bits(labels.instances.iter()),
        };
        messages.push((LABELS, labels.encode_to_vec()));
    }
    let (evidence, covariance) = match &view.pose {
        PoseEvidence::Chain { chain, covariance } => {
            let chain = capture::Chain {
                base_from_ee: Some(pose(&chain.base_from_ee)),
                ee_from_camera: Some(pose(&chain.ee_from_camera)),
                base_from_tablebase: Some(pose(&chain.base_from_tablebase)),
                table_angle: chain.table_angle,
            };
            (Some(capture::view::Pose::Chain(chain)), row_major(covariance))
        }
        PoseEvidence::World { table_from_camera, covariance } => {
            (Some(capture::view::Pose::TableFromCamera(pose(table_from_camera))), row_major(covariance))
        }
        PoseEvidence::None => (None, Vec::new()),
    };
    let end = capture::View {
        index,
        stamp: view.stamp,
        pose: evidence,
        covariance,
        true_table_from_camera: view.truth.as_ref().map(|truth| pose(&truth.table_from_camera)),
        has_labels: view.labels.is_some(),
        failure: None,
        settings: settings_of(settings),
    };
    messages.push((VIEW, end.encode_to_vec()));
    messages
}

/// The message of a view that its source could not give.
pub(crate) fn failed_view(index: u32, reason: &str, settings: &[(String, String)]) -> Encoded {
    let failure = Some(reason.to_owned());
    let end = capture::View { index, failure, settings: settings_of(settings), ..capture::View::default() };
    (VIEW, end.encode_to_vec())
}

/// What the inspection said of the pixels of its `view`-th view; nothing where it did not come so far.
pub(crate) fn segmentation(view: u32, processed: &ProcessedView) -> Option<Encoded> {
    let segmentation = processed.segmentation.as_ref()?;
    let (width, height) = (processed.view.intrinsics.width, processed.view.intrinsics.height);
    let pixels = width as usize * height as usize;
    let best = |field: &ClassField| sixteen_bits((0..pixels).map(|i| field.best(i)).collect::<Vec<_>>().iter());
    let sigma = |field: &ClassField| match field {
        ClassField::Hard(_) => Vec::new(),
        ClassField::Soft { sigma, .. } => sigma.clone(),
    };
    let message = capture::Segmentation {
        view,
        width,
        height,
        components: best(&segmentation.components),
        component_sigma: sigma(&segmentation.components),
        defects: best(&segmentation.defects),
        defect_sigma: sigma(&segmentation.defects),
        instances: sixteen_bits(segmentation.instances.iter()),
    };
    Some((SEGMENTATION, message.encode_to_vec()))
}

/// The message of the true surface.
pub(crate) fn truth(truth: &TrueMesh) -> Encoded {
    let message = capture::Truth {
        vertices: truth.vertices.iter().flatten().copied().collect(),
        triangles: truth.triangles.iter().flatten().copied().collect(),
        labels: truth.labels.iter().map(|l| u32::from(*l)).collect(),
        defects: truth.defects.iter().map(|d| u32::from(*d)).collect(),
    };
    (TRUTH, message.encode_to_vec())
}

fn settings_of(settings: &[(String, String)]) -> Vec<capture::Setting> {
    settings.iter().map(|(name, value)| capture::Setting { name: name.clone(), value: value.clone() }).collect()
}

/// The frames of a view as a tree: base, ee, camera; base, tablebase, table; or table, camera.
fn transforms(evidence: &PoseEvidence, timestamp: Option<Timestamp>) -> Vec<foxglove::FrameTransform> {
    let transform = |parent: &str, child: &str, pose: &Isometry3<f64>| {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        foxglove::FrameTransform {
            timestamp,
            parent_frame_id: parent.to_owned(),
            child_frame_id: child.to_owned(),
            translation: Some(foxglove::Vector3 { x: t.x, y: t.y, z: t.z }),
            rotation: Some(foxglove::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
        }
    };
    match evidence {
        PoseEvidence::Chain { chain, .. } => vec![
            transform("base", "ee", &chain.base_from_ee),
            transform("ee", "camera", &chain.ee_from_camera),
            transform("base", "tablebase", &chain.base_from_tablebase),
            transform("tablebase", "table", &Isometry3::rotation(nalgebra::Vector3::z() * chain.table_angle)),
        ],
        PoseEvidence::World { table_from_camera, .. } => vec![transform("table", "camera", table_from_camera)],
        PoseEvidence::None => Vec::new(),
    }
}

fn pose(pose: &Isometry3<f64>) -> capture::Pose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    capture::Pose { x: t.x, y: t.y, z: t.z, qx: q.x, qy: q.y, qz: q.z, qw: q.w }
}

fn row_major(matrix: &Matrix6<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

fn sixteen_bits<'a>(values: impl Iterator<Item = &'a u16>) -> Vec<u8> {
    values.flat_map(|value| value.to_le_bytes()).collect()
}
