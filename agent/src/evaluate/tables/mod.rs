//! The papers' tables, rerun on the virtual cell.

pub mod p0;
pub mod p1;
