//! Organized clouds in PCD files as a source of views: one file, or a folder of them in the order of their names.
//!
//! Such a cloud is a depth picture, but the file does not say by which camera: the pinhole that its points were
//! computed with is read off the points themselves. Nothing is known of where they were taken: most writers leave the
//! header's viewpoint at the identity, so it is not taken for a pose. Nor does it say its unit: that is assumed from how far
//! the points are away, and said.

use image::RgbImage;
use semascan_formats::ReadError;
use semascan_formats::offset::relative;
use semascan_formats::pcd::{self, PcdCloud};
use semascan_formats::unit;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_model::{LengthUnit, Taxonomy};
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, View};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Root mean square distance in pixels between the points' images and their places in the cloud that rounding explains.
const OFF: f64 = 0.5;
/// What is shown where the file has no colours.
const GREY: [u8; 3] = [128; 3];

/// Views from PCD files.
#[derive(Debug)]
pub struct PcdSource {
    info: SourceInfo,
    files: Vec<PathBuf>,
    next: usize,
    unit: LengthUnit,
    /// Whether it has been said that labels are not used.
    labels_said: bool,
}

impl PcdSource {
    /// Whether `path` is a PCD file or a folder that holds one.
    pub fn is_source(path: &Path) -> bool {
        files(path).is_ok_and(|files| !files.is_empty())
    }

    /// Opens a file or folder; the files are read when their views are asked for. Without a `unit`, that of the first file
    /// with points is assumed for all.
    ///
    /// # Errors
    /// [`SourceError`] if the folder cannot be read or holds no PCD file.
    pub fn open(path: &Path, unit: Option<LengthUnit>) -> Result<Self, SourceError> {
        let files = files(path)?;
        if files.is_empty() {
            return Err(SourceError::Format { path: path.to_owned(), reason: "no PCD file in it".into() });
        }
        let assumed = || {
            let distance = files.iter().find_map(|file| median_distance(&pcd::read_file(file).ok()?))?;
            let unit = unit::of_distance(distance);
            tracing::warn!(
                "{}: the points are {distance:.3} away, so one unit is taken for 1 {}: say another with --unit",
                path.display(),
                unit.name()
            );
            Some(unit)
        };
        let setting = match unit {
            Some(_) => "as said",
            None => "assumed from the distances",
        };
        // Where no file has a point there is nothing to scale.
        let unit = unit.or_else(assumed).unwrap_or(LengthUnit::Metres);
        let info = SourceInfo {
            uri: path.display().to_string(),
            part: path.file_stem().map_or("cloud".into(), |n| n.to_string_lossy().into_owned()),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: Some(files.len() as u32),
            turntable: None,
            volume: None,
            no_labels: Some("labels of PCD files are not read".into()),
            settings: vec![("unit".into(), format!("{}, {setting}", unit.name()))],
        };
        Ok(Self { info, files, next: 0, unit, labels_said: false })
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
        let cloud = match pcd::read_file(path) {
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
        let view = view(index, cloud, self.unit);
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

/// The PCD files that `path` means, by name.
fn files(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let is_pcd = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pcd")) && p.is_file();
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
fn view(index: u32, cloud: PcdCloud, unit: LengthUnit) -> Result<View, String> {
    let PcdCloud { width, height, positions, colors, .. } = cloud;
    let positions = relative(&positions, unit.in_metres(), [0.0; 3]);
    let intrinsics = pinhole(width, height, &positions)?;
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
        pose: PoseEvidence::None,
        labels: None,
        truth: None,
    })
}

/// The camera that sees each point in the pixel of its place in the cloud: a least-squares line through the pixels' columns
/// over `x / z`, and one through their rows over `y / z`.
pub(crate) fn pinhole(width: u32, height: u32, positions: &[[f32; 3]]) -> Result<Intrinsics, String> {
    if width < 2 || height < 2 {
        return Err(format!("{width} x {height} points: the cloud is not organized, so it is no picture"));
    }
    let (mut columns, mut rows) = (Line::default(), Line::default());
    for (i, [x, y, z]) in positions.iter().map(|p| p.map(f64::from)).enumerate() {
        if z > 0.0 && x.is_finite() && y.is_finite() && z.is_finite() {
            columns.add(x / z, (i % width as usize) as f64);
            rows.add(y / z, (i / width as usize) as f64);
        }
    }
    let fitted = columns.fit().zip(rows.fit()).filter(|(u, v)| u.slope > 0.0 && v.slope > 0.0);
    let (u, v) = fitted.ok_or("the points show no camera: they are too few, or lie in one row, or face away")?;
    let off = u.residual.hypot(v.residual);
    if off > OFF {
        return Err(format!("the points are not a pinhole camera's picture: {off:.1} pixels off on average"));
    }
    Ok(Intrinsics { width, height, fx: u.slope, fy: v.slope, cx: u.offset, cy: v.offset })
}

/// Sums of a line fit.
#[derive(Default)]
struct Line {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// A fitted line.
struct Fitted {
    slope: f64,
    offset: f64,
    /// Root mean square.
    residual: f64,
}

impl Line {
    fn add(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
    }

    /// `None` where the points are too few or all `x` are the same.
    fn fit(&self) -> Option<Fitted> {
        let (mean_x, mean_y) = (self.x / self.n, self.y / self.n);
        let (xx, xy) = (self.xx / self.n - mean_x * mean_x, self.xy / self.n - mean_x * mean_y);
        let yy = self.yy / self.n - mean_y * mean_y;
        (self.n >= 3.0 && xx > 1e-12).then(|| {
            let slope = xy / xx;
            Fitted { slope, offset: mean_y - slope * mean_x, residual: (yy - slope * xy).max(0.0).sqrt() }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut source = PcdSource::open(folder.path(), None).expect("opens");
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
            let mut source = PcdSource::open(&file, unit).expect("opens");
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
    fn what_is_no_picture_is_refused() {
        let plane = |place: fn(usize) -> [f32; 3]| (0..16).map(place).collect::<Vec<_>>();
        let line = plane(|i| [0.1 * i as f32, 0.0, 1.0]);
        for (width, height, points) in
            [(16, 1, line.clone()), (4, 4, line), (4, 4, vec![[f32::NAN; 3]; 16]), (4, 4, vec![[0.0, 0.0, -1.0]; 16])]
        {
            assert!(pinhole(width, height, &points).is_err());
        }
    }
}
