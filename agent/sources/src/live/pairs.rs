//! Colour and depth that belong together, as they come: a picture is paired with its nearest of the other stream as soon as no
//! nearer one can come any more.

use crate::messages::Stamp;
use crate::recording::{Picture, Topics};
use std::collections::VecDeque;
use std::time::Instant;
use tokio_tungstenite::tungstenite::Bytes;

/// Pictures of a stream that wait for the other one.
const MOST: usize = 60;

/// A picture and its message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Held {
    pub(super) picture: Picture,
    /// When it came.
    pub(super) arrived: Instant,
    pub(super) bytes: Bytes,
}

impl Held {
    fn stamp(&self) -> Stamp {
        self.picture.stamp
    }
}

/// Colour, where it has one of its own, and depth.
pub(super) type Pair = (Option<Held>, Held);

/// Pictures that wait for their pair.
#[derive(Debug)]
pub(super) struct Pairing {
    tolerance: u64,
    color: VecDeque<Held>,
    depth: VecDeque<Held>,
    /// Pictures that stayed alone.
    alone: u64,
}

impl Pairing {
    /// Pictures of a pair are no further apart than `tolerance` nanoseconds.
    pub(super) fn new(tolerance: u64) -> Self {
        Self { tolerance, color: VecDeque::new(), depth: VecDeque::new(), alone: 0 }
    }

    /// Forgets what waits.
    pub(super) fn clear(&mut self) {
        self.alone += (self.color.len() + self.depth.len()) as u64;
        self.color.clear();
        self.depth.clear();
    }

    /// Pictures that stayed alone by now.
    pub(super) fn alone(&self) -> u64 {
        self.alone
    }

    /// Takes a picture of a stream; gives the pairs that are known by now. A cloud with colours of its own is one alone.
    pub(super) fn take(&mut self, topics: Topics, stream: usize, held: Held) -> Vec<Pair> {
        if topics.color.is_none() {
            return if stream == topics.depth { vec![(None, held)] } else { Vec::new() };
        }
        let queue = match stream {
            _ if topics.color == Some(stream) => &mut self.color,
            _ if stream == topics.depth => &mut self.depth,
            _ => return Vec::new(),
        };
        let at = queue.partition_point(|other| other.stamp() <= held.stamp());
        queue.insert(at, held);
        if queue.len() > MOST {
            queue.pop_front();
            self.alone += 1;
        }
        let mut pairs = Vec::new();
        while let Some(pair) = self.next() {
            pairs.extend(pair);
        }
        pairs
    }

    /// Decides about the oldest picture: a pair, or that it stays alone; `None` while that is open.
    fn next(&mut self) -> Option<Option<Pair>> {
        let (color, depth) = (self.color.front()?.stamp(), self.depth.front()?.stamp());
        // The one that is older looks for its nearest in the other stream: it is known once a later one has come.
        let is_color_older = color <= depth;
        let (old, others) = if is_color_older { (color, &self.depth) } else { (depth, &self.color) };
        let own = if is_color_older { &self.color } else { &self.depth };
        let nearest = others.front()?.stamp();
        let offset = old.distance(nearest);
        // A later one of its own stream may be nearer to that one.
        let has_rival = match own.get(1) {
            Some(rival) => rival.stamp().distance(nearest) < offset,
            None if offset == 0 => false,
            // While the next may still come, and be nearer, it is waited for, unless the pair is as near as pairs are.
            None => offset > self.tolerance / 2,
        };
        if offset <= self.tolerance && !has_rival {
            return Some(self.color.pop_front().zip(self.depth.pop_front()).map(|(color, depth)| (Some(color), depth)));
        }
        if offset <= self.tolerance && own.len() == 1 {
            return None;
        }
        self.alone += 1;
        // Alone: no other is within the tolerance, or another one of its stream is nearer.
        if is_color_older {
            self.color.pop_front()
        } else {
            self.depth.pop_front()
        };
        Some(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Place;
    use proptest::prelude::*;

    const TOPICS: Topics = Topics { color: Some(0), depth: 1, color_calibration: None, depth_calibration: None };

    fn held(milliseconds: i64) -> Held {
        let place = Place { block: 0, offset: 0, length: 0 };
        let stamp = Stamp { nanoseconds: milliseconds * 1_000_000 };
        Held { picture: Picture { stamp, file: 0, place }, arrived: Instant::now(), bytes: Bytes::new() }
    }

    /// Pairs by the milliseconds of colour and depth, of pictures that come in this order.
    fn pairs(order: &[(usize, i64)]) -> Vec<(i64, i64)> {
        let mut pairing = Pairing::new(20_000_000);
        let found = order.iter().flat_map(|(stream, ms)| pairing.take(TOPICS, *stream, held(*ms)));
        let ms = |held: &Held| held.picture.stamp.nanoseconds / 1_000_000;
        found.map(|(color, depth)| (ms(&color.expect("a colour")), ms(&depth))).collect()
    }

    #[test]
    fn what_belongs_together_is_paired_as_it_comes_and_what_stays_alone_is_dropped() {
        assert_eq!(pairs(&[(0, 0), (1, 2), (0, 33), (1, 35)]), [(0, 2), (33, 35)]);
        assert_eq!(pairs(&[(1, 2), (0, 0), (1, 35), (0, 33)]), [(0, 2), (33, 35)]);
        // A depth picture was lost.
        assert_eq!(pairs(&[(0, 0), (0, 33), (1, 35), (0, 66), (1, 66)]), [(33, 35), (66, 66)]);
        // Far apart: the nearer one of the next comes first.
        assert_eq!(pairs(&[(0, 0), (1, 18), (0, 20), (1, 51)]), [(20, 18)]);
        assert!(pairs(&[(0, 0), (1, 500), (0, 1000), (1, 1500)]).is_empty());
    }

    #[test]
    fn a_cloud_needs_no_colours() {
        let topics = Topics { color: None, ..TOPICS };
        let mut pairing = Pairing::new(1);
        assert_eq!(pairing.take(topics, 1, held(5)).len(), 1);
        assert!(pairing.take(topics, 0, held(5)).is_empty());
    }

    proptest! {
        #[test]
        fn no_picture_is_in_two_pairs_and_none_waits_for_ever(
            order in proptest::collection::vec((0_usize..2, 0_i64..2000), 0..200)
        ) {
            let found = pairs(&order);
            for (a, b) in &found {
                prop_assert!((a - b).abs() <= 20);
            }
            let mut pairing = Pairing::new(20_000_000);
            for (stream, ms) in order {
                pairing.take(TOPICS, stream, held(ms));
            }
            prop_assert!(pairing.color.len() <= MOST && pairing.depth.len() <= MOST);
        }
    }
}
