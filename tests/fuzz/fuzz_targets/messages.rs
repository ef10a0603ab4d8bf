//! Messages of ROS and Foxglove, any bytes: the first says of which type, the second in which encoding. They may be refused; the
//! decoders may not panic, and what they give has the size that it says.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_sources::messages::{DepthSamples, Encoding, Kind, Message, decode};

fuzz_target!(|bytes: &[u8]| {
    let [kind, encoding, message @ ..] = bytes else { return };
    let kind = Kind::ALL[usize::from(*kind) % Kind::ALL.len()];
    let encoding = Encoding::ALL[usize::from(*encoding) % Encoding::ALL.len()];
    match decode(kind, encoding, message) {
        Ok(Message::Depth(depth)) => {
            let count = match depth.samples {
                DepthSamples::Integers(values) => values.len(),
                DepthSamples::Floats(values) => values.len(),
            };
            assert_eq!(count, depth.width as usize * depth.height as usize);
        }
        Ok(Message::Cloud(cloud)) => {
            assert_eq!(cloud.positions.len(), cloud.width as usize * cloud.height as usize);
        }
        Ok(Message::Transforms(transforms)) => {
            let is_finite = |t: &semascan_sources::messages::StampedTransform| {
                t.parent_from_child.translation.vector.iter().all(|x| x.is_finite())
            };
            assert!(transforms.iter().all(is_finite));
        }
        Ok(_) | Err(_) => {}
    }
});
