//! What the whole-system tests and the benchmarks of latency and accuracy share: inspections, a served agent, a
//! native client.

pub mod agent;
pub mod client;
pub mod data;
pub mod inspect;
pub mod process;
pub mod scene;
pub mod served;
pub mod sources;
pub mod unposed;
