//! Settings of the outlier filters.

use serde::{Deserialize, Serialize};

/// Settings of the outlier filters, distances in voxels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutlierFilter {
    /// Both filters: neighbourhood half edge in voxels, 1 to 4.
    pub radius: i32,
    /// Radius filter: fewest occupied neighbours of a good voxel.
    pub min_neighbours: u32,
    /// Statistical filter: nearest neighbours that count, up to 16.
    pub neighbours: usize,
    /// Statistical filter: standard deviations above the mean neighbour distance.
    pub deviations: f64,
    /// Noise filter: how much more a neighbour must weigh to speak of the surface.
    pub heavier: f32,
    /// Noise filter: least distance off that surface, voxels.
    pub off_surface: f32,
}

impl Default for OutlierFilter {
    fn default() -> Self {
        Self { radius: 2, min_neighbours: 6, neighbours: 8, deviations: 3.0, heavier: 3.0, off_surface: 0.2 }
    }
}
