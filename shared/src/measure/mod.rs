//! Measuring kernels that agent and viewer share, so that both print the same figure.

mod area;

pub use area::surfel_area;
