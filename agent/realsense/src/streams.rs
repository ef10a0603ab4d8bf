//! Which of a camera's streams are taken: one of depth and one of colours, as they were asked for, or as the camera would choose.

use crate::library::{Sensor, StreamKind, StreamProfile};
use crate::options::RealsenseOptions;

/// The number of 16-bit depth.
const Z16: i32 = 1;
/// The numbers of the formats of colours that are read, the best first, with the bytes of a pixel and the places of red, green
/// and blue in it.
const COLORS: [(i32, usize, [usize; 3]); 4] =
    [(5, 3, [0, 1, 2]), (6, 3, [2, 1, 0]), (7, 4, [0, 1, 2]), (8, 4, [2, 1, 0])];

/// A stream of one of a camera's sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chosen {
    /// The sensor's place.
    pub(crate) sensor: usize,
    pub(crate) profile: StreamProfile,
}

/// Depth and colours; the error says what there is in place of what was asked for.
pub(crate) fn choose(sensors: &[Sensor], wanted: &RealsenseOptions) -> Result<[Chosen; 2], String> {
    let mut all = Vec::new();
    for (sensor, of) in sensors.iter().enumerate() {
        let profiles = of.profiles().map_err(|error| error.to_string())?;
        all.extend(profiles.into_iter().map(|profile| Chosen { sensor, profile }));
    }
    let depth = best(&all, StreamKind::Depth, wanted.depth_size, wanted.rate)?;
    // The camera's own choice of rates differs between its sensors: colours come as often as depth.
    let color = best(&all, StreamKind::Color, wanted.color_size, Some(depth.profile.rate))?;
    Ok([depth, color])
}

/// Bytes of a pixel and the places of its colours; `None` for formats that are not read.
pub(crate) fn color_layout(format: i32) -> Option<(usize, [usize; 3])> {
    COLORS.iter().find(|(number, ..)| *number == format).map(|(_, bytes, places)| (*bytes, *places))
}

/// The place of a format among those that are read.
fn rank(kind: StreamKind, format: i32) -> Option<usize> {
    match kind {
        StreamKind::Depth => (format == Z16).then_some(0),
        StreamKind::Color => COLORS.iter().position(|(number, ..)| *number == format),
        StreamKind::Other => None,
    }
}

fn best(all: &[Chosen], kind: StreamKind, size: Option<(u32, u32)>, rate: Option<u32>) -> Result<Chosen, String> {
    let name = if kind == StreamKind::Depth { "depth" } else { "colour" };
    let readable: Vec<&Chosen> = all
        .iter()
        .filter(|chosen| chosen.profile.kind == kind && rank(kind, chosen.profile.format).is_some())
        .collect();
    if readable.is_empty() {
        return Err(format!("the camera has no {name} stream that is read"));
    }
    let fits = |chosen: &&&Chosen| {
        size.is_none_or(|size| size == chosen.profile.size) && rate.is_none_or(|rate| rate == chosen.profile.rate)
    };
    let chosen = readable.iter().filter(fits).min_by_key(|chosen| {
        let profile = &chosen.profile;
        (
            !profile.is_default,
            rank(kind, profile.format),
            u64::MAX - u64::from(profile.size.0) * u64::from(profile.size.1),
        )
    });
    chosen.map(|chosen| **chosen).ok_or_else(|| {
        let mut known: Vec<String> = readable
            .iter()
            .map(|chosen| format!("{}x{} at {}", chosen.profile.size.0, chosen.profile.size.1, chosen.profile.rate))
            .collect();
        known.dedup();
        let size = size.map_or_else(|| "any size".to_owned(), |(w, h)| format!("{w}x{h}"));
        let rate = rate.map_or_else(|| "any rate".to_owned(), |rate| format!("{rate} a second"));
        format!("the camera has no {name} stream of {size} and {rate}; there are {}", known.join(", "))
    })
}
