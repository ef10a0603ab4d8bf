//! Named random streams: each decision of the generator draws from a stream of its own, so adding a draw in one place
//! leaves every other part of a seeded scene as it was.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// A random stream that depends on a seed and a name only.
#[derive(Clone, Debug)]
pub(super) struct Stream(Pcg64Mcg);

impl Stream {
    /// The stream `name` of `seed`.
    pub(super) fn new(seed: u64, name: &str) -> Self {
        Self(Pcg64Mcg::seed_from_u64(xxh3_64_with_seed(name.as_bytes(), seed)))
    }

    /// Uniform in `[low, high)`; `low` where the range is empty.
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.0.random::<f32>()
    }

    /// Uniform in `low..=high`.
    pub(super) fn count(&mut self, low: u32, high: u32) -> u32 {
        self.0.random_range(low..=high.max(low))
    }

    /// True with probability `p`.
    pub(super) fn chance(&mut self, p: f32) -> bool {
        self.0.random::<f32>() < p
    }

    /// Normal with mean 0 and standard deviation `sigma`.
    pub(super) fn normal(&mut self, sigma: f64) -> f64 {
        let u: f64 = 1.0 - self.0.random::<f64>();
        let v: f64 = self.0.random();
        sigma * (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// A word to seed noise with.
    pub(super) fn word(&mut self) -> u32 {
        self.0.random()
    }

    /// An index below `len`, 0 where `len` is 0.
    pub(super) fn index(&mut self, len: usize) -> usize {
        if len == 0 { 0 } else { self.0.random_range(0..len) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ_by_name_and_seed() {
        let draw = |seed, name| Stream::new(seed, name).word();
        assert_eq!(draw(7, "shape"), draw(7, "shape"));
        assert_ne!(draw(7, "shape"), draw(7, "paint"));
        assert_ne!(draw(7, "shape"), draw(8, "shape"));
    }
}
