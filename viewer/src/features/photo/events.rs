//! What happens to the photographs that colour the mesh.

use super::ShownPhotograph;

/// One thing that happens to them.
#[derive(Clone, Debug, PartialEq)]
pub enum PhotoEvent {
    /// There are photographs again, and the colours have meant them all along.
    Resumed,
    /// These photographs colour the mesh now.
    Shown {
        /// The photographs, those that matter most first.
        photographs: Vec<ShownPhotograph>,
        /// How many of those that shall are still on their way, wholly or in full size.
        missing: usize,
    },
}
