//! Columns of plain values off a block of bytes, as workers and page pass them to each other.

/// Takes `n` values off the front of `rest`; `None`, and nothing is taken or allocated, if it holds fewer.
pub(crate) fn take<T: bytemuck::Pod>(rest: &mut &[u8], n: usize) -> Option<Vec<T>> {
    let (head, tail) = rest.split_at_checked(n.saturating_mul(size_of::<T>()))?;
    *rest = tail;
    // Copied bytewise: the block need not be aligned for `T`.
    let mut column = vec![T::zeroed(); n];
    bytemuck::cast_slice_mut(&mut column).copy_from_slice(head);
    Some(column)
}
