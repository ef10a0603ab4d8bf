//! Work on many items at once: on all cores natively, one after the other in WebAssembly.
//!
//! Items are cut into pieces of a fixed size, so that a result never depends on the number of threads.

#[cfg(not(target_arch = "wasm32"))]
use rayon::prelude::*;

/// Items that one thread takes at a time.
const PIECE: usize = 2048;

/// Fills `output` piece by piece: `work` is given consecutive items and the equally many places of their results.
pub(super) fn fill<I: Sync, O: Send>(input: &[I], output: &mut [O], work: impl Fn(&[I], &mut [O]) + Sync) {
    #[cfg(not(target_arch = "wasm32"))]
    input.par_chunks(PIECE).zip(output.par_chunks_mut(PIECE)).for_each(|(i, o)| work(i, o));
    #[cfg(target_arch = "wasm32")]
    input.chunks(PIECE).zip(output.chunks_mut(PIECE)).for_each(|(i, o)| work(i, o));
}

/// Runs both, beside each other where there are threads.
pub(super) fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(not(target_arch = "wasm32"))]
    return rayon::join(a, b);
    #[cfg(target_arch = "wasm32")]
    return (a(), b());
}
