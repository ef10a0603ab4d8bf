//! Views of a colour and depth camera as points where the camera stood: `RawImage`s with the `CameraCalibration` and the transforms
//! that were there before the next depth picture came.

use crate::frames::Frames;
use crate::grid::Grid;
use glam::{DAffine3, DVec3};
use prost_types::Timestamp;
use semascan_foxglove_schema::{CameraCalibration, FrameTransform, RawImage};
use std::collections::{BTreeMap, VecDeque};

/// Colour of a point that no colour picture shows.
const GREY: [u8; 3] = [0xb4, 0xb8, 0xbe];
/// Farthest that is shown, metres: beyond, depth cameras guess.
const FARTHEST: f64 = 10.0;
/// Every so many columns and rows tell how far a view looks.
const PROBE: usize = 8;
/// Longest time between a colour and a depth picture of one view, seconds.
const TOGETHER: f64 = 0.1;
/// Colour pictures among which that of a depth picture is looked for.
const KEPT_COLORS: usize = 3;

/// The views of a recording as they come.
#[derive(Debug, Default)]
pub(crate) struct Views {
    pub(crate) frames: Frames,
    /// By the frame of the camera.
    calibrations: BTreeMap<String, CameraCalibration>,
    colors: VecDeque<RawImage>,
    /// A depth picture whose transforms may still come.
    depth: Option<RawImage>,
    /// The first depth picture whose frame has no place: alone it needs none.
    placeless: Option<RawImage>,
    pub(crate) grid: Grid,
    /// Depth pictures that are shown.
    pub(crate) shown: u32,
    /// Those whose frame has no place.
    pub(crate) nowhere: u32,
    /// Those without a calibration, or whose bytes are not those of their encoding.
    pub(crate) unusable: u32,
    /// Whether a camera that was used has a lens: it is not undone.
    pub(crate) is_distorted: bool,
}

impl Views {
    /// A camera is calibrated.
    pub(crate) fn calibrate(&mut self, calibration: CameraCalibration) {
        self.calibrations.insert(calibration.frame_id.clone(), calibration);
    }

    /// A frame has a place. One that is later than the depth picture that waits says nothing of it.
    pub(crate) fn place(&mut self, transform: &FrameTransform) {
        let later = |depth: &RawImage| seconds(transform.timestamp.as_ref()) > seconds(depth.timestamp.as_ref());
        if self.depth.as_ref().is_some_and(later) {
            self.end_view();
        }
        self.frames.place(transform);
    }

    /// A picture has come.
    pub(crate) fn picture(&mut self, picture: RawImage) {
        if is_depth(&picture) {
            self.end_view();
            self.depth = Some(picture);
            return;
        }
        if self.colors.len() == KEPT_COLORS {
            self.colors.pop_front();
        }
        self.colors.push_back(picture);
    }

    /// There is no more. A single view needs no place; the last one of a file that was cut may have been about to get another one.
    pub(crate) fn end(&mut self, is_cut: bool) {
        match is_cut {
            true => self.depth = None,
            false => self.end_view(),
        }
        if let Some(depth) = self.placeless.take().filter(|_| self.shown == 0 && self.nowhere == 1) {
            self.nowhere = 0;
            self.show(&depth, DAffine3::IDENTITY);
        }
    }

    /// The depth picture that waits is placed by what is known by now.
    fn end_view(&mut self) {
        let Some(depth) = self.depth.take() else { return };
        match self.frames.shown_from(&depth.frame_id) {
            Some(pose) => self.show(&depth, pose),
            None => {
                self.nowhere += 1;
                self.placeless.get_or_insert(depth);
            }
        }
    }

    /// The points of a depth picture.
    fn show(&mut self, depth: &RawImage, pose: DAffine3) {
        let Some(camera) = self.camera(depth) else {
            self.unusable += 1;
            return;
        };
        self.is_distorted |= camera.is_distorted;
        let time = seconds(depth.timestamp.as_ref());
        let off = |color: &RawImage| (seconds(color.timestamp.as_ref()) - time).abs();
        let nearest = self.colors.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let color = nearest.filter(|color| off(color) <= TOGETHER && shows_the_same(color, depth));
        let mut distances: Vec<f64> = (0..depth.height)
            .step_by(PROBE)
            .flat_map(|row| (0..depth.width).step_by(PROBE).map(move |column| (column, row)))
            .filter_map(|(column, row)| metres(depth, column, row))
            .filter(|z| *z > 0.0 && *z < FARTHEST)
            .collect();
        distances.sort_by(f64::total_cmp);
        self.grid.begin(distances.get(distances.len() / 2).map_or(f64::NAN, |z| z / camera.fx));
        for row in 0..depth.height {
            for column in 0..depth.width {
                let Some(z) = metres(depth, column, row).filter(|z| *z > 0.0 && *z < FARTHEST) else { continue };
                let point = DVec3::new(
                    (f64::from(column) - camera.cx) / camera.fx * z,
                    (f64::from(row) - camera.cy) / camera.fy * z,
                    z,
                );
                let shown = color.and_then(|color| {
                    let scale =
                        |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from.max(1))) as u32;
                    rgb(color, scale(column, depth.width, color.width), scale(row, depth.height, color.height))
                });
                self.grid.add(pose.transform_point3(point), shown.unwrap_or(GREY), self.shown);
            }
        }
        self.shown += 1;
    }

    /// The camera of a depth picture: that of its frame, or the only one; `None` where it has none that fits.
    fn camera(&self, depth: &RawImage) -> Option<Camera> {
        let only = || self.calibrations.values().next().filter(|_| self.calibrations.len() == 1);
        let calibration = self.calibrations.get(&depth.frame_id).or_else(only)?;
        let [fx, _, cx, _, fy, cy, ..] = calibration.k[..] else { return None };
        let scale = f64::from(depth.width) / f64::from(calibration.width.max(1));
        let is_distorted = calibration.d.iter().any(|coefficient| *coefficient != 0.0);
        let camera = Camera { fx: fx * scale, fy: fy * scale, cx: cx * scale, cy: cy * scale, is_distorted };
        let is_one = camera.fx > 0.0 && camera.fy > 0.0 && camera.cx.is_finite() && camera.cy.is_finite();
        let rows = u64::from(depth.step) * u64::from(depth.height);
        let is_whole = depth.width > 0
            && depth.data.len() as u64 >= rows
            && u64::from(depth.step) >= u64::from(depth.width) * bytes_of_depth(&depth.encoding).unwrap_or(8);
        (is_one && is_whole).then_some(camera)
    }
}

/// A pinhole, pixels, and whether there is a lens before it.
#[derive(Clone, Copy, Debug)]
struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    is_distorted: bool,
}

fn is_depth(picture: &RawImage) -> bool {
    bytes_of_depth(&picture.encoding).is_some()
}

/// Bytes of a depth; `None` for what is no depth.
fn bytes_of_depth(encoding: &str) -> Option<u64> {
    match encoding {
        "32FC1" => Some(4),
        "16UC1" | "mono16" => Some(2),
        _ => None,
    }
}

/// Depth in metres: floats are metres, integers millimetres, as everywhere in ROS.
fn metres(depth: &RawImage, column: u32, row: u32) -> Option<f64> {
    let line = depth.data.get(row as usize * depth.step as usize..)?;
    if depth.encoding == "32FC1" {
        let bytes = line.get(column as usize * 4..)?.first_chunk::<4>()?;
        return Some(f64::from(f32::from_le_bytes(*bytes)));
    }
    let bytes = line.get(column as usize * 2..)?.first_chunk::<2>()?;
    Some(f64::from(u16::from_le_bytes(*bytes)) * 1e-3)
}

/// Colour of a pixel; `None` in an encoding that is not read.
fn rgb(color: &RawImage, column: u32, row: u32) -> Option<[u8; 3]> {
    let (bytes, order) = match color.encoding.as_str() {
        "rgb8" | "8UC3" => (3, [0, 1, 2]),
        "bgr8" => (3, [2, 1, 0]),
        "rgba8" => (4, [0, 1, 2]),
        "bgra8" => (4, [2, 1, 0]),
        "mono8" | "8UC1" => (1, [0; 3]),
        _ => return None,
    };
    let start = row as usize * color.step as usize + column as usize * bytes;
    let pixel = color.data.get(start..start + bytes)?;
    Some(order.map(|channel| pixel[channel]))
}

/// Whether a colour picture is one of the same camera at another size.
fn shows_the_same(color: &RawImage, depth: &RawImage) -> bool {
    let shape = |picture: &RawImage| f64::from(picture.width) / f64::from(picture.height.max(1));
    color.frame_id == depth.frame_id && (shape(color) / shape(depth) - 1.0).abs() < 0.01
}

fn seconds(timestamp: Option<&Timestamp>) -> f64 {
    timestamp.map_or(0.0, |at| at.seconds as f64 + f64::from(at.nanos) * 1e-9)
}
