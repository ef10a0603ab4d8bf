//! Points in the order of a space-filling curve [Morton 1966]: every n-th of them are spread evenly over the surface.

use crate::camera::Bounds;
use glam::Vec3;

/// Indices of the points along a Morton curve through the box around them.
pub(crate) fn along_curve(positions: &[[f32; 3]]) -> Vec<usize> {
    let mut bounds = Bounds::EMPTY;
    for p in positions {
        bounds.include(Vec3::from(*p));
    }
    let edge = (bounds.max - bounds.min).max_element().max(f32::MIN_POSITIVE);
    let mut order: Vec<(u32, usize)> = Vec::with_capacity(positions.len());
    for (i, p) in positions.iter().enumerate() {
        // What is not finite lands at either end.
        let cell = ((Vec3::from(*p) - bounds.min) / edge * 1023.0).to_array().map(|c| c as u32);
        order.push((spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2, i));
    }
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// Ten bits with two zeros between each.
fn spread(bits: u32) -> u32 {
    let mut x = bits.min(1023);
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
