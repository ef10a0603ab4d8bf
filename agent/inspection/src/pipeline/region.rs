//! The region of interest, applied: the pixels of a view that take no part in anything after its segmentation. What is left
//! out is counted.

use crate::spec::{Corners, DepthRange, RegionSpec, SpecError};
use nalgebra::Isometry3;
use semascan_model::record::RegionRecord;
use semascan_perception::fuse::voxel_at;
use semascan_perception::segment::Segmentation;
use semascan_perception::view::View;

/// Which pixels are inspected.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    depth: Option<DepthRange>,
    bounds: Option<Corners>,
    labelled: bool,
    /// Voxels that the footprint of a pixel may be wide.
    footprint: f64,
    /// Voxel edge in metres; that of the first view if the specification leaves it open.
    voxel: Option<f64>,
    counted: RegionRecord,
}

impl Region {
    /// The region that `spec` says, for a model of `voxel` metres if that is known.
    ///
    /// # Errors
    /// [`SpecError`] naming the field that cannot be used.
    pub(crate) fn new(spec: &RegionSpec, voxel: Option<f64>) -> Result<Self, SpecError> {
        Ok(Self {
            depth: spec.depth,
            bounds: spec.corners()?,
            labelled: spec.labelled,
            footprint: spec.footprint()?,
            voxel,
            counted: RegionRecord::default(),
        })
    }

    /// What was left out of all views so far.
    pub(crate) fn counted(&self) -> RegionRecord {
        self.counted
    }

    /// The pixels of a view that are left out, row-major.
    ///
    /// # Errors
    /// Why nothing of the view is left.
    pub(super) fn ignored(&mut self, view: &View, segmentation: &Segmentation) -> Result<Vec<bool>, String> {
        let table_from_camera = view.pose.table_from_camera();
        let bounds = match (self.bounds, table_from_camera) {
            (Some(_), None) => return Err("the region is a box in the table frame, and the view has no pose".into()),
            (Some(bounds), Some(pose)) => Some((bounds, pose)),
            (None, _) => None,
        };
        let mut counted = RegionRecord::default();
        let (k, depth) = (&view.intrinsics, &view.depth.metres);
        let mut ignored = vec![false; depth.len()];
        for (i, (z, ignored)) in depth.iter().zip(&mut ignored).enumerate().filter(|(_, (z, _))| **z > 0.0) {
            counted.measured += 1;
            let z = f64::from(*z);
            let inside = |((low, high), pose): &(Corners, Isometry3<f64>)| {
                let (u, v) = (i as u32 % k.width, i as u32 / k.width);
                let p = pose * k.unproject(u.into(), v.into(), z);
                (0..3).all(|axis| low[axis] <= p[axis] && p[axis] <= high[axis])
            };
            let reason = if self.depth.is_some_and(|range| z < range.min || z > range.max) {
                &mut counted.outside_depth
            } else if bounds.as_ref().is_some_and(|b| !inside(b)) {
                &mut counted.outside_box
            } else if self.labelled && segmentation.components.best(i) == 0 {
                &mut counted.unlabelled
            } else {
                continue;
            };
            *reason += 1;
            *ignored = true;
        }
        // The voxel is that of what is to be inspected.
        if self.voxel.is_none() {
            let mut kept: Vec<f32> =
                depth.iter().zip(&ignored).filter(|(z, i)| **z > 0.0 && !**i).map(|(z, _)| *z).collect();
            let middle = kept.len() / 2;
            let median = (!kept.is_empty()).then(|| *kept.select_nth_unstable_by(middle, f32::total_cmp).1);
            self.voxel = median.map(|z| voxel_at(k, z.into()));
        }
        let widest = self.voxel.map_or(f64::INFINITY, |voxel| voxel * self.footprint);
        for (z, ignored) in depth.iter().zip(&mut ignored).filter(|(z, _)| **z > 0.0) {
            if !*ignored && k.footprint((*z).into()) > widest {
                counted.too_coarse += 1;
                *ignored = true;
            }
        }
        self.counted += counted;
        if counted.measured > 0 && counted.left_out() == counted.measured {
            return Err(format!("nothing of it lies in the region of interest: {counted}"));
        }
        Ok(ignored)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use semascan_perception::segment::ClassField;
    use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, covariance_of_prior};
    use std::sync::Arc;

    /// Four pixels at 0.5, 1, 2 and 40 m; the second is labelled.
    fn view(pose: PoseEvidence) -> (View, Segmentation) {
        let view = View {
            index: 0,
            stamp: None,
            intrinsics: Intrinsics { width: 4, height: 1, fx: 500.0, fy: 500.0, cx: 1.5, cy: 0.0 },
            rgb: Arc::new(RgbImage::new(4, 1)),
            depth: Arc::new(DepthImage { width: 4, height: 1, metres: vec![0.5, 1.0, 2.0, 40.0] }),
            pose,
            labels: None,
            truth: None,
        };
        let segmentation = Segmentation {
            components: ClassField::Hard(vec![0, 1, 0, 0]),
            defects: ClassField::Hard(vec![0; 4]),
            instances: vec![0; 4],
            network: None,
        };
        (view, segmentation)
    }

    fn ignored(spec: RegionSpec, voxel: Option<f64>, pose: PoseEvidence) -> Result<(Vec<bool>, RegionRecord), String> {
        let (view, segmentation) = view(pose);
        let mut region = Region::new(&spec, voxel).expect("right");
        let ignored = region.ignored(&view, &segmentation)?;
        Ok((ignored, region.counted()))
    }

    #[test]
    fn each_part_of_the_region_takes_its_pixels_and_counts_them() {
        let spec = RegionSpec { depth: "0.6..1.5".parse().ok(), ..RegionSpec::default() };
        let (out, counted) = ignored(spec, Some(0.1), PoseEvidence::None).expect("something is left");
        assert_eq!((out, counted.outside_depth, counted.measured), (vec![true, false, true, true], 3, 4));
        let spec = RegionSpec { labelled: true, ..RegionSpec::default() };
        let (out, counted) = ignored(spec, Some(0.1), PoseEvidence::None).expect("something is left");
        assert_eq!((out, counted.unlabelled), (vec![true, false, true, true], 3));
        let spec = RegionSpec { bounds: Some([-1.0, -1.0, 0.9, 1.0, 1.0, 1.1]), ..RegionSpec::default() };
        assert!(ignored(spec.clone(), None, PoseEvidence::None).expect_err("no pose").contains("pose"));
        let covariance = covariance_of_prior(0.01, 0.01);
        let table_from_camera = Isometry3::translation(0.0, 0.0, 0.5);
        let pose = PoseEvidence::World { table_from_camera, covariance };
        let (out, counted) = ignored(spec, Some(0.1), pose).expect("something is left");
        assert_eq!((out, counted.outside_box), (vec![false, true, true, true], 3));
    }

    #[test]
    fn depth_that_is_too_coarse_for_the_voxel_is_left_out_by_itself() {
        // 1 mm: four voxels are what a pixel covers at 2 m.
        let (out, counted) = ignored(RegionSpec::default(), Some(1.1e-3), PoseEvidence::None).expect("something");
        assert_eq!((out, counted.too_coarse), (vec![false, false, false, true], 1));
        // By the first view: median 2 m, so a voxel of 8 mm, and 32 mm are covered at 16 m.
        let (out, _) = ignored(RegionSpec::default(), None, PoseEvidence::None).expect("something");
        assert_eq!(out, [false, false, false, true]);
        let all = RegionSpec { footprint_voxels: Some(f64::INFINITY), ..RegionSpec::default() };
        assert_eq!(ignored(all, Some(1e-3), PoseEvidence::None).expect("all").0, [false; 4]);
        let nothing = RegionSpec { depth: "50..60".parse().ok(), ..RegionSpec::default() };
        let reason = ignored(nothing, None, PoseEvidence::None).expect_err("nothing is left");
        assert!(reason.contains("region") && reason.contains('4'), "{reason}");
    }
}
