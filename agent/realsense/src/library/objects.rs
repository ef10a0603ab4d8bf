//! Objects of librealsense2 that delete themselves. See the folder's head for why they are sound.

use super::functions::{RawExtrinsics, RawIntrinsics};
use super::{Api, Error, Library, text};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use std::ffi::{c_int, c_void};
use std::ptr;
use std::sync::Arc;
use std::time::Duration;

/// Declares an object around a pointer that a function of the library deletes.
macro_rules! owned {
    ($(#[$about:meta])* $visible:vis $name:ident, $delete:ident $(, $field:ident: $of:ty)*) => {
        $(#[$about])*
        $visible struct $name {
            pub(super) pointer: *mut c_void,
            pub(super) api: Arc<Api>,
            $($field: $of,)*
        }

        // The library locks its objects itself, and each is used by one thread at a time.
        unsafe impl Send for $name {}

        impl Drop for $name {
            fn drop(&mut self) {
                // The pointer is this object's alone, and is not used after.
                unsafe { (self.api.functions.$delete)(self.pointer) }
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(stringify!($name))
            }
        }
    };
}
owned!(
    /// What knows the cameras of this machine.
    pub Context, rs2_delete_context
);
owned!(
    /// A camera.
    pub Device, rs2_delete_device
);
owned!(
    /// One of a camera's sensors, which has several streams.
    pub Sensor, rs2_delete_sensor, profiles: ProfileList, is_open: bool, is_started: bool
);
owned!(pub(super) ProfileList, rs2_delete_stream_profiles_list);
owned!(DeviceList, rs2_delete_device_list);
owned!(SensorList, rs2_delete_sensor_list);
owned!(
    /// Where frames wait.
    pub Queue, rs2_delete_frame_queue
);
owned!(
    /// A picture as it came.
    pub Frame, rs2_release_frame
);

// What is asked of contexts and devices that are shared is locked in the library, and changes nothing.
unsafe impl Sync for Context {}
unsafe impl Sync for Device {}

/// What a stream shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamKind {
    /// Depth.
    Depth,
    /// Colours.
    Color,
    /// Something else.
    Other,
}

impl StreamKind {
    fn of(number: c_int) -> Self {
        match number {
            1 => Self::Depth,
            2 => Self::Color,
            _ => Self::Other,
        }
    }
}

/// A stream of a sensor, as it may be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamProfile {
    /// Its place in the sensor's list.
    pub(super) place: c_int,
    /// What it shows.
    pub kind: StreamKind,
    /// The number of its format: 1 is 16-bit depth, 5 to 8 are RGB, BGR, RGBA and BGRA of 8 bits.
    pub format: i32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Pictures a second.
    pub rate: u32,
    /// Whether the camera would choose it.
    pub is_default: bool,
}

/// The lens of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Columns and rows.
    pub size: (u32, u32),
    /// fx, fy, cx, cy, pixels.
    pub pinhole: [f64; 4],
    /// The number of the lens model.
    pub model: i32,
    /// Its coefficients.
    pub coefficients: [f64; 5],
}

impl Context {
    /// The cameras of this machine.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn new(library: &Library) -> Result<Self, Error> {
        let api = Arc::clone(&library.0);
        let pointer = unsafe {
            let version = api.call(|f, error| (f.rs2_get_api_version)(error))?;
            api.call(|f, error| (f.rs2_create_context)(version, error))?
        };
        Ok(Self { pointer, api })
    }
}

/// Where cameras are looked for.
pub trait Devices: Send + Sync {
    /// The cameras that are there now.
    ///
    /// # Errors
    /// [`Error`] of the library.
    fn devices(&self) -> Result<Vec<Arc<Device>>, Error>;
}

impl Devices for Context {
    fn devices(&self) -> Result<Vec<Arc<Device>>, Error> {
        let api = &self.api;
        let pointer = unsafe { api.call(|f, error| (f.rs2_query_devices)(self.pointer, error))? };
        let list = DeviceList { pointer, api: Arc::clone(api) };
        let count = unsafe { api.count(|f, error| (f.rs2_get_device_count)(list.pointer, error))? };
        let device = |place| {
            let pointer = unsafe { api.call(|f, error| (f.rs2_create_device)(list.pointer, place, error))? };
            Ok(Arc::new(Device { pointer, api: Arc::clone(api) }))
        };
        (0..count).map(device).collect()
    }
}

impl Device {
    /// Its name, as `Intel RealSense D435I`; empty where it has none.
    pub fn name(&self) -> String {
        self.info(0)
    }

    /// Its serial number; empty where it has none.
    pub fn serial(&self) -> String {
        self.info(1)
    }

    /// The version of its firmware; empty where it has none.
    pub fn firmware(&self) -> String {
        self.info(2)
    }

    fn info(&self, what: c_int) -> String {
        let found = unsafe {
            match self.api.call(|f, error| (f.rs2_supports_device_info)(self.pointer, what, error)) {
                Ok(0) | Err(_) => return String::new(),
                Ok(_) => self.api.call(|f, error| text((f.rs2_get_device_info)(self.pointer, what, error))),
            }
        };
        found.unwrap_or_default()
    }

    /// Its sensors.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn sensors(&self) -> Result<Vec<Sensor>, Error> {
        let api = &self.api;
        let pointer = unsafe { api.call(|f, error| (f.rs2_query_sensors)(self.pointer, error))? };
        let list = SensorList { pointer, api: Arc::clone(api) };
        let count = unsafe { api.count(|f, error| (f.rs2_get_sensors_count)(list.pointer, error))? };
        let sensor = |place| {
            let pointer = unsafe { api.call(|f, error| (f.rs2_create_sensor)(list.pointer, place, error))? };
            // From here on the sensor is deleted whatever happens.
            let mut sensor = Sensor {
                pointer,
                api: Arc::clone(api),
                profiles: ProfileList { pointer: ptr::null_mut(), api: Arc::clone(api) },
                is_open: false,
                is_started: false,
            };
            sensor.profiles.pointer =
                unsafe { api.call(|f, error| (f.rs2_get_stream_profiles)(sensor.pointer, error))? };
            Ok(sensor)
        };
        (0..count).map(sensor).collect()
    }
}

impl Sensor {
    /// The streams with pictures that it may send.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn profiles(&self) -> Result<Vec<StreamProfile>, Error> {
        let list = self.profiles.pointer;
        let count = unsafe { self.api.count(|f, error| (f.rs2_get_stream_profiles_count)(list, error))? };
        let mut found = Vec::new();
        for place in 0..count {
            let profile = self.profile(place)?;
            let [mut kind, mut format, mut index, mut identifier, mut rate] = [0; 5];
            let (mut width, mut height) = (0, 0);
            let (is_video, is_default) = unsafe {
                self.api.call(|f, error| {
                    (f.rs2_get_stream_profile_data)(
                        profile,
                        &raw mut kind,
                        &raw mut format,
                        &raw mut index,
                        &raw mut identifier,
                        &raw mut rate,
                        error,
                    );
                })?;
                // What has no pictures, such as the streams of a gyroscope, has no size.
                let size = self.api.call(|f, error| {
                    (f.rs2_get_video_stream_resolution)(profile, &raw mut width, &raw mut height, error);
                });
                let is_default = self.api.call(|f, error| (f.rs2_is_stream_profile_default)(profile, error));
                (size.is_ok() && width > 0 && height > 0, is_default.is_ok_and(|is| is != 0))
            };
            if is_video {
                found.push(StreamProfile {
                    place,
                    kind: StreamKind::of(kind),
                    format,
                    size: (width.unsigned_abs(), height.unsigned_abs()),
                    rate: rate.max(0).unsigned_abs(),
                    is_default,
                });
            }
        }
        Ok(found)
    }

    /// The pointer of a profile, which lives as long as the list.
    fn profile(&self, place: c_int) -> Result<*const c_void, Error> {
        unsafe { self.api.call(|f, error| (f.rs2_get_stream_profile)(self.profiles.pointer, place, error)) }
    }

    /// The lens of a stream.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn intrinsics(&self, stream: StreamProfile) -> Result<Intrinsics, Error> {
        let profile = self.profile(stream.place)?;
        let mut raw = RawIntrinsics::default();
        unsafe { self.api.call(|f, error| (f.rs2_get_video_stream_intrinsics)(profile, &raw mut raw, error))? };
        Ok(Intrinsics {
            size: (raw.width.max(0).unsigned_abs(), raw.height.max(0).unsigned_abs()),
            pinhole: [raw.fx, raw.fy, raw.ppx, raw.ppy].map(f64::from),
            model: raw.model,
            coefficients: raw.coefficients.map(f64::from),
        })
    }

    /// Brings points of the frame of `stream` into that of a stream of another (or the same) sensor, metres.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn pose_in(&self, stream: StreamProfile, other: &Self, of: StreamProfile) -> Result<Isometry3<f64>, Error> {
        let (from, to) = (self.profile(stream.place)?, other.profile(of.place)?);
        let mut raw = RawExtrinsics::default();
        unsafe { self.api.call(|f, error| (f.rs2_get_extrinsics)(from, to, &raw mut raw, error))? };
        let rotation = Matrix3::from_column_slice(&raw.rotation.map(f64::from));
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
        let [x, y, z] = raw.translation.map(f64::from);
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }

    /// The value of the option of this number; `None` if the sensor has no such option.
    pub fn option(&self, number: i32) -> Option<f32> {
        let has_it = unsafe { self.api.call(|f, error| (f.rs2_supports_option)(self.pointer, number, error)) };
        if has_it.is_ok_and(|has_it| has_it != 0) {
            unsafe { self.api.call(|f, error| (f.rs2_get_option)(self.pointer, number, error)) }.ok()
        } else {
            None
        }
    }

    /// Least and greatest value of an option.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn option_range(&self, number: i32) -> Result<(f32, f32), Error> {
        let [mut least, mut greatest, mut step, mut default] = [0.0; 4];
        unsafe {
            self.api.call(|f, error| {
                (f.rs2_get_option_range)(
                    self.pointer,
                    number,
                    &raw mut least,
                    &raw mut greatest,
                    &raw mut step,
                    &raw mut default,
                    error,
                );
            })?;
        }
        Ok((least, greatest))
    }

    /// Sets an option.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn set_option(&self, number: i32, value: f32) -> Result<(), Error> {
        unsafe { self.api.call(|f, error| (f.rs2_set_option)(self.pointer, number, value, error)) }
    }

    /// Opens streams and sends their pictures to `queue` until it is dropped.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn start(&mut self, streams: &[StreamProfile], queue: &Queue) -> Result<(), Error> {
        let profiles = streams.iter().map(|stream| self.profile(stream.place)).collect::<Result<Vec<_>, _>>();
        let mut profiles = profiles?;
        let count = profiles.len() as c_int;
        let list = profiles.as_mut_ptr();
        unsafe { self.api.call(|f, error| (f.rs2_open_multiple)(self.pointer, list, count, error))? };
        self.is_open = true;
        // The library holds the queue's memory itself while the sensor sends.
        unsafe { self.api.call(|f, error| (f.rs2_start_queue)(self.pointer, queue.pointer, error))? };
        self.is_started = true;
        Ok(())
    }

    /// Ends what [`start`](Self::start) began; a camera that is gone has nothing to end.
    pub fn stop(&mut self) {
        if std::mem::take(&mut self.is_started) {
            let _ = unsafe { self.api.call(|f, error| (f.rs2_stop)(self.pointer, error)) };
        }
        if std::mem::take(&mut self.is_open) {
            let _ = unsafe { self.api.call(|f, error| (f.rs2_close)(self.pointer, error)) };
        }
    }
}

impl Queue {
    /// A queue of so many frames; when it is full the oldest makes room.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn new(device: &Device, capacity: u32) -> Result<Self, Error> {
        let api = Arc::clone(&device.api);
        let pointer = unsafe { api.call(|f, error| (f.rs2_create_frame_queue)(capacity as c_int, error))? };
        Ok(Self { pointer, api })
    }

    /// The next frame; `None` if none comes within `patience`.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn next(&self, patience: Duration) -> Result<Option<Frame>, Error> {
        let milliseconds = u32::try_from(patience.as_millis()).unwrap_or(u32::MAX);
        let mut pointer = ptr::null_mut();
        let came = unsafe {
            self.api.call(|f, error| (f.rs2_try_wait_for_frame)(self.pointer, milliseconds, &raw mut pointer, error))?
        };
        if came == 0 || pointer.is_null() {
            return Ok(None);
        }
        Ok(Some(Frame { pointer, api: Arc::clone(&self.api) }))
    }
}

impl Frame {
    /// What it shows, and the number of its format.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn kind(&self) -> Result<(StreamKind, i32), Error> {
        let [mut kind, mut format, mut index, mut identifier, mut rate] = [0; 5];
        unsafe {
            let profile = self.api.call(|f, error| (f.rs2_get_frame_stream_profile)(self.pointer, error))?;
            self.api.call(|f, error| {
                (f.rs2_get_stream_profile_data)(
                    profile,
                    &raw mut kind,
                    &raw mut format,
                    &raw mut index,
                    &raw mut identifier,
                    &raw mut rate,
                    error,
                );
            })?;
        }
        Ok((StreamKind::of(kind), format))
    }

    /// When it was taken, seconds.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn stamp(&self) -> Result<f64, Error> {
        let milliseconds = unsafe { self.api.call(|f, error| (f.rs2_get_frame_timestamp)(self.pointer, error))? };
        Ok(milliseconds * 1e-3)
    }

    /// Metres of a depth of 1; `None` if it is no depth.
    pub fn depth_unit(&self) -> Option<f64> {
        let unit = unsafe { self.api.call(|f, error| (f.rs2_depth_frame_get_units)(self.pointer, error)) };
        unit.ok().map(f64::from).filter(|unit| unit.is_finite() && *unit > 0.0)
    }

    /// Columns, rows, and the bytes of its rows without what fills them up, `bytes` a pixel; `None` if it has fewer.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn pixels(&self, bytes: usize) -> Result<Option<(u32, u32, Vec<u8>)>, Error> {
        let frame = self.pointer;
        let (width, height, stride, length, data) = unsafe {
            (
                self.api.count(|f, error| (f.rs2_get_frame_width)(frame, error))?.unsigned_abs(),
                self.api.count(|f, error| (f.rs2_get_frame_height)(frame, error))?.unsigned_abs(),
                self.api.count(|f, error| (f.rs2_get_frame_stride_in_bytes)(frame, error))? as usize,
                self.api.count(|f, error| (f.rs2_get_frame_data_size)(frame, error))? as usize,
                self.api.call(|f, error| (f.rs2_get_frame_data)(frame, error))?,
            )
        };
        let row = width as usize * bytes;
        // Of frames of software the library does not say how many bytes they have.
        let length = if length == 0 { stride * height as usize } else { length };
        if data.is_null() || row == 0 || stride < row || length < stride * height as usize {
            return Ok(None);
        }
        // So many bytes are there while the frame lives.
        let all = unsafe { std::slice::from_raw_parts(data.cast::<u8>(), length) };
        let rows = all.chunks_exact(stride).take(height as usize).flat_map(|line| line.iter().take(row));
        Ok(Some((width, height, rows.copied().collect())))
    }
}
