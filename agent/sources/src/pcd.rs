//! Organized clouds in PCD files as a source of views: one file, or a folder of them in the order of their names.
//!
//! Such a cloud is a depth picture, but the file does not say by which camera: the pinhole that its points were
//! computed with is read off the points themselves (`pinhole_fit`). Most writers leave the header's viewpoint at the
//! identity, or at what their driver has: then nothing is known of where the clouds were taken. If those of the files differ, the
//! viewpoints are the camera's poses. Some writers keep the points in the camera's frame, others bring them into the viewpoint's: in which of the
//! two a pinhole fits tells. Nor does a file say its unit: that is assumed from how far the points are away, and said.

use crate::OpenOptions;
use crate::pinhole_fit::{FittedPinhole, pinhole};
use crate::recorded_pose::{OF_ROBOTS, evidence};
use image::RgbImage;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use semascan_formats::offset::relative;
use semascan_formats::pcd::{self, PcdCloud, Viewpoint};
use semascan_formats::{ReadError, regular_file, unit};
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_model::{LengthUnit, Taxonomy};
use semascan_perception::view::{DepthImage, Intrinsics, View};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of a file in which its header's viewpoint stands.
const HEAD: usize = 2048;
/// A viewpoint that says nothing.
const IDENTITY: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
/// What is shown where the file has no colours.
const GREY: [u8; 3] = [128; 3];

/// A format of files with organized clouds.
#[derive(Debug)]
pub(crate) struct CloudFormat {
    /// For people.
    pub(crate) name: &'static str,
    pub(crate) ending: &'static str,
    /// What the format has lengths in, where it says.
    pub(crate) unit: Option<LengthUnit>,
    /// Reads a file; a format that has no viewpoint gives none.
    pub(crate) read: fn(&Path) -> Result<PcdCloud, ReadError>,
    /// The viewpoint that a file states: translation in its unit, and rotation (w, x, y, z).
    pub(crate) viewpoint: fn(&Path) -> Option<[f64; 7]>,
}

/// PCD.
const PCD: CloudFormat = CloudFormat { name: "PCD", ending: "pcd", unit: None, read: pcd::read_file, viewpoint };

/// Views from files with organized clouds.
#[derive(Debug)]
pub struct PcdSource {
    format: &'static CloudFormat,
    info: SourceInfo,
    files: Vec<PathBuf>,
    next: usize,
    unit: LengthUnit,
    /// Whether viewpoints are poses.
    has_poses: bool,
    /// Whether it has been said that labels are not used.
    labels_said: bool,
}

impl PcdSource {
    /// Whether `path` is a PCD file or a folder that holds one.
    pub fn is_source(path: &Path) -> bool {
        files(path, PCD.ending).is_ok_and(|files| !files.is_empty())
    }

    /// Opens a file or folder; the files are read when their views are asked for. Where `options` say no unit, that of the
    /// first file with points is assumed for all.
    ///
    /// # Errors
    /// [`SourceError`] if the folder cannot be read or holds no PCD file.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, SourceError> {
        Self::of_format(&PCD, path, options)
    }

    /// Opens a file of `format`, or a folder of such files.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub(crate) fn of_format(
        format: &'static CloudFormat,
        path: &Path,
        options: &OpenOptions,
    ) -> Result<Self, SourceError> {
        let unit = options.unit.or(format.unit);
        let all = files(path, format.ending)?;
        let has_poses = are_poses(all.iter().map(|file| (format.viewpoint)(file)));
        let files: Vec<PathBuf> = all.into_iter().step_by(options.every.max(1) as usize).collect();
        if files.is_empty() {
            return Err(SourceError::Format {
                path: path.to_owned(),
                reason: format!("no {} file in it", format.name),
            });
        }
        let assumed = || {
            let distance = files.iter().find_map(|file| median_distance(&(format.read)(file).ok()?))?;
            let unit = unit::of_distance(distance);
            tracing::warn!(
                "{}: the points are {distance:.3} away, so one unit is taken for 1 {}: say another with --unit",
                path.display(),
                unit.name()
            );
            Some(unit)
        };
        let setting = match (options.unit, format.unit) {
            (Some(_), _) => "as said",
            (None, Some(_)) => "as the format has it",
            (None, None) => "assumed from the distances",
        };
        // Where no file has a point there is nothing to scale.
        let unit = unit.or_else(assumed).unwrap_or(LengthUnit::Metres);
        let mut settings = vec![("unit".into(), format!("{}, {setting}", unit.name()))];
        if has_poses {
            settings.push(("poses".into(), "the viewpoints of the files".into()));
        }
        let info = SourceInfo {
            uri: path.display().to_string(),
            part: path.file_stem().map_or("cloud".into(), |n| n.to_string_lossy().into_owned()),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: Some(files.len() as u32),
            turntable: None,
            volume: None,
            no_labels: Some(format!("labels of {} files are not read", format.name)),
            settings,
        };
        Ok(Self { format, info, files, next: 0, unit, has_poses, labels_said: false })
    }
}

impl Source for PcdSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let path = self.files.get(self.next)?;
        let index = self.next as u32;
        self.next += 1;
        let cloud = match (self.format.read)(path) {
            Ok(cloud) => cloud,
            Err(error) => return Some(Err(failure(path, error))),
        };
        for warning in &cloud.warnings {
            tracing::warn!("{}: {warning}", path.display());
        }
        if cloud.labels.is_some() && !std::mem::replace(&mut self.labels_said, true) {
            tracing::warn!(
                "{}: the field label is not used: a PCD file does not say what its classes are",
                path.display()
            );
        }
        let view = view(index, cloud, self.unit, self.has_poses);
        Some(view.map_err(|reason| SourceError::Format { path: path.clone(), reason }))
    }

    fn rewind(&mut self) -> bool {
        self.next = 0;
        true
    }
}

/// The failure of a reader as that of a source.
fn failure(path: &Path, error: ReadError) -> SourceError {
    match error {
        ReadError::Io { source, .. } => SourceError::Io { path: path.to_owned(), source },
        ReadError::Format { reason, .. } => SourceError::Format { path: path.to_owned(), reason },
    }
}

/// The files with `ending` that `path` means, by name.
pub(crate) fn files(path: &Path, ending: &str) -> Result<Vec<PathBuf>, SourceError> {
    let is_pcd = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) && p.is_file();
    if path.is_file() {
        return Ok(is_pcd(path).then(|| path.to_owned()).into_iter().collect());
    }
    let io = |source| SourceError::Io { path: path.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io)? {
        let file = entry.map_err(io)?.path();
        if is_pcd(&file) {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}

/// How far the points are away along the optical axis at the median, in the file's unit; `None` if it has no points.
fn median_distance(cloud: &PcdCloud) -> Option<f64> {
    let mut depths: Vec<f64> = cloud.positions.iter().map(|p| p[2]).filter(|z| z.is_finite() && *z > 0.0).collect();
    let middle = depths.len() / 2;
    (!depths.is_empty()).then(|| *depths.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A cloud as a view.
fn view(index: u32, cloud: PcdCloud, unit: LengthUnit, has_pose: bool) -> Result<View, String> {
    let PcdCloud { width, height, positions, colors, viewpoint, .. } = cloud;
    let positions = relative(&positions, unit.in_metres(), [0.0; 3]);
    let table_from_camera = viewpoint.filter(|_| has_pose).map(|viewpoint| pose(&viewpoint, unit));
    let (intrinsics, positions) = in_camera(width, height, positions, table_from_camera.as_ref())?;
    let measured = |p: &[f32; 3]| p.iter().all(|c| c.is_finite()) && p[2] > 0.0;
    let metres = positions.iter().map(|p| if measured(p) { p[2] } else { 0.0 }).collect();
    let pixels = colors.unwrap_or_else(|| vec![GREY; positions.len()]);
    let rgb = RgbImage::from_raw(width, height, pixels.into_iter().flatten().collect());
    Ok(View {
        index,
        stamp: None,
        intrinsics,
        rgb: Arc::new(rgb.ok_or_else(|| format!("there is not one colour for each of {width} x {height} points"))?),
        depth: Arc::new(DepthImage { width, height, metres }),
        pose: evidence(table_from_camera, OF_ROBOTS),
        labels: None,
        truth: None,
    })
}

/// The camera of a cloud and its points in the camera's frame; they may be in the table frame where the pose is known.
pub(crate) fn in_camera(
    width: u32,
    height: u32,
    positions: Vec<[f32; 3]>,
    table_from_camera: Option<&Isometry3<f64>>,
) -> Result<(Intrinsics, Vec<[f32; 3]>), String> {
    let as_they_are = pinhole(width, height, &positions);
    let Some(table_from_camera) = table_from_camera else { return Ok((as_they_are?.intrinsics, positions)) };
    let brought = |p: &[f32; 3]| {
        let point = table_from_camera.inverse_transform_point(&Point3::from(p.map(f64::from)));
        point.coords.cast::<f32>().into()
    };
    let moved: Vec<[f32; 3]> = positions.iter().map(brought).collect();
    match (as_they_are, pinhole(width, height, &moved)) {
        (Ok(FittedPinhole { off, .. }), Ok(better)) if better.off < off => Ok((better.intrinsics, moved)),
        (Err(_), Ok(fitted)) => Ok((fitted.intrinsics, moved)),
        (as_they_are, _) => Ok((as_they_are?.intrinsics, positions)),
    }
}

/// The viewpoint as the camera's pose, in metres.
fn pose(viewpoint: &Viewpoint, unit: LengthUnit) -> Isometry3<f64> {
    let [x, y, z] = viewpoint.translation.map(|c| c * unit.in_metres());
    let [qw, qx, qy, qz] = viewpoint.rotation;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

/// Whether the viewpoints that files state are poses: they are where they differ. One that all of several files share is a
/// convention of who wrote them (drivers of OpenNI state half a turn about x), and so is the identity.
fn are_poses(stated: impl Iterator<Item = Option<[f64; 7]>>) -> bool {
    let stated: Vec<[f64; 7]> = stated.map(|one| one.unwrap_or(IDENTITY)).collect();
    match stated.as_slice() {
        [] => false,
        [one] => *one != IDENTITY,
        [first, others @ ..] => others.iter().any(|other| other != first),
    }
}

/// The viewpoint that a file's header states.
fn viewpoint(path: &Path) -> Option<[f64; 7]> {
    let mut head = [0; HEAD];
    let read = regular_file::open(path).and_then(|mut file| file.read(&mut head)).ok()?;
    let text = String::from_utf8_lossy(head.get(..read)?);
    let words = text.lines().find_map(|line| line.trim().strip_prefix("VIEWPOINT "))?;
    let numbers: Vec<f64> = words.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_perception::view::PoseEvidence;

    #[test]
    fn viewpoints_are_poses_only_where_they_differ() {
        let turned = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let poses = |stated: &[[f64; 7]]| are_poses(stated.iter().copied().map(Some));
        assert!(
            !poses(&[]) && !poses(&[IDENTITY]) && !poses(&[turned, turned]) && !are_poses([None, None].into_iter())
        );
        assert!(poses(&[turned]) && poses(&[IDENTITY, turned]) && are_poses([None, Some(turned)].into_iter()));
    }

    const CAMERA: Intrinsics = Intrinsics { width: 40, height: 30, fx: 52.5, fy: 53.0, cx: 19.2, cy: 14.9 };

    /// What `CAMERA` sees of a slanted wall, every seventh pixel without depth, as an ascii PCD file.
    fn picture(shift: f32) -> String {
        let mut out = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 40\nHEIGHT 30\n\
                       VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1200\nDATA ascii\n"
            .to_owned();
        for i in 0..1200_u32 {
            let (u, v) = (f64::from(i % 40), f64::from(i / 40));
            let p = CAMERA.unproject(u, v, 0.8 + 0.01 * u).cast::<f32>();
            let x = p.x + shift * (i % 5) as f32;
            out += &if i % 7 == 0 { "nan nan nan\n".to_owned() } else { format!("{x} {} {}\n", p.y, p.z) };
        }
        out
    }

    #[test]
    fn a_folder_of_clouds_is_a_source_of_views_without_poses() {
        let folder = tempfile::tempdir().expect("folder");
        std::fs::write(folder.path().join("b.pcd"), picture(0.0)).expect("written");
        std::fs::write(folder.path().join("a.pcd"), picture(0.05)).expect("written");
        std::fs::write(folder.path().join("notes.txt"), "no cloud").expect("written");
        assert!(PcdSource::is_source(folder.path()));
        let mut source = PcdSource::open(folder.path(), &OpenOptions::default()).expect("opens");
        assert_eq!(source.info().view_count, Some(2));
        let bent = source.next_view().expect("first").expect_err("no pinhole");
        assert!(bent.to_string().contains("a.pcd") && bent.to_string().contains("pinhole"), "{bent}");
        let view = source.next_view().expect("second").expect("a picture");
        let k = view.intrinsics;
        let off = [k.fx - CAMERA.fx, k.fy - CAMERA.fy, k.cx - CAMERA.cx, k.cy - CAMERA.cy];
        assert!(off.iter().all(|d| d.abs() < 1e-3), "{k:?}");
        assert_eq!((view.index, view.pose, view.depth.at(7, 0)), (1, PoseEvidence::None, None));
        assert!((view.depth.at(8, 1).expect("depth") - 0.88).abs() < 1e-6);
        assert!(source.next_view().is_none());
    }

    #[test]
    fn the_unit_is_assumed_from_the_distance_or_said() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a.pcd");
        let (head, points) =
            picture(0.0).split_once("ascii\n").map(|(h, p)| (format!("{h}ascii\n"), p.to_owned())).expect("a file");
        let millimetres = |line: &str| {
            let numbers = line.split(' ').map(|w| (w.parse::<f64>().expect("a number") * 1e3).to_string());
            numbers.collect::<Vec<_>>().join(" ") + "\n"
        };
        std::fs::write(&file, head + &points.lines().map(millimetres).collect::<String>()).expect("written");
        let depth = |unit| {
            let mut source = PcdSource::open(&file, &OpenOptions { unit, ..OpenOptions::default() }).expect("opens");
            let setting = source.info().settings[0].1.clone();
            (source.next_view().expect("a view").expect("a picture").depth.at(8, 1).expect("depth"), setting)
        };
        let (assumed, setting) = depth(None);
        assert!((assumed - 0.88).abs() < 1e-5 && setting == "mm, assumed from the distances", "{assumed} {setting}");
        let (said, setting) = depth(Some(LengthUnit::Centimetres));
        assert!((said - 8.8).abs() < 1e-4 && setting == "cm, as said", "{said} {setting}");
        let options = crate::OpenOptions { unit: Some(LengthUnit::Inches), ..Default::default() };
        let source = crate::open(file.to_str().expect("UTF-8"), options).expect("opens");
        assert_eq!(source.info().settings[0].1, "inch, as said");
    }

    #[test]
    fn viewpoints_are_poses_whichever_frame_the_points_are_in() {
        let folder = tempfile::tempdir().expect("a folder");
        let turned = Isometry3::new(nalgebra::Vector3::new(0.3, -0.2, 0.1), nalgebra::Vector3::new(0.1, 0.6, -0.2));
        let (t, q) = (turned.translation, turned.rotation.coords);
        let stated = format!("VIEWPOINT {} {} {} {} {} {} {}\n", t.x, t.y, t.z, q.w, q.x, q.y, q.z);
        let cloud = picture(0.0);
        let (head, points) = cloud.split_once("DATA ascii\n").expect("a file");
        let in_table = |line: &str| {
            let numbers: Vec<f64> = line.split(' ').map(|w| w.parse().expect("a number")).collect();
            let p = turned * Point3::new(numbers[0], numbers[1], numbers[2]);
            format!("{} {} {}\n", p.x, p.y, p.z)
        };
        let head = head.replace("VIEWPOINT 0 0 0 1 0 0 0\n", &stated) + "DATA ascii\n";
        let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).expect("written");
        write("a.pcd", cloud.clone());
        write("b.pcd", format!("{head}{points}"));
        write("c.pcd", head + &points.lines().map(in_table).collect::<String>());
        let mut source = PcdSource::open(folder.path(), &OpenOptions::default()).expect("opens");
        for expected in [Isometry3::identity(), turned, turned] {
            let view = source.next_view().expect("a view").expect("a picture");
            let off = view.pose.table_from_camera().expect("a pose").inverse() * expected;
            assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-6);
            assert!((view.depth.at(8, 1).expect("depth") - 0.88).abs() < 1e-5);
            assert!((view.intrinsics.fx - CAMERA.fx).abs() < 0.01, "{:?}", view.intrinsics);
        }
        let every = OpenOptions { every: 2, ..OpenOptions::default() };
        assert_eq!(PcdSource::open(folder.path(), &every).expect("opens").info().view_count, Some(2));
    }
}
