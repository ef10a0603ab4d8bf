//! Interleaved range asymmetric numeral systems (rANS) with 15-bit probabilities.
//!
//! After [Duda 2013], in the streaming form of [Giesen 2014]: two 32-bit states take turns, so that their dependency
//! chains overlap in the processor, and refill 16 bits at a time from one stream. A decoder needs neither division nor
//! tables, and a damaged stream does not bring the states back to where the encoder began: corruption is seen for free.

/// log2 of the sum of all frequencies.
pub(super) const PROBABILITY_BITS: u32 = 15;
/// Lower end of the interval of a normalised state, and the state an encoder begins with.
const LOW: u32 = 1 << 16;
/// Bytes of the two final states in front of the stream.
const STATE_BYTES: usize = 8;

/// Collects symbols; rANS is last in, first out, so the bytes are made backwards at the end.
#[derive(Debug, Default)]
pub(super) struct RansEncoder {
    symbols: Vec<(u16, u16)>,
    words: Vec<u16>,
}

impl RansEncoder {
    /// Appends the symbol that owns `[start, start + frequency)` of 2^15; `frequency` > 0.
    pub(super) fn put(&mut self, start: u16, frequency: u16) {
        self.symbols.push((start, frequency));
    }

    /// Writes everything put so far to `out` and is empty again.
    pub(super) fn finish(&mut self, out: &mut Vec<u8>) {
        let mut states = [LOW; 2];
        self.words.clear();
        for (i, &(start, frequency)) in self.symbols.iter().enumerate().rev() {
            let (start, frequency) = (u32::from(start), u32::from(frequency));
            let mut x = states[i & 1];
            if u64::from(x) >= u64::from(frequency) << (32 - PROBABILITY_BITS) {
                self.words.push(x as u16);
                x >>= 16;
            }
            states[i & 1] = ((x / frequency) << PROBABILITY_BITS) + x % frequency + start;
        }
        self.symbols.clear();
        out.reserve(STATE_BYTES + 2 * self.words.len());
        for state in states {
            out.extend_from_slice(&state.to_le_bytes());
        }
        for word in self.words.iter().rev() {
            out.extend_from_slice(&word.to_le_bytes());
        }
    }
}

/// Reads what [`RansEncoder`] wrote. Bytes past the end read as zero and are detected by [`RansDecoder::at_end`].
#[derive(Debug)]
pub(super) struct RansDecoder<'a> {
    /// The state whose turn it is, and the other one.
    states: [u32; 2],
    words: std::slice::ChunksExact<'a, u8>,
    overrun: bool,
}

impl<'a> RansDecoder<'a> {
    /// A decoder at the beginning of `bytes`, or `None` if they are too short or of odd length to be a stream.
    pub(super) fn new(bytes: &'a [u8]) -> Option<Self> {
        let (first, rest) = bytes.split_first_chunk::<4>()?;
        let (second, rest) = rest.split_first_chunk::<4>()?;
        let states = [u32::from_le_bytes(*first), u32::from_le_bytes(*second)];
        let normalised = states.iter().all(|&x| x >= LOW);
        (normalised && rest.len() % 2 == 0).then(|| Self { states, words: rest.chunks_exact(2), overrun: false })
    }

    /// Where in 0..2^15 the next symbol lies.
    pub(super) fn slot(&self) -> u16 {
        (self.states[0] & ((1 << PROBABILITY_BITS) - 1)) as u16
    }

    /// Takes the next symbol, which owns `[start, start + frequency)` and holds the present slot.
    pub(super) fn advance(&mut self, start: u16, frequency: u16) {
        let slot = u32::from(self.slot());
        let [x, other] = self.states;
        let mut x = u32::from(frequency) * (x >> PROBABILITY_BITS) + (slot - u32::from(start));
        if x < LOW {
            let word = match self.words.next() {
                Some(w) => u32::from(u16::from_le_bytes([w[0], w[1]])),
                None => {
                    self.overrun = true;
                    0
                }
            };
            x = (x << 16) | word;
        }
        self.states = [other, x];
    }

    /// Whether the stream was used up exactly and both states are back where the encoder began.
    pub(super) fn at_end(&self) -> bool {
        !self.overrun && self.words.len() == 0 && self.states == [LOW; 2]
    }
}
