//! Views of which nothing is known: the first one's camera is the table frame, the others are found in the
//! model.

use anyhow::{Context, Result};
use image::GrayImage;
use nalgebra::{Isometry3, Point3};
use semascan_evaluation::{PosePair, align_poses, aligned_pose_errors, judge_aligned, pose_error};
use semascan_inspection::Inspected;
use semascan_inspection::record::isometry;
use semascan_inspection::source::Source;
use semascan_inspection::spec::{CameraMask, InspectionSpec, LabelSource, RegistrationMethod};
use semascan_model::SemanticCloud;
use semascan_model::record::{InspectionRecord, RegistrationRecord, ViewRecord};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_tests::data;
use semascan_tests::inspect::inspect_with;
use semascan_tests::sources::open;
use semascan_tests::unposed::Unposed;
use std::path::Path;

/// A motor seen in a full turn, of whose views those that `lost` names come without evidence.
fn motor(uri: &str, lost: fn(u32) -> bool) -> Result<Unposed<VirtualCell>> {
    Ok(Unposed { source: cell(uri)?, lost })
}

fn cell(uri: &str) -> Result<VirtualCell> {
    Ok(VirtualCell::open(&VirtualCellSpec::parse(uri)?)?)
}

fn inspect(source: Box<dyn Source>, registration: RegistrationMethod) -> Result<Inspected> {
    // Segment ICP needs to know the object: by the labels that come with the views, where they have some.
    let labels = if source.info().no_labels.is_none() { LabelSource::Source } else { LabelSource::None };
    let spec = InspectionSpec { registration, labels, ..InspectionSpec::default() };
    let inspected = inspect_with(spec, source)?;
    for view in &inspected.record.views {
        eprintln!("view {}: {:?} {}", view.index, view.registration, view.reason.as_deref().unwrap_or_default());
    }
    Ok(inspected)
}

fn is_relocalized(view: &ViewRecord) -> bool {
    matches!(view.registration, Some(RegistrationRecord::Relocalized { .. }))
}

fn is_frame(view: &ViewRecord) -> bool {
    view.registration == Some(RegistrationRecord::CameraIsFrame)
}

/// Estimated and true poses of the accepted views.
fn poses(record: &InspectionRecord, cell: &VirtualCell) -> Result<Vec<PosePair>> {
    let pair = |view: &ViewRecord| {
        let truth = cell.view(view.index).and_then(|v| v.truth).context("no truth")?.table_from_camera;
        Ok(PosePair { estimate: isometry(view.pose.as_ref().context("no pose")?), truth })
    };
    record.views.iter().filter(|v| v.accepted).map(pair).collect()
}

#[test]
fn a_turn_without_any_pose_gives_the_model_in_the_frame_of_the_first_camera() -> Result<()> {
    let uri = "virtual:starter-motor?seed=7&views=12";
    let Inspected { record, cloud, source, .. } =
        inspect(Box::new(motor(uri, |_| true)?), RegistrationMethod::SegmentIcp)?;
    assert!(is_frame(&record.views[0]));
    assert!(record.views[1..].iter().all(|view| is_relocalized(view) || view.registration.is_none()));
    assert!(record.base_from_table.is_none() && record.views.iter().all(|v| v.prior.is_none()));
    let accepted = record.views.iter().filter(|v| v.accepted).count();
    assert!(accepted >= 11, "{accepted} of 12 views");

    let pairs = poses(&record, &cell(uri)?)?;
    let errors = aligned_pose_errors(&pairs);
    let angle = errors.iter().map(|e| e.rotation.to_degrees()).fold(0.0, f64::max);
    let distance = errors.iter().map(|e| e.translation * 1e3).fold(0.0, f64::max);
    // The surroundings do not turn with the part: the part alone is the model.
    let part: SemanticCloud = cloud.iter().filter(|p| p.label != 0).collect();
    let truth = source.truth().context("the cell knows the truth")?;
    let surface = judge_aligned(&part, truth, &align_poses(&pairs).context("finite")?).surface.context("points")?;
    eprintln!(
        "worst pose {angle:.4} deg {distance:.4} mm; ME {:.4} mm, HD95 {:.4} mm",
        surface.mean * 1e3,
        surface.hd95 * 1e3
    );
    assert!(angle < 0.06 && distance < 0.3, "{angle} deg {distance} mm");
    assert!(surface.mean < 0.15e-3 && surface.hd95 < 0.5e-3, "{surface:?}");
    Ok(())
}

#[test]
fn views_that_lost_their_pose_on_the_way_are_found_in_the_table_frame() -> Result<()> {
    let lost = |view| matches!(view, 4 | 5 | 9);
    let uri = "virtual:starter-motor?seed=8&views=12&errors=none&size=480x360";
    let record = inspect(Box::new(motor(uri, lost)?), RegistrationMethod::SegmentIcp)?.record;
    assert!(record.base_from_table.is_some());
    for view in &record.views {
        assert_eq!(
            (is_relocalized(view), view.prior.is_none()),
            (lost(view.index), lost(view.index)),
            "view {}",
            view.index
        );
    }
    for (pair, view) in poses(&record, &cell(uri)?)?.iter().zip(&record.views) {
        let error = pose_error(&pair.estimate, &pair.truth);
        let (angle, distance) = (error.rotation.to_degrees(), error.translation * 1e3);
        assert!(angle < 0.1 && distance < 0.5, "view {}: {angle} deg {distance} mm", view.index);
    }
    Ok(())
}

#[test]
fn readings_are_not_believed_in_the_frame_of_a_camera() -> Result<()> {
    let uri = "virtual:starter-motor?seed=8&views=12&errors=none&size=480x360";
    let Inspected { record, model, .. } =
        inspect(Box::new(motor(uri, |view| view == 0)?), RegistrationMethod::SegmentIcp)?;
    assert!(is_frame(&record.views[0]) && is_relocalized(&record.views[1]));
    assert!(record.base_from_table.is_none(), "the robot does not know where that camera was");
    assert!(model.read().config().volume.is_none(), "nor does the measuring volume");
    let errors = aligned_pose_errors(&poses(&record, &cell(uri)?)?);
    assert!(errors.len() >= 10 && errors.iter().all(|e| e.rotation.to_degrees() < 0.1), "{errors:?}");
    Ok(())
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn a_real_scene_without_camera_poses_is_put_together() -> Result<()> {
    let shelf = data::folder("shelf-eye-in-hand")?;
    let folder = tempfile::tempdir()?;
    let mask = folder.path().join("gripper.png");
    let mut posed = open(&shelf.display().to_string())?;
    write_camera_mask(posed.as_mut(), &mask)?;
    let posed = semascan_sources::open(&shelf.display().to_string(), &CameraMask::File(mask.clone()))?;
    let reference = inspect(posed, RegistrationMethod::Icp)?.record;
    let scene = folder.path().join("scene");
    without_camera_poses(&shelf, &scene)?;
    let unposed = semascan_sources::open(&scene.display().to_string(), &CameraMask::File(mask))?;
    let record = inspect(unposed, RegistrationMethod::Icp)?.record;
    let both = reference.views.iter().zip(&record.views).filter(|(a, b)| a.accepted && b.accepted);
    let pairs: Vec<PosePair> = both
        .map(|(a, b)| Some(PosePair { truth: isometry(a.pose.as_ref()?), estimate: isometry(b.pose.as_ref()?) }))
        .collect::<Option<_>>()
        .context("poses")?;
    let errors = aligned_pose_errors(&pairs);
    for e in &errors {
        eprintln!(
            "from the pose with the robot's help: {:.3} deg {:.2} mm",
            e.rotation.to_degrees(),
            e.translation * 1e3
        );
    }
    // Neighbouring views see only part of the same shelf; which of them do not find each other is said in the record.
    assert!(errors.len() >= 7, "{} of 15 views", errors.len());
    assert!(errors.iter().all(|e| e.rotation.to_degrees() < 0.5 && e.translation < 5e-3), "{errors:?}");
    Ok(())
}

/// Writes the pixels that no view of `source` has depth in as a PNG.
fn write_camera_mask(source: &mut dyn Source, path: &Path) -> Result<()> {
    let mut empty: Option<GrayImage> = None;
    while let Some(view) = source.next_view() {
        let depth = view?.depth;
        let mask = empty.get_or_insert_with(|| GrayImage::from_pixel(depth.width, depth.height, image::Luma([255])));
        for (pixel, z) in mask.pixels_mut().zip(&depth.metres) {
            if *z > 0.0 {
                pixel.0 = [0];
            }
        }
    }
    Ok(empty.context("no view")?.save(path)?)
}

/// A copy of a BOP scene whose cameras were never posed.
fn without_camera_poses(scene: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for kind in ["rgb", "depth"] {
        std::fs::create_dir_all(to.join(kind))?;
        for entry in std::fs::read_dir(scene.join(kind))? {
            let file = entry?;
            std::fs::copy(file.path(), to.join(kind).join(file.file_name()))?;
        }
    }
    let mut cameras: serde_json::Value = serde_json::from_slice(&std::fs::read(scene.join("scene_camera.json"))?)?;
    for camera in cameras.as_object_mut().context("an object")?.values_mut().filter_map(|c| c.as_object_mut()) {
        camera.retain(|key, _| !key.ends_with("w2c"));
    }
    Ok(std::fs::write(to.join("scene_camera.json"), cameras.to_string())?)
}

/// Pose of each view in the one before it: translation in metres and rotation vector, as Open3D finds it (see
/// `point_clouds.rs`).
const BY_OPEN3D: [([f64; 3], [f64; 3]); 4] = [
    ([-0.1082, 0.0072, 0.0056], [0.0031, 0.0190, -0.0091]),
    ([-0.1502, -0.0009, 0.0132], [-0.0030, -0.0369, -0.0069]),
    ([-0.2105, -0.0069, 0.0118], [-0.0040, -0.1039, -0.0012]),
    ([-0.1719, -0.0025, 0.0248], [0.0011, 0.0045, 0.0131]),
];

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn five_real_clouds_without_poses_make_one_room() -> Result<()> {
    let folder = data::folder("point-clouds/pairwise")?;
    let record = inspect(open(&folder.display().to_string())?, RegistrationMethod::Icp)?.record;
    let found: Option<Vec<Isometry3<f64>>> = record.views.iter().map(|v| v.pose.as_ref().map(isometry)).collect();
    let found = found.context("a view was left out")?;
    let middle = Point3::new(0.0, 0.0, 2.2);
    for (pair, (translation, rotation)) in found.windows(2).zip(BY_OPEN3D) {
        let (between, reference) = (pair[0].inverse() * pair[1], Isometry3::new(translation.into(), rotation.into()));
        let off = (between * middle - reference * middle).norm() * 1e3;
        let turn = between.rotation.angle_to(&reference.rotation).to_degrees();
        eprintln!("from Open3D's pose: {off:.1} mm {turn:.2} deg");
        assert!(off < 20.0 && turn < 0.5, "{off} mm, {turn} deg");
    }
    Ok(())
}
