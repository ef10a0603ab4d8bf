//! From the map to what an inspection is after: its mesh, and the components and defects of a part with their figures.

use semascan_geometry::measure::model_figures;
use semascan_geometry::mesh::{MeshError, MeshOptions, mesh_cloud};
use semascan_model::record::{ClassSummary, LabelSource};
use semascan_model::{ModelFigures, SemanticCloud, SemanticMesh, Taxonomy};

/// The mesh of a finished model and its figures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Measured {
    pub(crate) mesh: SemanticMesh,
    pub(crate) figures: ModelFigures,
}

/// Meshes the points of a model with voxels of edge `voxel` (metres) and measures it.
///
/// # Errors
/// [`MeshError`] if the voxel edge is not a length.
pub(crate) fn measure(cloud: &SemanticCloud, voxel: f64) -> Result<Measured, MeshError> {
    let mesh = mesh_cloud(cloud, voxel as f32, &MeshOptions::default(), &())?;
    let figures = model_figures(cloud, &mesh, voxel as f32);
    Ok(Measured { mesh, figures })
}

/// What the record says of every component class and every defect class but `none`, in order. Without labels nobody looked
/// for any class: then no point of one would be no finding, and only `none` is listed.
pub(crate) fn summarize(
    figures: &ModelFigures,
    taxonomy: &Taxonomy,
    labels: LabelSource,
) -> (Vec<ClassSummary>, Vec<ClassSummary>) {
    let absent = figures.absent().unwrap_or_default();
    let components =
        taxonomy.components.iter().map(|c| ClassSummary::new(c, figures.component(c.id).unwrap_or(absent)));
    let defects = taxonomy.defects.iter().skip(1).map(|d| ClassSummary::new(d, figures.defect(d.id).unwrap_or(absent)));
    match labels {
        LabelSource::None => (components.take(1).collect(), Vec::new()),
        LabelSource::Source | LabelSource::Network => (components.collect(), defects.collect()),
    }
}
