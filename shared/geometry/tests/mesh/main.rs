//! The mesher on surfaces that are known, in pieces, and on clouds that are no surfaces.

mod evidence;
mod hostile;
mod incremental;
mod refine;
mod shapes;

use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_model::{SemanticCloud, SemanticMesh};

fn meshed(cloud: &SemanticCloud) -> SemanticMesh {
    mesh_cloud(cloud, shapes::VOXEL, &MeshOptions::default(), &()).expect("usual settings")
}
