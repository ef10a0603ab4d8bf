//! Semascan's edge agent: captures views of a part, segments, registers and fuses them into one semantic 3D model,
//! and streams it while it grows. ARCHITECTURE.md says which room may use which.

pub mod acquire;
pub mod evaluate;
pub mod fuse;
pub mod inspect;
pub mod organized;
pub mod pipeline;
pub mod register;
pub mod segment;
pub mod serve;
pub mod store;
