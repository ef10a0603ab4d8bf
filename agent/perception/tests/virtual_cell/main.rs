//! Perception on views of the virtual cell.

mod fusion_segmentation;
mod preparation;
mod region;
mod turntable;
