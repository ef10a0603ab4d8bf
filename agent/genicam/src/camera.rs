//! A GenICam camera by aravis: a camera with a range component, or one of colours and one of depth.

use crate::options::{GenicamOptions, Trigger};
use crate::pixels::{PixelFormat, Range};
use aravis::prelude::*;
use aravis::{AcquisitionMode, Auto, Buffer, BufferPayloadType, BufferStatus, FakeInterface, GvStreamOption, Stream};
use image::RgbImage;
use semascan_perception::view::{DepthImage, Intrinsics};
use semascan_sources::camera::{Camera, CameraError, Capture, DepthCamera};
use semascan_sources::camera_model::{CameraModel, Distortion};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Buffers that frames are received into.
const BUFFERS: usize = 4;
/// What the names of aravis' cameras that are software begin with.
const FAKE: &str = "Fake_";
/// The components that are taken of a camera that has several.
const COMPONENTS: [&str; 2] = ["Intensity", "Range"];

/// The lenses that a folder describes.
type Calibration = (CameraModel, Option<DepthCamera>);

/// One or two devices that send.
pub struct GenicamCamera {
    color: Eye,
    /// A second camera; `None` where the first one sends range, too.
    depth: Option<Eye>,
    range: Range,
    color_camera: CameraModel,
    depth_camera: Option<DepthCamera>,
    /// Whether each capture triggers the cameras.
    triggers: bool,
    description: Vec<(String, String)>,
}

/// A device that sends.
struct Eye {
    name: String,
    camera: aravis::Camera,
    stream: Stream,
    /// Set by aravis when the camera does not answer its heartbeat.
    is_lost: Arc<AtomicBool>,
}

/// A picture of a frame, as it came.
struct Picture {
    format: PixelFormat,
    size: (u32, u32),
    bytes: Vec<u8>,
}

impl GenicamCamera {
    /// Connects to the cameras, sets them and lets them send. Lenses are those of `calibration`, else of `intrinsics` (fx, fy, cx,
    /// cy), else those that the camera states.
    ///
    /// # Errors
    /// Why that is not possible.
    pub fn connect(
        wanted: &GenicamOptions,
        calibration: Option<&Calibration>,
        intrinsics: Option<[f64; 4]>,
    ) -> Result<Self, String> {
        let color = device(&wanted.name)?;
        let mut description = vec![("camera".to_owned(), describe(&color))];
        description.extend(set(&color, wanted, wanted.pixel_format.as_deref())?);
        if wanted.depth.is_none() {
            enable_components(&color);
        }
        let depth = wanted.depth.as_deref().map(device).transpose()?;
        if let Some(depth) = &depth {
            description.push(("depth_camera".to_owned(), describe(depth)));
            description.extend(set(depth, wanted, wanted.depth_format.as_deref())?);
        }
        let measures = depth.as_ref().unwrap_or(&color);
        let range = range(measures, wanted.depth_unit_mm)?;
        description.push(("depth_unit".to_owned(), format!("{:.4} mm", 1e3 * range.unit)));
        let of_color = size(&color)?;
        let (color_camera, of_depth) = match (calibration, intrinsics) {
            (Some((color_camera, of_depth)), _) => (color_camera.clone(), of_depth.clone()),
            (None, _) if depth.is_some() => {
                return Err(
                    "of two cameras nothing says where they are to each other: cameras=FOLDER describes them".into()
                );
            }
            (None, Some(numbers)) => (pinhole(of_color, numbers)?, None),
            (None, None) => (pinhole(of_color, stated_lens(&color)?)?, None),
        };
        if depth.is_some() && of_depth.is_none() {
            return Err("cameras: the folder has no depth_intrinsic.json, which describes the second camera".to_owned());
        }
        let start = |camera: aravis::Camera, name: &str| Eye::start(camera, name);
        Ok(Self {
            color: start(color, &wanted.name)?,
            depth: depth.zip(wanted.depth.as_deref()).map(|(camera, name)| start(camera, name)).transpose()?,
            range,
            color_camera,
            depth_camera: of_depth,
            triggers: wanted.trigger == Trigger::Software,
            description,
        })
    }

    /// The pictures of a frame of a camera that sends colours and range together.
    fn of_components(&self, pictures: &[Picture]) -> Result<(RgbImage, DepthImage), String> {
        let range = pictures.iter().find(|picture| picture.format.is_range());
        let color = pictures.iter().find(|picture| !picture.format.is_range());
        match (color, range) {
            (Some(color), Some(depth)) => Ok((color.color()?, depth.depth(self.range)?)),
            _ => {
                let sent: Vec<String> = pictures.iter().map(|picture| format!("{:?}", picture.format)).collect();
                Err(format!(
                    "the camera sends {} and not colours and range: depth=NAME names a second camera that measures depth",
                    sent.join(", ")
                ))
            }
        }
    }
}

impl Camera for GenicamCamera {
    fn description(&self) -> Vec<(String, String)> {
        self.description.clone()
    }

    fn capture(&mut self, patience: Duration) -> Result<Option<Capture>, CameraError> {
        let eyes = || std::iter::once(&self.color).chain(&self.depth);
        for eye in eyes() {
            eye.forget_what_waits();
        }
        if self.triggers {
            for eye in eyes() {
                eye.camera.software_trigger().map_err(|error| eye.lost(&error))?;
            }
        }
        let asked = Instant::now();
        let left = || patience.saturating_sub(asked.elapsed());
        let Some(color) = self.color.next(left())? else { return Ok(None) };
        let pictures = match &self.depth {
            None => self.of_components(&color),
            Some(eye) => {
                let Some(depth) = eye.next(left())? else { return Ok(None) };
                let first = |pictures: Vec<Picture>| pictures.into_iter().next().ok_or("an empty frame".to_owned());
                first(color).and_then(|color| Ok((color.color()?, first(depth)?.depth(self.range)?)))
            }
        };
        let (color, depth) = pictures.map_err(CameraError::Unusable)?;
        Ok(Some(Capture {
            stamp: None,
            color,
            color_camera: self.color_camera.clone(),
            depth,
            depth_camera: self.depth_camera.clone(),
        }))
    }
}

impl Picture {
    fn color(&self) -> Result<RgbImage, String> {
        self.format.color(&self.bytes, self.size)
    }

    fn depth(&self, range: Range) -> Result<DepthImage, String> {
        self.format.depth(&self.bytes, self.size, range)
    }
}

impl Eye {
    fn start(camera: aravis::Camera, name: &str) -> Result<Self, String> {
        let failed = |error: aravis::glib::Error| format!("{name:?}: {error}");
        if camera.is_gv_device() {
            // Raw packets need rights that an agent has no other use for, and where it has them give nothing on loopback.
            camera.gv_set_stream_options(GvStreamOption::PACKET_SOCKET_DISABLED);
        }
        let payload = camera.payload().map_err(failed)?;
        let stream = camera.create_stream().map_err(failed)?;
        for _ in 0..BUFFERS {
            stream.push_buffer(Buffer::new_allocate(payload as usize));
        }
        camera.set_acquisition_mode(AcquisitionMode::Continuous).map_err(failed)?;
        let is_lost = Arc::<AtomicBool>::default();
        if let Some(device) = camera.device() {
            let noted = Arc::clone(&is_lost);
            device.connect_control_lost(move |_| noted.store(true, Ordering::Relaxed));
        }
        camera.start_acquisition().map_err(failed)?;
        Ok(Self { name: name.to_owned(), camera, stream, is_lost })
    }

    fn lost(&self, error: &aravis::glib::Error) -> CameraError {
        CameraError::Lost(format!("{:?}: {error}", self.name))
    }

    /// Frames that were taken before the question.
    fn forget_what_waits(&self) {
        for _ in 0..BUFFERS {
            let Some(buffer) = self.stream.try_pop_buffer() else { break };
            self.stream.push_buffer(buffer);
        }
    }

    /// The pictures of the next frame; `None` if none comes in time.
    fn next(&self, patience: Duration) -> Result<Option<Vec<Picture>>, CameraError> {
        let microseconds = u64::try_from(patience.as_micros()).unwrap_or(u64::MAX);
        let Some(buffer) = self.stream.timeout_pop_buffer(microseconds) else {
            if self.is_lost.load(Ordering::Relaxed) {
                return Err(CameraError::Lost(format!("{:?} does not answer any more", self.name)));
            }
            return Ok(None);
        };
        let pictures = match buffer.status() {
            BufferStatus::Success => pictures(&buffer).map_err(CameraError::Unusable),
            // What was cleared was waiting when acquisition began or ended.
            BufferStatus::Cleared | BufferStatus::Aborted => Ok(Vec::new()),
            status => Err(CameraError::Unusable(format!("a frame of {:?} is not whole: {status:?}", self.name))),
        };
        self.stream.push_buffer(buffer);
        pictures.map(|pictures| (!pictures.is_empty()).then_some(pictures))
    }
}

impl Drop for Eye {
    fn drop(&mut self) {
        // A camera that is gone has nothing to end.
        let _ = self.camera.stop_acquisition();
    }
}

/// The pictures in a buffer whose frame is whole.
fn pictures(buffer: &Buffer) -> Result<Vec<Picture>, String> {
    let edge = |pixels: i32| u32::try_from(pixels).unwrap_or(0);
    let format =
        |number: u32| PixelFormat::of(number).ok_or_else(|| format!("pixels of format {number:#010x} are not read"));
    if buffer.payload_type() == BufferPayloadType::Multipart {
        let picture = |part: u32| {
            let size = (edge(buffer.part_width(part)), edge(buffer.part_height(part)));
            Ok(Picture { format: format(buffer.part_pixel_format(part).raw())?, size, bytes: buffer.part_data(part) })
        };
        return (0..buffer.n_parts()).map(picture).collect();
    }
    let size = (edge(buffer.image_width()), edge(buffer.image_height()));
    let format = format(buffer.image_pixel_format().raw())?;
    Ok(vec![Picture { format, size, bytes: buffer.image_data() }])
}

/// The camera of this name; any if it is empty.
fn device(name: &str) -> Result<aravis::Camera, String> {
    let failed = |error: aravis::glib::Error| match name {
        "" => format!("no GenICam camera answers: {error}"),
        name => format!("no GenICam camera {name:?} answers: {error}; `arv-tool-0.8` lists those that do"),
    };
    if name.starts_with(FAKE) {
        let interface = FakeInterface::instance().ok_or("aravis has no cameras that are software")?;
        interface.update_device_list();
        let device = interface.open_device(Some(name)).map_err(failed)?;
        return aravis::Camera::with_device(&device).map_err(failed);
    }
    aravis::Camera::new((!name.is_empty()).then_some(name)).map_err(failed)
}

/// What a camera is, for people.
fn describe(camera: &aravis::Camera) -> String {
    let text = |found: Result<aravis::glib::GString, _>| found.map(|text| text.to_string()).unwrap_or_default();
    let names = [text(camera.vendor_name()), text(camera.model_name()), text(camera.device_serial_number())];
    let [vendor, model, serial] = names;
    format!("{vendor} {model}, serial {serial}")
}

/// Sets a camera; what was set, for the record.
fn set(
    camera: &aravis::Camera,
    wanted: &GenicamOptions,
    format: Option<&str>,
) -> Result<Vec<(String, String)>, String> {
    let mut said = Vec::new();
    if let Some(format) = format {
        let known = || camera.dup_available_pixel_formats_as_strings().unwrap_or_default();
        camera.set_pixel_format_from_string(format).map_err(|error| {
            let known: Vec<String> = known().iter().map(ToString::to_string).collect();
            format!("format {format}: {error}; the camera has {}", known.join(", "))
        })?;
        said.push(("pixel_format".to_owned(), format.to_owned()));
    }
    if let Some((width, height)) = wanted.size {
        let failed = |error: aravis::glib::Error| format!("size={width}x{height}: {error}");
        camera.set_region(0, 0, width as i32, height as i32).map_err(failed)?;
        said.push(("size".to_owned(), format!("{width}x{height}")));
    }
    let within = |what: &str, value: f64, bounds: Result<(f64, f64), aravis::glib::Error>| match bounds {
        Ok((least, greatest)) if !(least..=greatest).contains(&value) => {
            Err(format!("{what}={value}: the camera takes {least} to {greatest}"))
        }
        _ => Ok(()),
    };
    if let Some(exposure) = wanted.exposure_us {
        let failed = |error: aravis::glib::Error| format!("exposure_us={exposure}: {error}");
        if camera.is_exposure_auto_available().unwrap_or(false) {
            camera.set_exposure_time_auto(Auto::Off).map_err(failed)?;
        }
        within("exposure_us", exposure, camera.exposure_time_bounds())?;
        camera.set_exposure_time(exposure).map_err(failed)?;
        said.push(("exposure_us".to_owned(), exposure.to_string()));
    }
    if let Some(gain) = wanted.gain {
        let failed = |error: aravis::glib::Error| format!("gain={gain}: {error}");
        if camera.is_gain_auto_available().unwrap_or(false) {
            camera.set_gain_auto(Auto::Off).map_err(failed)?;
        }
        within("gain", gain, camera.gain_bounds())?;
        camera.set_gain(gain).map_err(failed)?;
        said.push(("gain".to_owned(), gain.to_string()));
    }
    let source = match &wanted.trigger {
        Trigger::Free => None,
        Trigger::Software => Some("Software"),
        Trigger::Line(line) => Some(line.as_str()),
    };
    match source {
        // A camera without triggers has none to switch off.
        None => drop(camera.clear_triggers()),
        Some(source) => {
            camera.set_trigger(source).map_err(|error| format!("trigger {source}: {error}"))?;
            said.push(("trigger".to_owned(), source.to_owned()));
        }
    }
    Ok(said)
}

/// Lets a camera send colours and range in one frame, where it has components.
fn enable_components(camera: &aravis::Camera) {
    for component in COMPONENTS {
        if camera.set_string("ComponentSelector", component).is_ok() {
            let _ = camera.set_boolean("ComponentEnable", true);
        }
    }
    if camera.is_gv_device() {
        let _ = camera.gv_set_multipart(true);
    }
}

/// What the numbers of a camera's range are: as asked for, or as its 3D features say.
fn range(camera: &aravis::Camera, unit_mm: Option<f64>) -> Result<Range, String> {
    let _ = camera.set_string("Scan3dCoordinateSelector", "CoordinateC");
    let invalid = camera.boolean("Scan3dInvalidDataFlag").unwrap_or(false);
    let invalid = invalid.then(|| camera.float("Scan3dInvalidDataValue").ok()).flatten();
    if let Some(millimetres) = unit_mm {
        return Ok(Range { unit: millimetres * 1e-3, offset: 0.0, invalid });
    }
    let scale = camera.float("Scan3dCoordinateScale");
    let scale = scale.map_err(|_| "the camera does not say what a depth of 1 is: say depth_unit_mm=MM".to_owned())?;
    let offset = camera.float("Scan3dCoordinateOffset").unwrap_or(0.0);
    let unit = match camera.string("Scan3dDistanceUnit") {
        Err(_) => 1e-3,
        Ok(unit) => match unit.as_str() {
            "Millimeter" => 1e-3,
            "Meter" => 1.0,
            "Inch" => 25.4e-3,
            other => return Err(format!("the camera measures in {other:?}: say depth_unit_mm=MM")),
        },
    };
    let range = Range { unit: scale * unit, offset: offset * unit, invalid };
    if range.unit.is_finite() && range.unit > 0.0 && range.offset.is_finite() {
        Ok(range)
    } else {
        Err(format!("the camera states a scale of {scale} and an offset of {offset}: say depth_unit_mm=MM"))
    }
}

/// Columns and rows of a camera's pictures.
fn size(camera: &aravis::Camera) -> Result<(u32, u32), String> {
    let (_, _, width, height) = camera.region().map_err(|error| error.to_string())?;
    u32::try_from(width).ok().zip(u32::try_from(height).ok()).ok_or_else(|| "its pictures have no size".to_owned())
}

/// fx, fy, cx, cy as a 3D camera states them.
fn stated_lens(camera: &aravis::Camera) -> Result<[f64; 4], String> {
    let stated = |feature: &str| {
        camera.float(feature).map_err(|_| {
            format!("the camera does not state its lens ({feature}): say --intrinsics FX,FY,CX,CY or cameras=FOLDER")
        })
    };
    let focal = stated("Scan3dFocalLength")?;
    Ok([focal, focal, stated("Scan3dPrincipalPointU")?, stated("Scan3dPrincipalPointV")?])
}

fn pinhole((width, height): (u32, u32), [fx, fy, cx, cy]: [f64; 4]) -> Result<CameraModel, String> {
    let camera = CameraModel::new(Intrinsics { width, height, fx, fy, cx, cy }, Distortion::None);
    camera.map_err(|error| format!("its lens cannot be used: {error}"))
}
