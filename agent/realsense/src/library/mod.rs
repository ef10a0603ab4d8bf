//! librealsense2 through its C interface: the functions that are used, and objects around its pointers which are safe to use.
//!
//! This folder alone has unsafe code. The library is written in C++, is not packaged everywhere, and its users' versions differ, so
//! it is not linked but loaded, and the few functions that a camera needs are declared here as its header `rs.h` has them; their
//! signatures have not changed since version 2.50. What makes the calls sound:
//!
//! - A pointer is in exactly one object, which deletes it when it is dropped, and which holds what the pointer depends on: the
//!   library always, a sensor its device, a frame its queue's library. So no pointer outlives what it points to.
//! - Every function that can fail gets a place for an error, which is looked at before the result is used (`Api::call`).
//! - Lengths are asked of the library before bytes are read, and the bytes are copied.
//! - librealsense2 locks its objects itself (its own examples use them from several threads); here each is used by one thread at a
//!   time, so they may be sent to another one.

#![allow(unsafe_code)]

mod functions;
mod objects;
pub mod software;

pub use objects::{Context, Device, Devices, Frame, Intrinsics, Queue, Sensor, StreamKind, StreamProfile};

use functions::Functions;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::Arc;

/// Names the library where it is not on the loader's path.
pub const PATH_VARIABLE: &str = "SEMASCAN_REALSENSE";
/// Minor versions that are looked for, the newest first: packages of the library without its headers have no shorter name.
const MINORS: std::ops::RangeInclusive<u32> = 50..=79;

/// Why a call failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// There is no such library.
    #[error(
        "RealSense cameras need librealsense2, which is not installed ({0}); Intel's packages bring it (librealsense2), and \
         {PATH_VARIABLE}=FILE says where it is"
    )]
    NoLibrary(String),
    /// The library lacks a function.
    #[error("{path} is no librealsense2 of version 2.50 or later: {reason}")]
    NotIt {
        /// The file.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// The library says so.
    #[error("librealsense2: {message} ({function})")]
    Said {
        /// Its function that failed.
        function: String,
        /// Its message.
        message: String,
    },
}

/// librealsense2, loaded.
#[derive(Clone)]
pub struct Library(Arc<Api>);

struct Api {
    functions: Functions,
    /// Never unloaded: the library has threads and static objects of its own.
    _library: &'static libloading::Library,
}

impl std::fmt::Debug for Library {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("librealsense2")
    }
}

impl Library {
    /// The library as it is installed: the file that [`PATH_VARIABLE`] names, or the newest one on the loader's path.
    ///
    /// # Errors
    /// [`Error`] if there is none, or it is not what it should be.
    pub fn find() -> Result<Self, Error> {
        if let Some(path) = std::env::var_os(PATH_VARIABLE).filter(|path| !path.is_empty()) {
            return Self::load(Path::new(&path));
        }
        let mut names: Vec<String> = vec![libloading::library_filename("realsense2").to_string_lossy().into_owned()];
        if cfg!(target_os = "linux") {
            names.extend(MINORS.rev().map(|minor| format!("librealsense2.so.2.{minor}")));
        }
        let mut first = None;
        for name in &names {
            match Self::load(Path::new(name)) {
                Err(Error::NoLibrary(reason)) => drop(first.get_or_insert(reason)),
                found => return found,
            }
        }
        Err(Error::NoLibrary(first.unwrap_or_default()))
    }

    /// The library in the file `path`.
    ///
    /// # Errors
    /// [`Error`] if it cannot be loaded, or is not what it should be.
    pub fn load(path: &Path) -> Result<Self, Error> {
        // Sound as far as the file is the library that its name says: its initializers run, as with every linked library.
        let library = unsafe { libloading::Library::new(path) };
        let library = library.map_err(|error| Error::NoLibrary(format!("{}: {}", path.display(), whole(&error))))?;
        let library: &'static libloading::Library = Box::leak(Box::new(library));
        // The types are those of rs.h.
        let functions = unsafe { Functions::load(library) };
        let functions = functions.map_err(|reason| Error::NotIt { path: path.to_owned(), reason })?;
        Ok(Self(Arc::new(Api { functions, _library: library })))
    }
}

impl Api {
    /// Calls a function that says by its last argument whether it failed.
    fn call<T>(&self, function: impl FnOnce(&Functions, *mut *mut c_void) -> T) -> Result<T, Error> {
        let mut error: *mut c_void = ptr::null_mut();
        let result = function(&self.functions, &raw mut error);
        if error.is_null() {
            return Ok(result);
        }
        // The error is one that the library made, is read while it lives, and freed once.
        let said = unsafe {
            let function = text((self.functions.rs2_get_failed_function)(error));
            let message = text((self.functions.rs2_get_error_message)(error));
            (self.functions.rs2_free_error)(error);
            Error::Said { function, message }
        };
        Err(said)
    }

    /// The number of things in a list, which is none below 0.
    fn count(&self, function: impl FnOnce(&Functions, *mut *mut c_void) -> c_int) -> Result<c_int, Error> {
        Ok(self.call(function)?.max(0))
    }
}

/// An error of the loader with what is behind it, which says why.
fn whole(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// A text of the library's, copied; empty for none.
///
/// # Safety
/// `text` is null or ends with a zero.
unsafe fn text(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}
