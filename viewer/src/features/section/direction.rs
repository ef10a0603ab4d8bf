//! What a section plane lies across, and where its offset is counted from.

/// The direction that a plane lies across.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Direction {
    /// The x axis of the table frame.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    #[default]
    Z,
    /// The direction that the camera looked in, through the middle of what it looked at.
    Camera {
        /// Unit vector towards the camera.
        normal: [f64; 3],
        /// Metres, table frame.
        through: [f64; 3],
    },
    /// The normal of the surface at a point.
    Surface {
        /// Unit normal.
        normal: [f64; 3],
        /// The point, metres, table frame.
        through: [f64; 3],
    },
}

impl Direction {
    /// The axes of the table frame.
    pub const AXES: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Unit vector.
    pub fn normal(self) -> [f64; 3] {
        match self {
            Self::X => [1.0, 0.0, 0.0],
            Self::Y => [0.0, 1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
            Self::Camera { normal, .. } | Self::Surface { normal, .. } => normal,
        }
    }

    /// The place with offset 0, metres, table frame.
    pub fn origin(self) -> [f64; 3] {
        match self {
            Self::X | Self::Y | Self::Z => [0.0; 3],
            Self::Camera { through, .. } | Self::Surface { through, .. } => through,
        }
    }

    /// Its name in identifiers.
    pub fn key(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Camera { .. } => "camera",
            Self::Surface { .. } => "surface",
        }
    }

    /// The offsets between which a box (metres, table frame) lies.
    pub fn range(self, [low, high]: [[f64; 3]; 2]) -> [f64; 2] {
        let (normal, origin) = (self.normal(), self.origin());
        let mut range = [0.0; 2];
        for k in 0..3 {
            let ends = [normal[k] * (low[k] - origin[k]), normal[k] * (high[k] - origin[k])];
            range[0] += ends[0].min(ends[1]);
            range[1] += ends[0].max(ends[1]);
        }
        range
    }
}
