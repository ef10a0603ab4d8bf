//! File formats: one reader and one writer for each, the same code natively and for wasm32.
//!
//! Readers take the bytes of a file, and a [`Resolver`] for the files that it names; writers write to any
//! [`std::io::Write`]. What a reader finds is a [`Geometry`] whose coordinates are `f64`, in the unit and frame of the file;
//! [`unit`](mod@unit) and [`offset`] make of them what single precision can hold.
//!
//! Everything that arrives is untrusted: counts are checked against the bytes that are there before anything is allocated,
//! what few bytes can stand for (instances, packed data, files named many times) has stated limits, and only regular files
//! (`regular_file`) in the folder of a file are opened for it.
//!
//! | module | what |
//! |---|---|
//! | [`ply`] | clouds and meshes with all that is known of a point; foreign files |
//! | [`obj`] | meshes in groups with materials |
//! | [`stl`] | meshes without more |
//! | [`gltf`] | scenes: glTF 2.0, text or binary |
//! | [`pcd`] | point clouds of the Point Cloud Library (read only) |
//! | `e57`, `las` | clouds of laser scanners (read only; the feature `scanners`) |
//! | [`drawing`] | plane sections as SVG and DXF (write only) |

mod component;
pub mod drawing;
#[cfg(feature = "scanners")]
pub mod e57;
mod error;
mod file_frame;
mod files;
mod filter;
mod geometry;
pub mod gltf;
#[cfg(feature = "scanners")]
pub mod las;
mod levels;
mod mesh_texture;
pub mod obj;
pub mod offset;
pub mod pcd;
pub mod percent;
pub mod ply;
mod polygon;
#[cfg(not(target_arch = "wasm32"))]
pub mod regular_file;
pub mod stl;
mod text;
pub mod unit;

pub use component::{Component, components, file_part};
pub use error::{ReadError, WriteError};
pub use file_frame::{FileFrame, UpAxis};
#[cfg(not(target_arch = "wasm32"))]
pub use files::read_file;
pub use files::{Resolver, no_files};
pub use filter::{ExportFilter, LeftOut};
pub use geometry::{Geometry, Piece, PieceTexture, Texture};
pub use mesh_texture::MeshTexture;
