//! What happens among those who look at the same inspection.

/// One thing that happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OthersEvent {
    /// The page has made a name for itself, under which it points.
    Named(String),
}
