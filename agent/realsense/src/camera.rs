//! A RealSense camera: depth and colours of one time, with the numbers of its lenses.

use crate::library::{Device, Devices, Frame, Intrinsics, Queue, Sensor, StreamKind};
use crate::options::{COLOR, DEPTH, RealsenseOptions, SensorSettings};
use crate::streams::{Chosen, choose, color_layout};
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_perception::view::{DepthImage, Intrinsics as Pinhole};
use semascan_sources::camera::{Camera, CameraError, Capture, DepthCamera};
use semascan_sources::camera_model::{CameraModel, DepthEncoding, Distortion};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Frames that wait at most; each is taken out of the camera's own memory.
const WAITING: u32 = 8;
/// Numbers of the sensors' options in librealsense2's `rs_option.h`.
const EXPOSURE: i32 = 3;
const GAIN: i32 = 4;
const AUTO_EXPOSURE: i32 = 10;
const LASER_POWER: i32 = 13;
const DEPTH_UNITS: i32 = 28;
const SYNC_MODE: i32 = 42;
/// Value of the option `SYNC_MODE` that lets another camera or a signal trigger this one.
const SLAVE: f32 = 2.0;

/// A camera that sends.
pub struct RealsenseCamera {
    serial: String,
    description: Vec<(String, String)>,
    devices: Arc<dyn Devices>,
    /// In front of the queue, which they send to: they stop first.
    sensors: Vec<Sensor>,
    queue: Queue,
    tolerance: f64,
    color_camera: CameraModel,
    depth_camera: CameraModel,
    color_from_depth: Isometry3<f64>,
    /// What its model measures, where it is known.
    device: Option<&'static DepthEncoding>,
    /// Metres of a depth of 1, unless a frame says otherwise.
    depth_unit: f64,
    /// The latest frames of either kind that have no pair yet.
    depth: Option<(f64, Frame)>,
    color: Option<(f64, Frame)>,
}

impl RealsenseCamera {
    /// Connects to the camera of `wanted` among `devices`, sets it and lets it send.
    ///
    /// # Errors
    /// Why that is not possible.
    pub fn connect(devices: &Arc<dyn Devices>, wanted: &RealsenseOptions) -> Result<Self, String> {
        let failed = |error: crate::library::Error| error.to_string();
        let device = find(devices.as_ref(), wanted.serial.as_deref())?;
        let mut sensors = device.sensors().map_err(failed)?;
        let [depth, color] = choose(&sensors, wanted)?;
        let sensor = |chosen: Chosen| sensors.get(chosen.sensor).ok_or("its sensor is gone");
        let (depth_sensor, color_sensor) = (sensor(depth)?, sensor(color)?);
        let mut description = vec![(
            "camera".to_owned(),
            format!("{}, serial {}, firmware {}", device.name(), device.serial(), device.firmware()),
        )];
        description.extend(set(depth_sensor, "depth", &wanted.settings[DEPTH])?);
        description.extend(set(color_sensor, "color", &wanted.settings[COLOR])?);
        if wanted.is_triggered {
            set_option(depth_sensor, SYNC_MODE, SLAVE, "trigger=slave")?;
            description.push(("trigger".to_owned(), "by another camera or a signal".to_owned()));
        }
        let depth_unit = depth_sensor.option(DEPTH_UNITS).map(f64::from).filter(|unit| *unit > 0.0);
        let depth_unit = depth_unit.ok_or("the camera does not say what a depth of 1 is")?;
        description.push(("depth_unit".to_owned(), format!("{:.4} mm, as the camera states", 1e3 * depth_unit)));
        let model_name = device.name();
        let encoding = model_name.split_whitespace().find_map(DepthEncoding::of_device);
        description.extend(encoding.map(|device| ("depth_camera".to_owned(), device.to_string())));
        let color_camera = model(&color_sensor.intrinsics(color.profile).map_err(failed)?)?;
        let depth_camera = model(&depth_sensor.intrinsics(depth.profile).map_err(failed)?)?;
        let color_from_depth = depth_sensor.pose_in(depth.profile, color_sensor, color.profile).map_err(failed)?;
        let queue = Queue::new(&device, WAITING).map_err(failed)?;
        for (place, sensor) in sensors.iter_mut().enumerate() {
            let streams: Vec<_> =
                [depth, color].iter().filter(|chosen| chosen.sensor == place).map(|chosen| chosen.profile).collect();
            if !streams.is_empty() {
                sensor.start(&streams, &queue).map_err(failed)?;
            }
        }
        Ok(Self {
            serial: device.serial(),
            description,
            devices: Arc::clone(devices),
            sensors,
            queue,
            tolerance: wanted.tolerance,
            color_camera,
            depth_camera,
            color_from_depth,
            device: encoding,
            depth_unit,
            depth: None,
            color: None,
        })
    }

    /// Takes a frame; gives the pair that it completes.
    fn take(&mut self, frame: Frame) -> Result<Option<(f64, Frame, Frame)>, String> {
        let failed = |error: crate::library::Error| error.to_string();
        let stamp = frame.stamp().map_err(failed)?;
        match frame.kind().map_err(failed)?.0 {
            StreamKind::Depth => self.depth = Some((stamp, frame)),
            StreamKind::Color => self.color = Some((stamp, frame)),
            StreamKind::Other => return Ok(None),
        }
        let offset = self.depth.as_ref().zip(self.color.as_ref()).map(|((depth, _), (color, _))| (depth - color).abs());
        if offset.is_none_or(|offset| offset > self.tolerance) {
            return Ok(None);
        }
        let pair = self.depth.take().zip(self.color.take());
        Ok(pair.map(|((stamp, depth), (_, color))| (stamp, depth, color)))
    }

    /// The pictures of a pair.
    fn pictures(&self, stamp: f64, depth: &Frame, color: &Frame) -> Result<Capture, String> {
        let failed = |error: crate::library::Error| error.to_string();
        let short = || "a frame has fewer bytes than pixels".to_owned();
        let (width, height, bytes) = depth.pixels(2).map_err(failed)?.ok_or_else(short)?;
        let unit = depth.depth_unit().unwrap_or(self.depth_unit);
        let metres = bytes.as_chunks::<2>().0.iter().map(|stored| {
            let stored = f64::from(u16::from_le_bytes(*stored));
            let z = (stored * unit) as f32;
            let is_measured = z > 0.0 && self.device.is_none_or(|device| device.measures(stored, z));
            if is_measured { z } else { 0.0 }
        });
        let depth = DepthImage { width, height, metres: metres.collect() };
        let (bytes_per_pixel, places) =
            color_layout(color.kind().map_err(failed)?.1).ok_or("a colour picture has another format than before")?;
        let (width, height, bytes) = color.pixels(bytes_per_pixel).map_err(failed)?.ok_or_else(short)?;
        let rgb = bytes.chunks_exact(bytes_per_pixel).flat_map(|pixel| places.map(|place| pixel[place]));
        let color = RgbImage::from_raw(width, height, rgb.collect()).ok_or_else(short)?;
        let depth_camera = DepthCamera { model: self.depth_camera.clone(), color_from_depth: self.color_from_depth };
        let color_camera = self.color_camera.clone();
        Ok(Capture { stamp: Some(stamp), color, color_camera, depth, depth_camera: Some(depth_camera) })
    }

    /// Whether it is still plugged in.
    fn is_there(&self) -> bool {
        self.devices.devices().is_ok_and(|devices| devices.iter().any(|device| device.serial() == self.serial))
    }
}

impl Camera for RealsenseCamera {
    fn description(&self) -> Vec<(String, String)> {
        self.description.clone()
    }

    fn capture(&mut self, patience: Duration) -> Result<Option<Capture>, CameraError> {
        let lost = |error: crate::library::Error| CameraError::Lost(error.to_string());
        // What waits was taken before the question.
        (self.depth, self.color) = (None, None);
        for _ in 0..WAITING {
            if self.queue.next(Duration::ZERO).map_err(lost)?.is_none() {
                break;
            }
        }
        let asked = Instant::now();
        while let Some(left) = patience.checked_sub(asked.elapsed()) {
            let Some(frame) = self.queue.next(left).map_err(lost)? else { break };
            if let Some((stamp, depth, color)) = self.take(frame).map_err(CameraError::Unusable)? {
                return self.pictures(stamp, &depth, &color).map(Some).map_err(CameraError::Unusable);
            }
        }
        if self.is_there() { Ok(None) } else { Err(CameraError::Lost("it is not plugged in".to_owned())) }
    }
}

impl Drop for RealsenseCamera {
    fn drop(&mut self) {
        self.sensors.iter_mut().for_each(Sensor::stop);
    }
}

/// The camera with this serial number, or the only one.
fn find(devices: &dyn Devices, serial: Option<&str>) -> Result<Arc<Device>, String> {
    let mut devices = devices.devices().map_err(|error| error.to_string())?;
    let serials: Vec<String> = devices.iter().map(|device| device.serial()).collect();
    let place = match serial {
        Some(serial) => serials.iter().position(|found| found == serial),
        None if serials.len() > 1 => {
            return Err(format!(
                "several cameras are plugged in: say which, as realsense:{}",
                serials.join(", realsense:")
            ));
        }
        None => (!devices.is_empty()).then_some(0),
    };
    let nothing = || match (serial, serials.as_slice()) {
        (_, []) => "no RealSense camera is plugged in".to_owned(),
        (Some(serial), _) => format!("no RealSense camera {serial} is plugged in; there are {}", serials.join(", ")),
        (None, _) => "no RealSense camera can be used".to_owned(),
    };
    place.map(|place| devices.swap_remove(place)).ok_or_else(nothing)
}

/// Sets a sensor; what was set, for the record.
fn set(sensor: &Sensor, name: &str, settings: &SensorSettings) -> Result<Vec<(String, String)>, String> {
    let mut said = Vec::new();
    let SensorSettings { exposure_us, gain, laser_power } = *settings;
    if (exposure_us.is_some() || gain.is_some()) && sensor.option(AUTO_EXPOSURE).is_some() {
        set_option(sensor, AUTO_EXPOSURE, 0.0, "automatic exposure")?;
    }
    // Exposures of colours are in units of 100 us, those of depth in microseconds.
    let unit = if name == "color" { 100.0 } else { 1.0 };
    for (what, option, value, unit) in [
        ("exposure_us", EXPOSURE, exposure_us, unit),
        ("gain", GAIN, gain, 1.0),
        ("laser_power", LASER_POWER, laser_power, 1.0),
    ] {
        let Some(value) = value else { continue };
        set_option(sensor, option, (value / unit) as f32, &format!("{name} {what}={value}"))?;
        said.push((format!("{name}_{what}"), value.to_string()));
    }
    Ok(said)
}

/// Sets an option of a sensor; the error names it and its range.
fn set_option(sensor: &Sensor, option: i32, value: f32, what: &str) -> Result<(), String> {
    if sensor.option(option).is_none() {
        return Err(format!("{what}: the camera has no such setting"));
    }
    let (least, greatest) = sensor.option_range(option).map_err(|error| format!("{what}: {error}"))?;
    if !(least..=greatest).contains(&value) {
        return Err(format!("{what}: the camera takes {least} to {greatest} in its own unit, not {value}"));
    }
    sensor.set_option(option, value).map_err(|error| format!("{what}: {error}"))
}

/// The camera of a lens as librealsense2 describes it. Its Brown-Conrady models are used as ROS' driver does: as one.
fn model(lens: &Intrinsics) -> Result<CameraModel, String> {
    let [k1, k2, p1, p2, _] = lens.coefficients;
    let distortion = match lens.model {
        5 => Distortion::named("equidistant", &[k1, k2, p1, p2]),
        0 | 1 | 2 | 4 => Distortion::named("plumb_bob", &lens.coefficients),
        _ if lens.coefficients == [0.0; 5] => Ok(Distortion::None),
        other => return Err(format!("its lens has the model {other} of librealsense2, which is not known")),
    };
    let [fx, fy, cx, cy] = lens.pinhole;
    let (width, height) = lens.size;
    let camera = distortion.and_then(|d| CameraModel::new(Pinhole { width, height, fx, fy, cx, cy }, d));
    camera.map_err(|error| format!("its lens cannot be used: {error}"))
}
