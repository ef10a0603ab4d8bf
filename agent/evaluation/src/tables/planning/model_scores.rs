//! A model against the reachable part of the true surface: what of it the model has, and under the right class.

use super::reachable::Looked;
use crate::Confusion;
use crate::truth::truth_of;
use semascan_geometry::measure::NearestPoints;
use semascan_inspection::Inspected;
use semascan_inspection::source::TrueMesh;
use semascan_model::PointFlags;
use serde::Serialize;

/// Voxels from a true point within which the model has it.
const NEAR: f64 = 2.0;

/// Figures of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelScores {
    /// Mean IoU over the components, on points of the reachable true surface: what the model does not have is a miss.
    pub mean_iou: f64,
    /// Share of the reachable true surface of all components that the model has with a label.
    pub completeness: f64,
}

/// Judges a model on the points of `looked` that are `reachable`.
pub(super) fn score(inspected: &Inspected, looked: &Looked<'_>, reachable: &[bool], truth: &TrueMesh) -> ModelScores {
    let cloud = &inspected.cloud;
    let left_out = PointFlags::OUTLIER | PointFlags::BACKGROUND;
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !cloud.flags[i].has(left_out)).collect();
    let points: Vec<[f32; 3]> = kept.iter().map(|&i| cloud.positions[i]).collect();
    let nearest = NearestPoints::new(&points);
    let reach = (NEAR * inspected.record.voxel.unwrap_or(1e-3)) as f32;
    let mut confusion = Confusion::new(inspected.source.info().taxonomy.component_count());
    for (sample, _) in looked.samples.iter().zip(reachable).filter(|(_, reachable)| **reachable) {
        let position = sample.position.map(|x| x as f32);
        let given = nearest.nearest_within(position, reach).map(|found| kept[found.index as usize]);
        let label = given.filter(|&i| cloud.confidence[i] > 0.0).map(|i| cloud.labels[i]);
        confusion.add(truth_of(&truth.labels, sample.vertex), label);
    }
    let scores = confusion.scores();
    ModelScores { mean_iou: scores.mean_iou, completeness: scores.completeness }
}
