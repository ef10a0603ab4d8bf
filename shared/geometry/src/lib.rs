//! Geometry that agent and viewer share, natively and for wasm32: oriented semantic points to a semantic mesh ([`mesh`]);
//! nearest points, areas, distances and metrics ([`measure`]), plane sections ([`section`]) and fitted geometric elements
//! ([`fit`]), so that both print the same figures; where a place can be seen from ([`occupancy`]) and how well ([`sight`]); and
//! the small maths under all ([`vector`], [`grid`], [`vote`]).

pub mod fit;
pub mod grid;
pub mod measure;
pub mod mesh;
pub mod occupancy;
pub mod section;
pub mod sight;
pub mod vector;
pub mod vote;
