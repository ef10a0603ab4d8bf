//! Inspections on disk.

mod folder;
mod saved;

pub use folder::{StoreError, begin_folder, write as write_file, write_inspection, write_record, write_view_clouds};
pub use saved::{SavedError, SavedInspection, read_inspection};
