//! An inspection: what it is run with ([`spec`]), where its views come from ([`source`]), the way of one view (the stages),
//! where the next view is taken from ([`planning`]), what happens ([`event`]), what the model shows ([`summary`]) and what is found on it ([`findings`]), what follows from that
//! ([`criteria`], [`judge`]), what people decide ([`review`]), the record that stays ([`record`]), and how all of it is kept ([`ports`], [`journal`],
//! [`recording`]).
//!
//! [`Inspection`] is the one place that puts source, segmenter, registrar and map together: the command line, the server,
//! the tables and the tests start inspections through it.

pub mod bus;
pub mod chain;
mod compose;
pub mod criteria;
pub mod event;
pub mod findings;
mod inspection;
pub mod journal;
mod pipeline;
pub mod planning;
pub mod ports;
pub mod record;
pub mod recording;
pub mod review;
pub mod source;
pub mod spec;
mod stop;
pub mod summary;
mod toml_error;
mod verdict;

pub use compose::{SetupFailure, inspected_taxonomy};
pub use inspection::{Inspected, Inspection, InspectionError, InspectionHandle};
pub use stop::StopSwitch;
pub use toml_error::explain_toml;
pub use verdict::judge;
