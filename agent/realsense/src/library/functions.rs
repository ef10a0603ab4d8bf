//! The functions of `librealsense2/rs.h` and the structures that they pass, as C has them.

use std::ffi::{c_char, c_double, c_float, c_int, c_uint, c_void};

/// `rs2_error**`.
type Failure = *mut *mut c_void;

/// `rs2_intrinsics`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RawIntrinsics {
    pub(super) width: c_int,
    pub(super) height: c_int,
    pub(super) ppx: c_float,
    pub(super) ppy: c_float,
    pub(super) fx: c_float,
    pub(super) fy: c_float,
    pub(super) model: c_int,
    pub(super) coefficients: [c_float; 5],
}

/// `rs2_extrinsics`: the rotation by columns, the translation in metres.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RawExtrinsics {
    pub(super) rotation: [c_float; 9],
    pub(super) translation: [c_float; 3],
}

/// `rs2_video_stream`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RawVideoStream {
    pub(super) kind: c_int,
    pub(super) index: c_int,
    pub(super) identifier: c_int,
    pub(super) width: c_int,
    pub(super) height: c_int,
    pub(super) rate: c_int,
    pub(super) bytes_per_pixel: c_int,
    pub(super) format: c_int,
    pub(super) intrinsics: RawIntrinsics,
}

/// `rs2_software_video_frame`.
#[repr(C)]
pub(super) struct RawSoftwareFrame {
    pub(super) pixels: *mut c_void,
    pub(super) deleter: unsafe extern "C" fn(*mut c_void),
    pub(super) stride: c_int,
    pub(super) bytes_per_pixel: c_int,
    pub(super) milliseconds: c_double,
    pub(super) domain: c_int,
    pub(super) number: c_int,
    pub(super) profile: *const c_void,
    pub(super) depth_unit: c_float,
}

macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions, by their names in C.
        pub(super) struct Functions {
            $(pub(super) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Finds all of them; the error names the one that is not there.
            ///
            /// # Safety
            /// `library` is librealsense2: what has these names has these types.
            pub(super) unsafe fn load(library: &libloading::Library) -> Result<Self, String> {
                Ok(Self {
                    $($name: *unsafe { library.get(concat!(stringify!($name), "\0").as_bytes()) }
                        .map_err(|error| super::whole(&error))?,)*
                })
            }
        }
    };
}

functions! {
    rs2_get_error_message(*const c_void) -> *const c_char;
    rs2_get_failed_function(*const c_void) -> *const c_char;
    rs2_free_error(*mut c_void);
    rs2_get_api_version(Failure) -> c_int;
    rs2_create_context(c_int, Failure) -> *mut c_void;
    rs2_delete_context(*mut c_void);
    rs2_query_devices(*const c_void, Failure) -> *mut c_void;
    rs2_delete_device_list(*mut c_void);
    rs2_get_device_count(*const c_void, Failure) -> c_int;
    rs2_create_device(*const c_void, c_int, Failure) -> *mut c_void;
    rs2_delete_device(*mut c_void);
    rs2_supports_device_info(*const c_void, c_int, Failure) -> c_int;
    rs2_get_device_info(*const c_void, c_int, Failure) -> *const c_char;
    rs2_query_sensors(*const c_void, Failure) -> *mut c_void;
    rs2_delete_sensor_list(*mut c_void);
    rs2_get_sensors_count(*const c_void, Failure) -> c_int;
    rs2_create_sensor(*const c_void, c_int, Failure) -> *mut c_void;
    rs2_delete_sensor(*mut c_void);
    rs2_get_stream_profiles(*mut c_void, Failure) -> *mut c_void;
    rs2_delete_stream_profiles_list(*mut c_void);
    rs2_get_stream_profiles_count(*const c_void, Failure) -> c_int;
    rs2_get_stream_profile(*const c_void, c_int, Failure) -> *const c_void;
    rs2_get_stream_profile_data(*const c_void, *mut c_int, *mut c_int, *mut c_int, *mut c_int, *mut c_int, Failure);
    rs2_is_stream_profile_default(*const c_void, Failure) -> c_int;
    rs2_get_video_stream_resolution(*const c_void, *mut c_int, *mut c_int, Failure);
    rs2_get_video_stream_intrinsics(*const c_void, *mut RawIntrinsics, Failure);
    rs2_get_extrinsics(*const c_void, *const c_void, *mut RawExtrinsics, Failure);
    rs2_open_multiple(*mut c_void, *mut *const c_void, c_int, Failure);
    rs2_close(*const c_void, Failure);
    rs2_start_queue(*const c_void, *mut c_void, Failure);
    rs2_stop(*const c_void, Failure);
    rs2_supports_option(*const c_void, c_int, Failure) -> c_int;
    rs2_get_option(*const c_void, c_int, Failure) -> c_float;
    rs2_get_option_range(*const c_void, c_int, *mut c_float, *mut c_float, *mut c_float, *mut c_float, Failure);
    rs2_set_option(*const c_void, c_int, c_float, Failure);
    rs2_create_frame_queue(c_int, Failure) -> *mut c_void;
    rs2_delete_frame_queue(*mut c_void);
    rs2_try_wait_for_frame(*mut c_void, c_uint, *mut *mut c_void, Failure) -> c_int;
    rs2_release_frame(*mut c_void);
    rs2_get_frame_data(*const c_void, Failure) -> *const c_void;
    rs2_get_frame_data_size(*const c_void, Failure) -> c_int;
    rs2_get_frame_width(*const c_void, Failure) -> c_int;
    rs2_get_frame_height(*const c_void, Failure) -> c_int;
    rs2_get_frame_stride_in_bytes(*const c_void, Failure) -> c_int;
    rs2_get_frame_timestamp(*const c_void, Failure) -> c_double;
    rs2_get_frame_stream_profile(*const c_void, Failure) -> *const c_void;
    rs2_depth_frame_get_units(*const c_void, Failure) -> c_float;
    rs2_create_software_device(Failure) -> *mut c_void;
    rs2_software_device_register_info(*mut c_void, c_int, *const c_char, Failure);
    rs2_software_device_add_sensor(*mut c_void, *const c_char, Failure) -> *mut c_void;
    rs2_software_sensor_add_video_stream(*mut c_void, RawVideoStream, Failure) -> *mut c_void;
    rs2_software_sensor_add_option(*mut c_void, c_int, c_float, c_float, c_float, c_float, c_int, Failure);
    rs2_software_sensor_add_read_only_option(*mut c_void, c_int, c_float, Failure);
    rs2_software_sensor_on_video_frame(*mut c_void, RawSoftwareFrame, Failure);
    rs2_register_extrinsics(*const c_void, *const c_void, RawExtrinsics, Failure);
}
