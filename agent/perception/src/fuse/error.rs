//! Why a view cannot be fused or kept.

/// Why a view cannot be fused or kept.
#[derive(Debug, thiserror::Error)]
pub enum FuseError {
    /// A setting is out of range.
    #[error("map setting {field}: {reason}")]
    Config {
        /// The setting.
        field: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The picture, depth and labels of a view differ in size.
    #[error("view {view}: {field} does not match the {width}x{height} depth")]
    SizeMismatch {
        /// The view.
        view: u32,
        /// What differs.
        field: &'static str,
        /// Depth columns.
        width: u32,
        /// Depth rows.
        height: u32,
    },
    /// No pixel of the view can be placed.
    #[error("view {view}: no usable depth")]
    NoDepth {
        /// The view.
        view: u32,
    },
    /// The number of poses differs from the number of kept views.
    #[error("{poses} poses for {views} kept views")]
    PoseCount {
        /// Poses given.
        poses: usize,
        /// Views kept.
        views: usize,
    },
    /// Kept views could not be written or read back.
    #[error("kept view {view}: {source}")]
    Keep {
        /// The view.
        view: u32,
        /// The underlying I/O error.
        source: std::io::Error,
    },
}
