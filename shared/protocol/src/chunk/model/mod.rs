//! Adaptive probabilities of small symbols, and the coder seam: the same description of the format encodes, decodes and
//! measures.
//!
//! A [`Model`] holds the cumulative distribution of up to 16 symbols and moves it towards each symbol it sees (as AV1's
//! and LZNA's multi-symbol models do; sixteen 16-bit lanes, so the compiler makes a few SIMD instructions of it). Chunks
//! are small: a model learns within some dozen symbols and there are no tables to send.

use super::rans::{PROBABILITY_BITS, RansDecoder, RansEncoder};

const TOTAL: i32 = 1 << PROBABILITY_BITS;

/// Adaptive distribution of symbols 0..16.
#[derive(Clone, Debug)]
pub(super) struct Model {
    /// `cumulative[s]` = sum of the frequencies of the symbols below s; strictly increasing, so no symbol is impossible.
    cumulative: [i16; 16],
    /// Symbols seen, up to the length of [`Model::RATES`].
    seen: u8,
}

/// `TARGETS[s]` is the distribution in which s has all but the least frequency.
const TARGETS: [[i16; 16]; 16] = {
    let mut targets = [[0; 16]; 16];
    let mut s = 0;
    while s < 16 {
        let mut i = 0;
        while i < 16 {
            targets[s][i] = if i <= s { i as i16 } else { (TOTAL - 16 + i as i32) as i16 };
            i += 1;
        }
        s += 1;
    }
    targets
};

impl Model {
    /// Adaptation shifts of the first symbols; the last one stays.
    const RATES: [u8; 255] = {
        let mut rates = [0; 255];
        let mut seen = 0;
        while seen < rates.len() {
            rates[seen] = match seen {
                0..3 => 3,
                3..12 => 4,
                12..40 => 5,
                40..150 => 6,
                _ => 7,
            };
            seen += 1;
        }
        rates
    };

    /// All of the first `symbols` equally likely, the rest nearly impossible.
    pub(super) const fn uniform(symbols: usize) -> Self {
        let mut cumulative = [0; 16];
        let share = (TOTAL - (16 - symbols as i32)) / symbols as i32;
        let mut i = 1;
        while i < 16 {
            let below = if i < symbols { i as i32 * share } else { TOTAL - (16 - i as i32) };
            cumulative[i] = below as i16;
            i += 1;
        }
        Self { cumulative, seen: 0 }
    }

    /// All of the first `symbols` about equally likely, and not to be talked out of it by the first few.
    pub(super) const fn flat(symbols: usize) -> Self {
        Self { seen: 40, ..Self::uniform(symbols) }
    }

    fn interval(&self, symbol: usize) -> (u16, u16) {
        let start = self.cumulative[symbol];
        let end = self.cumulative.get(symbol + 1).map_or(TOTAL, |&c| i32::from(c));
        (start as u16, (end - i32::from(start)) as u16)
    }

    fn find(&self, slot: u16) -> usize {
        let below: i16 = self.cumulative.iter().map(|&c| i16::from(c <= slot as i16)).sum();
        // cumulative[0] is 0, so at least one counts.
        (below as usize).wrapping_sub(1) & 15
    }

    fn learn(&mut self, symbol: usize) {
        let rate = Self::RATES[usize::from(self.seen)];
        self.seen = (self.seen + 1).min(Self::RATES.len() as u8 - 1);
        for (c, t) in self.cumulative.iter_mut().zip(&TARGETS[symbol & 15]) {
            *c += (t - *c) >> rate;
        }
    }
}

/// Which column a symbol belongs to, for measuring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Plane {
    /// Which voxels hold a point.
    Occupancy,
    /// Positions inside the voxels.
    Position,
    /// Octahedral normals.
    Normal,
    /// Colours.
    Color,
    /// Component labels, and where any of label, defect, instance and flags differs from its neighbours.
    Label,
    /// Defects, instances and flags.
    Marks,
    /// Shares and sigmas.
    Shares,
    /// Numbers of views.
    Views,
}

/// One direction of the codec. Each method takes the value to write and returns the value that is true on both sides:
/// an encoder returns what it was given, a decoder ignores it and returns what it read.
pub(super) trait Coder {
    /// A symbol below 16 under an adaptive model.
    fn symbol(&mut self, model: &mut Model, value: u8) -> u8;
    /// `count` equally likely bits, at most 8.
    fn bits(&mut self, value: u8, count: u32) -> u8;
    /// What follows belongs to `plane`.
    fn enter(&mut self, _plane: Plane) {}
}

impl Coder for RansEncoder {
    fn symbol(&mut self, model: &mut Model, value: u8) -> u8 {
        let symbol = usize::from(value & 15);
        let (start, frequency) = model.interval(symbol);
        self.put(start, frequency);
        model.learn(symbol);
        value & 15
    }

    fn bits(&mut self, value: u8, count: u32) -> u8 {
        let shift = PROBABILITY_BITS - count;
        self.put(u16::from(value) << shift, 1 << shift);
        value
    }
}

impl Coder for RansDecoder<'_> {
    fn symbol(&mut self, model: &mut Model, _value: u8) -> u8 {
        let symbol = model.find(self.slot());
        let (start, frequency) = model.interval(symbol);
        self.advance(start, frequency);
        model.learn(symbol);
        symbol as u8
    }

    fn bits(&mut self, _value: u8, count: u32) -> u8 {
        let shift = PROBABILITY_BITS - count;
        let value = self.slot() >> shift;
        self.advance(value << shift, 1 << shift);
        value as u8
    }
}

/// Adds up the ideal code length by plane instead of writing.
#[derive(Debug)]
pub(super) struct Meter {
    plane: Plane,
    /// Bits by plane.
    pub(super) bits: std::collections::BTreeMap<Plane, f64>,
}

impl Meter {
    pub(super) fn new() -> Self {
        Self { plane: Plane::Occupancy, bits: std::collections::BTreeMap::new() }
    }

    fn add(&mut self, bits: f64) {
        *self.bits.entry(self.plane).or_default() += bits;
    }
}

impl Coder for Meter {
    fn symbol(&mut self, model: &mut Model, value: u8) -> u8 {
        let symbol = usize::from(value & 15);
        self.add(f64::from(PROBABILITY_BITS) - f64::from(model.interval(symbol).1).log2());
        model.learn(symbol);
        value & 15
    }

    fn bits(&mut self, value: u8, count: u32) -> u8 {
        self.add(f64::from(count));
        value
    }

    fn enter(&mut self, plane: Plane) {
        self.plane = plane;
    }
}

/// Models of a byte-sized residual: zigzag, small values as one symbol, larger ones as a bucket and equally likely bits.
#[derive(Clone, Debug)]
pub(super) struct ResidualModel(Model);

/// First value of each bucket that has extra bits, and how many.
const BUCKETS: [(u8, u32); 8] = [(8, 1), (10, 1), (12, 2), (16, 3), (24, 4), (40, 5), (72, 6), (136, 7)];

/// The symbol of each value: itself below 8, else 8 more than its bucket.
const SYMBOLS: [u8; 256] = {
    let mut symbols = [0; 256];
    let mut value = 0;
    while value < 256 {
        let mut symbol = if value < 8 { value as u8 } else { 15 };
        while symbol > 8 && BUCKETS[symbol as usize - 8].0 as usize > value {
            symbol -= 1;
        }
        symbols[value] = symbol;
        value += 1;
    }
    symbols
};

impl ResidualModel {
    /// Nothing known yet.
    pub(super) const fn new() -> Self {
        Self(Model::uniform(16))
    }

    /// Codes `value` as the difference to `prediction`, modulo 256.
    pub(super) fn code<C: Coder>(&mut self, coder: &mut C, value: u8, prediction: u8) -> u8 {
        let difference = value.wrapping_sub(prediction) as i8;
        let zigzag = ((difference << 1) ^ (difference >> 7)) as u8;
        let zigzag = self.code_magnitude(coder, zigzag);
        let difference = (zigzag >> 1) as i8 ^ -((zigzag & 1) as i8);
        prediction.wrapping_add(difference as u8)
    }

    fn code_magnitude<C: Coder>(&mut self, coder: &mut C, value: u8) -> u8 {
        let symbol = coder.symbol(&mut self.0, SYMBOLS[usize::from(value)]);
        if symbol < 8 { symbol } else { Self::extra(coder, symbol, value) }
    }

    fn extra<C: Coder>(coder: &mut C, symbol: u8, value: u8) -> u8 {
        let (first, count) = BUCKETS[usize::from(symbol & 7)];
        first.wrapping_add(coder.bits(value.wrapping_sub(first), count))
    }
}

#[cfg(test)]
mod tests;
