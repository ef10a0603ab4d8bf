//! Image preparation (P2, "Image processing"): what a picture is freed of before it is segmented and fused.
//!
//! Noise first: its type and level are measured in the wavelet domain ([`noise`]), and the matching filter takes it out
//! ([`denoise`]). Then the background: by edges and an active contour as P2 does ([`contour`]), or, where the cell knows
//! its measuring volume, by geometry ([`volume`]), which needs no guess. Each can be on or off; [`Prepared`] puts them
//! before any segmenter.

pub mod contour;
pub mod denoise;
pub mod noise;
pub mod volume;
mod wavelet;

use super::{SegmentError, Segmentation, Segmenter};
use crate::acquire::View;
use contour::Snake;
use nalgebra::Point3;

/// How the background is told from the part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// It is kept.
    #[default]
    Kept,
    /// By edges and an active contour around them.
    Contour(Snake),
    /// Pixels whose points lie outside this box (min and max corner, metres, table frame).
    Volume(Point3<f64>, Point3<f64>),
}

/// What is done to a view before it is segmented.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Preparation {
    /// Noise is measured and filtered.
    pub denoise: bool,
    /// What becomes of the background.
    pub background: Background,
}

/// A segmenter that sees prepared pictures; what they show of the background is of no class, and certainly so.
pub struct Prepared<S> {
    segmenter: S,
    preparation: Preparation,
}

impl<S: Segmenter> Prepared<S> {
    /// Puts `preparation` before `segmenter`.
    pub fn new(segmenter: S, preparation: Preparation) -> Self {
        Self { segmenter, preparation }
    }
}

impl Preparation {
    /// The background of `view`, row-major: true where nothing of the part shows.
    pub fn background_of(&self, view: &View) -> Option<Vec<bool>> {
        match &self.background {
            Background::Kept => None,
            Background::Contour(snake) => Some(contour::background(&view.rgb, snake)),
            Background::Volume(low, high) => volume::background(view, low, high),
        }
    }
}

impl<S: Segmenter> Segmenter for Prepared<S> {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let quiet = if self.preparation.denoise { denoise::denoised(&view.rgb) } else { None };
        let background = self.preparation.background_of(view);
        let mut segmentation = match quiet {
            Some(rgb) => self.segmenter.segment(&View { rgb, ..view.clone() })?,
            None => self.segmenter.segment(view)?,
        };
        for (i, _) in background.iter().flatten().enumerate().filter(|(_, outside)| **outside) {
            segmentation.components.set_certain(i, 0);
            segmentation.defects.set_certain(i, 0);
            if let Some(instance) = segmentation.instances.get_mut(i) {
                *instance = 0;
            }
        }
        Ok(segmentation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::Source;
    use crate::acquire::virtual_cell::{VirtualCell, VirtualCellSpec};
    use crate::segment::{ClassField, RecordedSegmenter};

    /// A view of a motor with soft labels that call everything class 1.
    struct AllOne;

    impl Segmenter for AllOne {
        fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
            let n = view.depth.metres.len();
            let soft = ClassField::Soft { classes: 2, probabilities: [0, 255].repeat(n), sigma: vec![90; n] };
            Ok(Segmentation { components: soft.clone(), defects: soft, instances: vec![4; n], network: None })
        }
    }

    #[test]
    fn outside_the_volume_nothing_is_labelled_and_inside_nothing_changes() {
        let uri = "virtual:starter-motor?seed=5&views=1&size=160x120&errors=none&noise=none&cell=2.5";
        let cell = VirtualCell::open(&VirtualCellSpec::parse(uri).expect("valid")).expect("opens");
        let view = cell.view(0).expect("a view");
        let (low, high) = cell.info().volume.expect("a volume");
        let preparation = Preparation { denoise: false, background: Background::Volume(low, high) };
        let said = Prepared::new(AllOne, preparation).segment(&view).expect("labels");
        let truth = RecordedSegmenter { required: true }.segment(&view).expect("truth");
        let pose = view.truth.as_ref().expect("truth").table_from_camera;
        let (mut part, mut kept, mut below) = (0, 0, 0);
        for i in 0..view.depth.metres.len() {
            let labelled = said.components.best(i) == 1;
            assert_eq!(said.components.sigma(i) > 0.0, labelled, "pixel {i}");
            assert_eq!(said.instances[i], if labelled { 4 } else { 0 });
            let z = f64::from(view.depth.metres[i]);
            if z <= 0.0 {
                continue;
            }
            if truth.components.best(i) != 0 {
                part += 1;
                kept += u32::from(labelled);
            }
            let p = pose * view.intrinsics.unproject((i % 160) as f64, (i / 160) as f64, z);
            if p.z < 0.001 {
                below += 1;
                assert!(!labelled, "pixel {i} shows the table");
            }
        }
        assert!(below > 1000, "{below} pixels of the table");
        // The volume begins two millimetres above the chuck.
        assert!(part > 500 && kept * 100 >= part * 97, "{kept} of {part}");
    }
}
