//! Columns of plain values as one block of bytes: how clouds and meshes cross between page and workers.
//!
//! Both ends are the same build, so the layout is no public contract; lengths are checked all the same.

use semascan_model::{PointFlags, SemanticCloud, SemanticMesh, SemanticPoint};

/// Takes `n` values off the front of `rest`; `None`, and nothing is taken or allocated, if it holds fewer.
pub(crate) fn take<T: bytemuck::Pod>(rest: &mut &[u8], n: usize) -> Option<Vec<T>> {
    let (head, tail) = rest.split_at_checked(n.saturating_mul(size_of::<T>()))?;
    *rest = tail;
    // Copied bytewise: the block need not be aligned for `T`.
    let mut column = vec![T::zeroed(); n];
    bytemuck::cast_slice_mut(&mut column).copy_from_slice(head);
    Some(column)
}

/// Bytes that [`put_cloud`] adds for a cloud, rounded up: for reserving memory.
pub(crate) fn cloud_bytes(cloud: &SemanticCloud) -> usize {
    cloud.len() * size_of::<SemanticPoint>()
}

/// Adds the columns of `cloud` to `bytes`, without their length.
pub(crate) fn put_cloud(bytes: &mut Vec<u8>, cloud: &SemanticCloud) {
    // Taken apart, so that a new column cannot be forgotten here.
    let SemanticCloud {
        positions,
        normals,
        colors,
        labels,
        confidence,
        defects,
        defect_confidence,
        sigma,
        defect_sigma,
        instances,
        views,
        flags,
    } = cloud;
    bytes.extend_from_slice(bytemuck::cast_slice(positions));
    bytes.extend_from_slice(bytemuck::cast_slice(normals));
    bytes.extend_from_slice(bytemuck::cast_slice(colors));
    bytes.extend_from_slice(bytemuck::cast_slice(labels));
    bytes.extend_from_slice(bytemuck::cast_slice(confidence));
    bytes.extend_from_slice(bytemuck::cast_slice(defects));
    bytes.extend_from_slice(bytemuck::cast_slice(defect_confidence));
    bytes.extend_from_slice(bytemuck::cast_slice(sigma));
    bytes.extend_from_slice(bytemuck::cast_slice(defect_sigma));
    bytes.extend_from_slice(bytemuck::cast_slice(instances));
    bytes.extend_from_slice(bytemuck::cast_slice(views));
    for flags in flags {
        bytes.extend_from_slice(&flags.0.to_le_bytes());
    }
}

/// Takes the columns of a cloud of `n` points off the front of `rest`; `None` if it holds fewer.
pub(crate) fn take_cloud(rest: &mut &[u8], n: usize) -> Option<SemanticCloud> {
    Some(SemanticCloud {
        positions: take(rest, n)?,
        normals: take(rest, n)?,
        colors: take(rest, n)?,
        labels: take(rest, n)?,
        confidence: take(rest, n)?,
        defects: take(rest, n)?,
        defect_confidence: take(rest, n)?,
        sigma: take(rest, n)?,
        defect_sigma: take(rest, n)?,
        instances: take(rest, n)?,
        views: take(rest, n)?,
        flags: take::<u16>(rest, n)?.into_iter().map(PointFlags).collect(),
    })
}

/// Bytes that [`put_mesh`] adds for a mesh, rounded up: for reserving memory.
pub(crate) fn mesh_bytes(mesh: &SemanticMesh) -> usize {
    8 + mesh.len() + cloud_bytes(&mesh.vertices) + 12 * mesh.triangles.len()
}

/// Adds a mesh to `bytes`, its lengths before it.
pub(crate) fn put_mesh(bytes: &mut Vec<u8>, mesh: &SemanticMesh) {
    let numbers = [mesh.len() as u32, mesh.triangles.len() as u32];
    bytes.reserve(mesh_bytes(mesh));
    bytes.extend_from_slice(bytemuck::cast_slice(&numbers));
    bytes.extend_from_slice(bytemuck::cast_slice(&mesh.triangles));
    put_cloud(bytes, &mesh.vertices);
    bytes.extend(mesh.boundary.iter().map(|on_boundary| u8::from(*on_boundary)));
}

/// Takes a mesh off the front of `rest`; `None` if that holds less, or a triangle names a vertex that is not there.
pub(crate) fn take_mesh(rest: &mut &[u8]) -> Option<SemanticMesh> {
    let [n, triangles]: [u32; 2] = take(rest, 2)?.try_into().ok()?;
    let triangles: Vec<[u32; 3]> = take(rest, triangles as usize)?;
    let vertices = take_cloud(rest, n as usize)?;
    let boundary = take::<u8>(rest, n as usize)?.into_iter().map(|on_boundary| on_boundary != 0).collect();
    let is_whole = triangles.iter().flatten().all(|v| *v < n);
    is_whole.then_some(SemanticMesh { vertices, boundary, triangles })
}
