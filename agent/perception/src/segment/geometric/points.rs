//! Coloured points as geometric segmentation reads them: those of an organized view, or any others.

use crate::organized::OrganizedCloud;
use crate::view::Intrinsics;
use image::RgbImage;

/// Points with colours, in the order of their source: one a pixel, row-major, or one a line of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColoredPoints {
    /// Metres, camera frame (the sensor stands at the origin); a coordinate that is not finite marks a missing point.
    pub positions: Vec<[f32; 3]>,
    /// sRGB, one a point; points past its end are black.
    pub colors: Vec<[u8; 3]>,
}

/// What stands for a pixel without depth.
pub(super) const MISSING: [f32; 3] = [f32::NAN; 3];

impl ColoredPoints {
    /// The pixels of a view. Where picture and cloud differ in size, pixels without a colour are black.
    pub fn of_view(cloud: &OrganizedCloud, rgb: &RgbImage) -> Self {
        Self::of_depth(&cloud.intrinsics, &cloud.depth, rgb)
    }

    /// The pixels of a row-major depth image in metres, 0 where nothing was measured.
    pub fn of_depth(k: &Intrinsics, depth: &[f32], rgb: &RgbImage) -> Self {
        let width = k.width.max(1) as usize;
        let across: Vec<f32> = (0..width).map(|u| ((u as f64 - k.cx) / k.fx) as f32).collect();
        let mut positions = Vec::with_capacity(depth.len());
        for (v, row) in depth.chunks(width).enumerate() {
            let down = ((v as f64 - k.cy) / k.fy) as f32;
            positions
                .extend(row.iter().zip(&across).map(|(&z, x)| if z > 0.0 { [x * z, down * z, z] } else { MISSING }));
        }
        let (colors, _) = rgb.as_raw().as_chunks::<3>();
        Self { positions, colors: colors.to_vec() }
    }

    /// Number of points, missing ones included.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no point at all.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Colour of point `i`.
    pub(super) fn color(&self, i: usize) -> [u8; 3] {
        self.colors.get(i).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::DepthImage;

    #[test]
    fn pixels_become_points_where_they_have_depth() {
        let k = Intrinsics { width: 3, height: 2, fx: 2.0, fy: 4.0, cx: 1.0, cy: 0.5 };
        let metres = vec![1.0, 0.0, 2.0, 1.0, 1.0, 0.5];
        let cloud = OrganizedCloud::new(k, &DepthImage { width: 3, height: 2, metres }, None);
        let rgb = RgbImage::from_fn(3, 2, |u, v| image::Rgb([u as u8, v as u8, 9]));
        let points = ColoredPoints::of_view(&cloud, &rgb);
        assert_eq!(points.len(), 6);
        for i in 0..6 {
            match cloud.point(i) {
                Some(p) => (0..3).for_each(|a| assert!((f64::from(points.positions[i][a]) - p[a]).abs() < 1e-6)),
                None => assert!(points.positions[i][0].is_nan()),
            }
        }
        assert_eq!(points.color(5), [2, 1, 9]);
        assert_eq!(points.color(6), [0; 3]);
    }
}
