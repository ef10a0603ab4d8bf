//! What [Wang 2023] printed.

use serde::Serialize;

/// A row of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// Its network.
    pub network: &'static str,
    /// Accuracy, mean accuracy, mean IoU, mean precision and mean recall without class 0; per cent.
    pub figures: [f64; 5],
}

const OURS: Published = Published { network: "two streams", figures: [73.4, 68.6, 56.7, 77.9, 71.2] };

/// Its final figures.
pub(super) const TABLE_2: [Published; 1] = [OURS];

/// Its channels. The first three are colour, depth and both stacked; which is which cannot be told from the text.
pub(super) const TABLE_3: [Published; 4] = [
    Published { network: "other channels, first row", figures: [53.8, 49.5, 37.5, 60.8, 53.4] },
    Published { network: "other channels, second row", figures: [59.7, 54.7, 43.3, 65.7, 57.1] },
    Published { network: "other channels, third row", figures: [65.8, 59.6, 46.9, 70.1, 64.2] },
    OURS,
];

/// Its networks, all with two streams.
pub(super) const TABLE_4: [Published; 3] = [
    Published { network: "FCN", figures: [47.8, 44.1, 35.9, 51.1, 48.9] },
    Published { network: "plain U-Net", figures: [67.0, 64.2, 49.4, 71.2, 65.4] },
    OURS,
];
