//! A camera that is software: librealsense2's own stand-in, by which everything can be tried without hardware.

use super::functions::{RawExtrinsics, RawIntrinsics, RawSoftwareFrame, RawVideoStream};
use super::objects::{Device, Devices, Intrinsics, StreamKind};
use super::{Api, Error, Library};
use std::ffi::{CString, c_int, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// Number of the option that says metres of a depth of 1.
const DEPTH_UNITS: c_int = 28;

/// A stream of the camera.
#[derive(Clone, Copy, Debug)]
pub struct SoftwareStream {
    /// What it shows: depth or colours.
    pub kind: StreamKind,
    /// Its lens; the size is that of its pictures.
    pub lens: Intrinsics,
    /// Pictures a second.
    pub rate: u32,
}

/// A camera with a depth and a colour sensor.
pub struct SoftwareDevice {
    device: Arc<Device>,
    /// Sensor and profile of depth, then of colours.
    streams: [(*mut c_void, *mut c_void); 2],
    depth_unit: f32,
    numbers: [c_int; 2],
    api: Arc<Api>,
}

// As the other objects of the library.
unsafe impl Send for SoftwareDevice {}

impl std::fmt::Debug for SoftwareDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SoftwareDevice")
    }
}

impl SoftwareDevice {
    /// A camera of this serial number; the depth camera is `shift` metres from the colour camera, along its x axis.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn new(
        library: &Library,
        serial: &str,
        [depth, color]: [SoftwareStream; 2],
        depth_unit: f32,
        shift: f32,
    ) -> Result<Self, Error> {
        let api = Arc::clone(&library.0);
        let pointer = unsafe { api.call(|f, error| (f.rs2_create_software_device)(error))? };
        let handle = Arc::new(Device { pointer, api: Arc::clone(&api) });
        let streams = [(std::ptr::null_mut(), std::ptr::null_mut()); 2];
        let mut device = Self { device: handle, streams, depth_unit, numbers: [0; 2], api };
        for (number, value) in [(0, "Software D400"), (1, serial)] {
            let value = CString::new(value).unwrap_or_default();
            // The texts are copied by the library.
            unsafe {
                device.api.call(|f, error| {
                    (f.rs2_software_device_register_info)(pointer, number, value.as_ptr(), error);
                })?;
            }
        }
        for (place, stream) in [depth, color].into_iter().enumerate() {
            device.streams[place] = device.add(place as c_int, stream)?;
        }
        let [(depth_sensor, depth_profile), (color_sensor, color_profile)] = device.streams;
        let pose =
            RawExtrinsics { rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], translation: [shift, 0.0, 0.0] };
        unsafe {
            device.api.call(|f, error| {
                (f.rs2_software_sensor_add_read_only_option)(depth_sensor, DEPTH_UNITS, depth_unit, error);
            })?;
            // Exposure, gain and whether they are automatic.
            for (option, greatest, value) in [(3, 1e5, 100.0), (4, 128.0, 16.0), (10, 1.0, 1.0)] {
                device.api.call(|f, error| {
                    (f.rs2_software_sensor_add_option)(color_sensor, option, 0.0, greatest, 1.0, value, 1, error);
                })?;
            }
            device.api.call(|f, error| (f.rs2_register_extrinsics)(depth_profile, color_profile, pose, error))?;
        }
        Ok(device)
    }

    /// Adds a sensor with one stream.
    fn add(&self, place: c_int, stream: SoftwareStream) -> Result<(*mut c_void, *mut c_void), Error> {
        let (name, kind, format, bytes) = match stream.kind {
            StreamKind::Depth => (c"Depth", 1, 1, 2),
            StreamKind::Color | StreamKind::Other => (c"Color", 2, 5, 3),
        };
        let [fx, fy, ppx, ppy] = stream.lens.pinhole.map(|value| value as f32);
        let (width, height) = (stream.lens.size.0 as c_int, stream.lens.size.1 as c_int);
        let intrinsics = RawIntrinsics {
            width,
            height,
            ppx,
            ppy,
            fx,
            fy,
            model: stream.lens.model,
            coefficients: stream.lens.coefficients.map(|value| value as f32),
        };
        let rate = stream.rate as c_int;
        let stream = RawVideoStream {
            kind,
            index: 0,
            identifier: place,
            width,
            height,
            rate,
            bytes_per_pixel: bytes,
            format,
            intrinsics,
        };
        unsafe {
            let sensor = self
                .api
                .call(|f, error| (f.rs2_software_device_add_sensor)(self.device.pointer, name.as_ptr(), error))?;
            let profile = self.api.call(|f, error| (f.rs2_software_sensor_add_video_stream)(sensor, stream, error))?;
            Ok((sensor, profile))
        }
    }

    /// Sends a depth picture, row by row.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn send_depth(&mut self, values: &[u16], width: u32, milliseconds: f64) -> Result<(), Error> {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.send(0, bytes, (width, 2), milliseconds)
    }

    /// Sends a colour picture, row by row.
    ///
    /// # Errors
    /// [`Error`] of the library.
    pub fn send_color(&mut self, rgb: &[u8], width: u32, milliseconds: f64) -> Result<(), Error> {
        self.send(1, rgb.to_vec(), (width, 3), milliseconds)
    }

    fn send(
        &mut self,
        place: usize,
        bytes: Vec<u8>,
        (width, pixel): (u32, u32),
        milliseconds: f64,
    ) -> Result<(), Error> {
        let (sensor, profile) = self.streams[place];
        self.numbers[place] += 1;
        let frame = RawSoftwareFrame {
            pixels: lent(&bytes),
            deleter: returned,
            stride: (width * pixel) as c_int,
            bytes_per_pixel: pixel as c_int,
            milliseconds,
            domain: 0,
            number: self.numbers[place],
            profile,
            depth_unit: self.depth_unit,
        };
        unsafe { self.api.call(|f, error| (f.rs2_software_sensor_on_video_frame)(sensor, frame, error)) }
    }
}

/// The software cameras that are plugged in: librealsense2 does not list them among its devices.
#[derive(Debug, Default)]
pub struct SoftwareDevices(Mutex<Vec<Arc<Device>>>);

impl SoftwareDevices {
    /// Plugs a camera in.
    pub fn plug_in(&self, camera: &SoftwareDevice) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&camera.device));
    }

    /// Unplugs all cameras.
    pub fn unplug(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

impl Devices for SoftwareDevices {
    fn devices(&self) -> Result<Vec<Arc<Device>>, Error> {
        Ok(self.0.lock().unwrap_or_else(PoisonError::into_inner).clone())
    }
}

impl Drop for SoftwareDevice {
    fn drop(&mut self) {
        // The pointers are this object's alone, and are not used after; profiles belong to their sensors.
        for (sensor, _) in self.streams.into_iter().filter(|(sensor, _)| !sensor.is_null()) {
            unsafe { (self.api.functions.rs2_delete_sensor)(sensor) }
        }
    }
}

/// Bytes in front of pixels that are lent: how many there are in all.
const HEAD: usize = size_of::<usize>();

/// A copy of `pixels` that the library may keep until it gives it to [`returned`].
fn lent(pixels: &[u8]) -> *mut c_void {
    let length = HEAD + pixels.len();
    let block: Box<[u8]> = length.to_ne_bytes().iter().chain(pixels).copied().collect();
    // The block is longer than its head.
    unsafe { Box::into_raw(block).cast::<u8>().add(HEAD).cast() }
}

/// Frees what [`lent`] made.
unsafe extern "C" fn returned(pixels: *mut c_void) {
    // The library gives back the pointer that it got, once: in front of it is the block's length.
    unsafe {
        let block = pixels.cast::<u8>().sub(HEAD);
        let length = block.cast::<usize>().read_unaligned();
        drop(Box::from_raw(std::ptr::slice_from_raw_parts_mut(block, length)));
    }
}
