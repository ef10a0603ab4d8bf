//! Map -> what an inspection is after: the components and defects of a part, with their figures.

mod summary;

pub use summary::{ClassSummary, summarize};
