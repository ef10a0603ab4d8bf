//! The true part where the model stands. Registration makes the poses of the views agree with each other, and leaves the model as a whole
//! as far off as robot and table are. A person who corrects the model goes by what its photographs show on it, so the truth is brought to
//! the model: else every border would be off by as much.

use crate::poses::moved;
use crate::{PosePair, align_poses};
use nalgebra::Isometry3;
use semascan_inspection::record::TruePoses;
use semascan_inspection::source::TrueMesh;
use semascan_simulation::VirtualCell;

/// The true part in the model's frame.
pub(super) struct PartTruth<'a> {
    /// The true mesh.
    pub(super) mesh: TrueMesh,
    cell: &'a VirtualCell,
    truth_from_model: Isometry3<f64>,
}

impl<'a> PartTruth<'a> {
    /// Brings the truth to where the poses of the views, taken together, have the model; `None` without poses.
    pub(super) fn at_model(mesh: &TrueMesh, cell: &'a VirtualCell, poses: &[TruePoses]) -> Option<Self> {
        let pairs: Vec<PosePair> = poses.iter().map(|p| PosePair { estimate: p.estimate, truth: p.truth }).collect();
        let truth_from_model = align_poses(&pairs)?;
        let model_from_truth = truth_from_model.inverse();
        let vertices = mesh.vertices.iter().map(|p| moved(&model_from_truth, *p)).collect();
        Some(Self { mesh: TrueMesh { vertices, ..mesh.clone() }, cell, truth_from_model })
    }

    /// Defect class of a place (model frame, metres) on the surface of a component; 0 for none.
    pub(super) fn defect_at(&self, place: [f32; 3], component: u16) -> u16 {
        self.cell.defect_at(moved(&self.truth_from_model, place), component)
    }
}
