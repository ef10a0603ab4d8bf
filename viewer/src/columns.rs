//! Columns of plain values as one block of bytes: how clouds cross between page and workers.
//!
//! Both ends are the same build, so the layout is no public contract; lengths are checked all the same.

use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};

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
