//! Inspections on disk.

mod folder;

pub use folder::{StoreError, write as write_file, write_inspection, write_view_clouds};
