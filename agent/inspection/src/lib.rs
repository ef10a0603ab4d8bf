//! An inspection: where its views come from, the way of one view, what is found, and the record that stays.

pub mod pipeline;
pub mod record;
pub mod source;
pub mod summary;
