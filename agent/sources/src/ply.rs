//! Organized clouds in PLY files as a source of views: one file, or a folder of them in the order of their names.
//!
//! As of PCD files ([`crate::pcd`]) the camera is read off the points. The size of the grid and the camera's pose come from the
//! header ([`crate::ply_grid`]). Some writers keep the order of the points but not the grid's size (Zivid Studio): then
//! the widths that divide the number of points are tried, and that for which a pinhole fits is it. So much is tried only for a
//! file that is named itself; in a folder PLY files are mostly models.

use crate::OpenOptions;
use crate::pcd::{CloudFormat, PcdSource, files};
use crate::pinhole_fit::pinhole;
use crate::ply_grid::PlyGrid;
use semascan_formats::pcd::{PcdCloud, Viewpoint};
use semascan_formats::{ReadError, ply, regular_file};
use semascan_inspection::source::SourceError;
use std::io::Read;
use std::path::Path;

/// Bytes of a file in which its header stands.
const HEAD: u64 = 64 << 10;
/// Files of a folder whose headers are looked at.
const LOOKED_AT: usize = 8;
/// Shapes of pictures: columns for a row.
const SHAPES: std::ops::RangeInclusive<f64> = 0.5..=2.6;

const PLY: CloudFormat = CloudFormat { name: "PLY", ending: "ply", unit: None, read, viewpoint };

/// Whether `path` is a file with points and no faces, or a folder with a file that says its grid.
pub(crate) fn is_source(path: &Path) -> bool {
    let is_file = path.is_file();
    let Ok(files) = files(path, PLY.ending) else { return false };
    files.iter().take(LOOKED_AT).filter_map(|file| head(file)).any(|grid| {
        let is_picture = grid.points > 0 && grid.faces == 0 && !grid.has_labels;
        is_picture && (is_file || grid.size.is_some() || grid.has_camera)
    })
}

/// Opens a file or folder.
///
/// # Errors
/// [`SourceError`] if the folder cannot be read.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> Result<PcdSource, SourceError> {
    PcdSource::of_format(&PLY, path, options)
}

/// What a file's header says.
fn head(path: &Path) -> Option<PlyGrid> {
    let mut head = Vec::new();
    regular_file::open(path).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
    PlyGrid::read(&head)
}

/// The viewpoint that a file states.
fn viewpoint(path: &Path) -> Option<[f64; 7]> {
    let grid = regular_file::read(path).ok().and_then(|bytes| PlyGrid::read(&bytes));
    let pose = grid?.viewpoint?;
    let (t, q) = (pose.translation.vector, pose.rotation);
    Some([t.x, t.y, t.z, q.w, q.i, q.j, q.k])
}

/// Reads a file as an organized cloud.
fn read(path: &Path) -> Result<PcdCloud, ReadError> {
    let file = path.display().to_string();
    let bytes = regular_file::read(path).map_err(|source| ReadError::Io { file: file.clone(), source })?;
    let model = ply::read(&file, &bytes)?;
    let grid = PlyGrid::read(&bytes).unwrap_or_default();
    let has_color = model.has("color");
    let positions = model.positions;
    let size = grid.size.or_else(|| fitting_size(&positions));
    // A cloud without order is one row, which the fit of a camera refuses.
    let (width, height) = size.unwrap_or((u32::try_from(positions.len()).unwrap_or(u32::MAX), 1));
    let viewpoint = grid.viewpoint.map(|pose| {
        let (translation, rotation) = (pose.translation.vector, pose.rotation);
        Viewpoint { translation: translation.into(), rotation: [rotation.w, rotation.i, rotation.j, rotation.k] }
    });
    Ok(PcdCloud {
        width,
        height,
        positions,
        normals: None,
        colors: has_color.then_some(model.mesh.vertices.colors),
        labels: None,
        viewpoint,
        warnings: model.warnings,
    })
}

/// The grid for which a pinhole fits best; `None` if none does.
fn fitting_size(positions: &[[f64; 3]]) -> Option<(u32, u32)> {
    let count = u32::try_from(positions.len()).ok()?;
    let single: Vec<[f32; 3]> = positions.iter().map(|p| p.map(|c| c as f32)).collect();
    let (narrowest, widest) = (
        (f64::from(count) * SHAPES.start()).sqrt().floor() as u32,
        (f64::from(count) * SHAPES.end()).sqrt().ceil() as u32,
    );
    let fits = (narrowest.max(2)..=widest).filter(|width| count % width == 0).filter_map(|width| {
        let fitted = pinhole(width, count / width, &single).ok()?;
        Some((fitted.off, (width, count / width)))
    });
    fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, size)| size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgbd_folder::fixtures::{setting, views};
    use nalgebra::Isometry3;
    use semascan_perception::view::Intrinsics;
    use std::fs;

    const CAMERA: Intrinsics = Intrinsics { width: 40, height: 30, fx: 52.5, fy: 53.0, cx: 19.2, cy: 14.9 };

    /// Points of a slanted wall, every seventh not measured, brought by `table_from_camera`.
    fn points(table_from_camera: &Isometry3<f64>) -> String {
        let point = |i: u32| {
            let (u, v) = (f64::from(i % 40), f64::from(i / 40));
            let p = table_from_camera * CAMERA.unproject(u, v, 0.8 + 0.01 * u);
            if i.is_multiple_of(7) {
                "nan nan nan 9 9 9\n".to_owned()
            } else {
                format!("{} {} {} {} 8 7\n", p.x, p.y, p.z, i % 40)
            }
        };
        (0..1200).map(point).collect()
    }

    fn header(more: &str) -> String {
        format!(
            "ply\nformat ascii 1.0\n{more}element vertex 1200\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        )
    }

    #[test]
    fn a_grid_that_is_said_or_that_fits_makes_a_view() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scan.ply");
        for more in ["obj_info num_cols 40\nobj_info num_rows 30\n", ""] {
            fs::write(&file, header(more) + &points(&Isometry3::identity())).expect("written");
            let (source, found) = views(&file, OpenOptions::default()).expect("views");
            let k = found[0].intrinsics;
            assert!((k.width, k.height) == (40, 30) && (k.fx - 52.5).abs() < 1e-2, "{k:?}");
            assert!((found[0].depth.at(8, 1).expect("depth") - 0.88).abs() < 1e-5);
            assert_eq!((found[0].depth.at(7, 0), found[0].rgb.get_pixel(8, 1).0), (None, [8, 8, 7]));
            assert!(setting(source.as_ref(), "unit").contains('m') && setting(source.as_ref(), "poses").is_empty());
        }
        // Without the size a folder of such files may be one of models.
        assert!(!is_source(folder.path()));
        fs::write(&file, header("obj_info num_cols 40\nobj_info num_rows 30\n")).expect("written");
        assert!(is_source(folder.path()));
        let error = views(folder.path(), OpenOptions::default()).err().expect("cut").to_string();
        assert!(error.contains("scan.ply"), "{error}");
    }

    #[test]
    fn the_camera_of_a_file_is_the_pose_of_its_view() {
        let folder = tempfile::tempdir().expect("a folder");
        let pose = Isometry3::new(nalgebra::Vector3::new(0.3, -0.2, 0.1), nalgebra::Vector3::new(0.1, 0.6, -0.2));
        let axes =
            ["x", "y", "z"].map(|axis| ["x", "y", "z"].map(|of| format!("property float {axis}_axis{of}\n")).concat());
        let camera = format!(
            "element camera 1\nproperty float view_px\nproperty float view_py\nproperty float view_pz\n{}\
             property int viewportx\nproperty int viewporty\nend_header\n",
            axes.concat()
        );
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let rows: Vec<String> = rotation.transpose().iter().map(f64::to_string).collect();
        let t = pose.translation;
        let last = format!("{} {} {} {} 40 30\n", t.x, t.y, t.z, rows.join(" "));
        let text = header("").replace("end_header\n", &camera) + &points(&pose) + &last;
        fs::write(folder.path().join("a.ply"), text).expect("written");
        let (source, found) = views(folder.path(), OpenOptions::default()).expect("views");
        let off = found[0].pose.table_from_camera().expect("a pose").inverse() * pose;
        assert!(off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-6);
        assert!((found[0].depth.at(8, 1).expect("depth") - 0.88).abs() < 1e-5);
        assert!(setting(source.as_ref(), "poses").contains("viewpoints"));
    }

    #[test]
    fn models_results_and_clouds_without_order_are_no_views() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("x.ply");
        let mut lines: Vec<String> = points(&Isometry3::identity()).lines().map(|line| format!("{line}\n")).collect();
        lines.sort();
        fs::write(&file, header("") + &lines.concat()).expect("written");
        let error = views(&file, OpenOptions::default()).err().expect("no order").to_string();
        assert!(error.contains("not organized"), "{error}");
        let labelled = header("").replace("end_header", "property ushort label\nend_header");
        let with_faces =
            header("").replace("end_header", "element face 1\nproperty list uchar int vertex_indices\nend_header");
        for text in [labelled, with_faces] {
            fs::write(&file, text).expect("written");
            assert!(!is_source(&file));
        }
    }
}
