//! The same work on all threads natively and on the one there is in the browser; results come in order either way.

/// `f` of every item, in order.
#[cfg(not(target_arch = "wasm32"))]
pub(super) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(f).collect()
}

/// `f` of every item, in order.
#[cfg(target_arch = "wasm32")]
pub(super) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    items.iter().map(f).collect()
}

/// `f` of every item, in order, each call with a workspace that is made once a thread or so.
#[cfg(not(target_arch = "wasm32"))]
pub(super) fn map_with<W: Default + Send, T: Sync, R: Send>(
    items: &[T],
    f: impl Fn(&mut W, &T) -> R + Sync + Send,
) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map_init(W::default, |work, item| f(work, item)).collect()
}

/// `f` of every item, in order, each call with the same workspace.
#[cfg(target_arch = "wasm32")]
pub(super) fn map_with<W: Default + Send, T: Sync, R: Send>(
    items: &[T],
    f: impl Fn(&mut W, &T) -> R + Sync + Send,
) -> Vec<R> {
    let mut work = W::default();
    items.iter().map(|item| f(&mut work, item)).collect()
}
