//! A view becomes part of the model: a depth picture to points with normals ([`organized`]), pixels to classes
//! ([`segment`]), a view to its pose ([`register`]), posed views to the semantic map ([`fuse`]). How well the poses agree with
//! the pictures is judged apart from all of these ([`reprojection`]).

pub mod fuse;
pub mod organized;
pub mod register;
pub mod reprojection;
pub mod segment;
pub mod view;

// Test fixtures, which other crates take in by their path, name this crate as these do.
#[cfg(test)]
extern crate self as semascan_perception;
