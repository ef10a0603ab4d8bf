//! What the encoder writes the decoder reads, whatever the symbols.

use super::*;
use proptest::prelude::*;

#[test]
fn every_residual_comes_back() {
    let pairs = || (0..=255_u8).flat_map(|v| (0..=255_u8).map(move |p| (v, p)));
    let (mut encoder, mut model) = (RansEncoder::default(), ResidualModel::new());
    for (value, prediction) in pairs() {
        model.code(&mut encoder, value, prediction);
    }
    let mut bytes = Vec::new();
    encoder.finish(&mut bytes);
    let mut decoder = RansDecoder::new(&bytes).expect("a stream");
    let mut model = ResidualModel::new();
    for (value, prediction) in pairs() {
        assert_eq!(model.code(&mut decoder, 0, prediction), value);
    }
    assert!(decoder.at_end());
}

proptest! {
    #[test]
    fn symbols_and_bits_come_back(coded in prop::collection::vec((0..16_u8, any::<u8>(), 1..=8_u32), 0..500)) {
        let (mut encoder, mut model) = (RansEncoder::default(), Model::uniform(14));
        for &(symbol, bits, count) in &coded {
            encoder.symbol(&mut model, symbol);
            encoder.bits(bits >> (8 - count), count);
        }
        let mut bytes = Vec::new();
        encoder.finish(&mut bytes);
        let mut decoder = RansDecoder::new(&bytes).expect("a stream");
        let mut model = Model::uniform(14);
        for &(symbol, bits, count) in &coded {
            prop_assert_eq!(decoder.symbol(&mut model, 0), symbol);
            prop_assert_eq!(decoder.bits(0, count), bits >> (8 - count));
        }
        prop_assert!(decoder.at_end());
    }

    #[test]
    fn no_symbol_becomes_impossible(seen in prop::collection::vec(0..16_usize, 0..2000)) {
        let mut model = Model::uniform(16);
        for symbol in seen {
            model.learn(symbol);
        }
        prop_assert_eq!((0..16).map(|s| u32::from(model.interval(s).1)).sum::<u32>(), 1 << PROBABILITY_BITS);
        prop_assert!((0..16).all(|s| model.interval(s).1 > 0));
    }
}

#[test]
fn a_steady_symbol_costs_next_to_nothing() {
    let (mut meter, mut model) = (Meter::new(), Model::uniform(16));
    for _ in 0..1000 {
        meter.symbol(&mut model, 5);
    }
    assert!(meter.bits[&Plane::Occupancy] < 60.0, "{:?}", meter.bits);
}
