//! How much of a mesh belongs to each component.

use semascan_model::SemanticMesh;

/// How much of a mesh one component has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartCount {
    /// Vertices that carry its class.
    pub vertices: u64,
    /// Its triangles.
    pub triangles: u64,
}

/// The counts of all components, in the order of their classes.
pub fn part_counts(mesh: &SemanticMesh) -> Vec<PartCount> {
    let classes = mesh.vertices.labels.iter().max().map_or(0, |most| usize::from(*most) + 1);
    let mut counts = vec![PartCount::default(); classes];
    for label in &mesh.vertices.labels {
        counts[usize::from(*label)].vertices += 1;
    }
    for triangle in &mesh.triangles {
        if let Some(count) = counts.get_mut(usize::from(mesh.triangle_label(*triangle))) {
            count.triangles += 1;
        }
    }
    counts
}
