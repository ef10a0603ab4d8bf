//! The mesh of the model as the page holds it, once one was made.

use semascan_model::SemanticMesh;
use std::sync::Arc;

/// A mesh, and how far each of its vertices deviates from a reference.
#[derive(Clone, Debug, Default)]
pub struct HeldMesh {
    mesh: Option<Arc<SemanticMesh>>,
    deviations: Vec<f32>,
    revision: u64,
}

impl HeldMesh {
    /// Takes a mesh (table frame, metres), which has been compared with nothing yet, in the place of the one before.
    pub fn set(&mut self, mesh: Arc<SemanticMesh>) {
        self.mesh = Some(mesh);
        self.deviations.clear();
        self.revision += 1;
    }

    /// Takes a deviation in metres for each vertex; none, if the mesh is compared with nothing any more.
    pub fn set_deviations(&mut self, of_vertices: Vec<f32>) {
        self.deviations = of_vertices;
        self.revision += 1;
    }

    /// There is no mesh any more.
    pub fn clear(&mut self) {
        self.mesh = None;
        self.deviations.clear();
        self.revision += 1;
    }

    /// The mesh, if there is one.
    pub fn mesh(&self) -> Option<&Arc<SemanticMesh>> {
        self.mesh.as_ref()
    }

    /// Deviations of its vertices in metres, NaN where there is none; empty if it was not compared.
    pub fn deviations(&self) -> &[f32] {
        &self.deviations
    }

    /// Changes with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }
}
