//! Captures of Zivid cameras (`.zdf`) as a source of views: one file, or a folder of them in the order of their names.
//!
//! A ZDF file is NetCDF-4, and so HDF5: `data/pointcloud` has the points in millimetres, row by row in the grid of the picture,
//! NaN where nothing was measured, and `data/rgba_image` their colours. Both come from one sensor and are aligned. The camera
//! is read off the points, as of other organized clouds ([`crate::pcd`]). Where a file is laid out otherwise, what is in it is
//! named.

use crate::OpenOptions;
use crate::pcd::{CloudFormat, PcdSource, files};
use hdf5_pure::{Dataset, File};
use semascan_formats::pcd::PcdCloud;
use semascan_formats::{ReadError, regular_file};
use semascan_inspection::source::SourceError;
use semascan_model::LengthUnit;
use std::path::Path;

/// Where the points are.
const POINTS: &str = "data/pointcloud";
/// Where colours are, the best first, with the numbers of a pixel.
const COLORS: [(&str, u64); 2] = [("data/rgba_image", 4), ("data/rgb_image", 3)];
/// Most pixels: beyond any of the cameras, and a bound on what a broken file can ask for.
const MOST_PIXELS: u64 = 1 << 25;
/// Most names of a file that are told.
const MOST_NAMES: usize = 40;

const ZDF: CloudFormat =
    CloudFormat { name: "ZDF", ending: "zdf", unit: Some(LengthUnit::Millimetres), read, viewpoint: |_| None };

/// Whether `path` is such a file or a folder that holds one.
pub(crate) fn is_source(path: &Path) -> bool {
    files(path, ZDF.ending).is_ok_and(|files| !files.is_empty())
}

/// Opens a file or folder.
///
/// # Errors
/// [`SourceError`] if the folder cannot be read.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> Result<PcdSource, SourceError> {
    PcdSource::of_format(&ZDF, path, options)
}

/// Reads a file as an organized cloud.
fn read(path: &Path) -> Result<PcdCloud, ReadError> {
    let name = path.display().to_string();
    let bytes = regular_file::read(path).map_err(|source| ReadError::Io { file: name.clone(), source })?;
    cloud(bytes).map_err(|reason| ReadError::Format { file: name, reason: format!("ZDF: {reason}") })
}

fn cloud(bytes: Vec<u8>) -> Result<PcdCloud, String> {
    let file = File::from_bytes(bytes).map_err(|error| error.to_string())?;
    let Ok(points) = file.dataset(POINTS) else {
        return Err(format!("there is no {POINTS} in it, but {}", names(&file)));
    };
    let (height, width) = grid(&points, POINTS, 3)?;
    let numbers = points.read_f32().map_err(|error| format!("{POINTS}: {error}"))?;
    if numbers.len() as u64 != 3 * u64::from(width) * u64::from(height) {
        return Err(format!("{POINTS}: {} numbers for {width} x {height} points", numbers.len()));
    }
    let (numbers, _) = numbers.as_chunks::<3>();
    let positions = numbers.iter().map(|p| p.map(f64::from)).collect();
    let colors = colors(&file, (height, width))?;
    let mut warnings = Vec::new();
    if colors.is_none() {
        warnings.push(format!("there is no {} in it, but {}", COLORS[0].0, names(&file)));
    }
    Ok(PcdCloud { width, height, positions, normals: None, colors, labels: None, viewpoint: None, warnings })
}

/// Colours of the points; `None` if the file has none.
fn colors(file: &File, size: (u32, u32)) -> Result<Option<Vec<[u8; 3]>>, String> {
    for (path, channels) in COLORS {
        let Ok(picture) = file.dataset(path) else { continue };
        let (height, width) = grid(&picture, path, channels)?;
        if (height, width) != size {
            return Err(format!("{path}: {width} x {height} pixels, but there are {} x {} points", size.1, size.0));
        }
        let bytes = picture.read_u8().map_err(|error| format!("{path}: {error}"))?;
        if bytes.len() as u64 != channels * u64::from(width) * u64::from(height) {
            return Err(format!("{path}: {} bytes for {width} x {height} pixels", bytes.len()));
        }
        let pixels = bytes.chunks_exact(channels as usize);
        return Ok(Some(pixels.filter_map(|pixel| Some(*pixel.first_chunk::<3>()?)).collect()));
    }
    Ok(None)
}

/// Rows and columns of a picture with `channels` numbers a pixel, before memory is taken for it.
fn grid(dataset: &Dataset, path: &str, channels: u64) -> Result<(u32, u32), String> {
    let shape = dataset.shape().map_err(|error| format!("{path}: {error}"))?;
    let &[height, width, found] = shape.as_slice() else {
        return Err(format!("{path}: not rows, columns and numbers, but {shape:?}"));
    };
    let pixels = height.checked_mul(width).filter(|pixels| (1..=MOST_PIXELS).contains(pixels));
    if found != channels || pixels.is_none() {
        return Err(format!("{path}: not a picture with {channels} numbers a pixel, but {shape:?}"));
    }
    let edge = |length: u64| u32::try_from(length).map_err(|_| format!("{path}: {shape:?} is too large"));
    Ok((edge(height)?, edge(width)?))
}

/// What is in a file: its groups and data sets, two levels deep.
fn names(file: &File) -> String {
    let root = file.root();
    let mut found = root.datasets().unwrap_or_default();
    for name in root.groups().unwrap_or_default().into_iter().take(MOST_NAMES) {
        let inner = file.group(&name).and_then(|group| group.datasets()).unwrap_or_default();
        found.extend(inner.into_iter().map(|dataset| format!("{name}/{dataset}")));
        found.push(format!("{name}/"));
    }
    found.sort();
    let more = found.len().saturating_sub(MOST_NAMES);
    found.truncate(MOST_NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    if found.is_empty() { "nothing".to_owned() } else { format!("{}{more}", found.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgbd_folder::fixtures::{setting, views};
    use hdf5_pure::FileBuilder;
    use proptest::prelude::*;
    use semascan_perception::view::Intrinsics;
    use std::fs;

    const CAMERA: Intrinsics = Intrinsics { width: 24, height: 18, fx: 31.0, fy: 31.5, cx: 11.2, cy: 8.9 };

    /// A capture of a slanted wall, every seventh point not measured, packed as the camera packs it.
    fn capture(points: &str, picture: &str) -> Vec<u8> {
        let point = |i: u32| {
            let (u, v) = (f64::from(i % 24), f64::from(i / 24));
            let p = CAMERA.unproject(u, v, 600.0 + 2.0 * u);
            if i.is_multiple_of(7) { [f32::NAN; 3] } else { [p.x as f32, p.y as f32, p.z as f32] }
        };
        let numbers: Vec<f32> = (0..24 * 18).flat_map(point).collect();
        let bytes: Vec<u8> = (0..24 * 18_u32).flat_map(|i| [(i % 24) as u8, 200, 100, 255]).collect();
        let mut file = FileBuilder::new();
        let mut data = file.create_group("data");
        data.create_dataset(points)
            .with_f32_data(&numbers)
            .with_shape(&[18, 24, 3])
            .with_chunks(&[9, 12, 3])
            .with_shuffle()
            .with_deflate(4);
        data.create_dataset(picture)
            .with_u8_data(&bytes)
            .with_shape(&[18, 24, 4])
            .with_chunks(&[18, 24, 4])
            .with_deflate(4);
        file.add_group(data.finish());
        file.finish().expect("a file")
    }

    #[test]
    fn a_capture_is_a_view_in_metres_with_its_colours() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.zdf");
        fs::write(&file, capture("pointcloud", "rgba_image")).expect("written");
        for path in [folder.path(), &file] {
            let (source, found) = views(path, OpenOptions::default()).expect("views");
            let view = &found[0];
            assert!((view.intrinsics.fx - 31.0).abs() < 1e-2, "{:?}", view.intrinsics);
            assert_eq!((view.depth.at(7, 0), view.rgb.get_pixel(8, 1).0), (None, [8, 200, 100]));
            assert!((view.depth.at(8, 1).expect("depth") - 0.616).abs() < 1e-5);
            assert!(setting(source.as_ref(), "unit").contains("mm"), "{:?}", source.info().settings);
        }
    }

    #[test]
    fn another_layout_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.zdf");
        let refused = |bytes: &[u8]| {
            fs::write(&file, bytes).expect("written");
            views(&file, OpenOptions::default()).err().expect("refused").to_string()
        };
        let error = refused(&capture("xyz", "rgba_image"));
        assert!(error.contains("a.zdf") && error.contains("data/xyz"), "{error}");
        let error = refused(&capture("rgb_image", "pointcloud"));
        assert!(error.contains("data/pointcloud") && error.contains("4]"), "{error}");
        assert!(refused(b"no HDF5 at all").contains("a.zdf"));
        fs::write(&file, capture("pointcloud", "gray")).expect("written");
        let (_, found) = views(&file, OpenOptions::default()).expect("without colours");
        assert_eq!(found[0].rgb.get_pixel(3, 3).0, [128; 3]);
    }

    proptest! {
        #[test]
        fn damaged_captures_are_read_or_refused(
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), keep in 0.0..1.5_f64,
        ) {
            let mut bytes = capture("pointcloud", "rgba_image");
            for (at, mask) in flips {
                let place = at.index(bytes.len());
                bytes[place] ^= mask;
            }
            bytes.truncate((keep * bytes.len() as f64) as usize);
            let _ = cloud(bytes);
        }
    }
}
