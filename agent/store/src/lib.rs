//! Inspections on disk.
//!
//! | file | what |
//! |---|---|
//! | `result_folder.rs` | the folder of an inspection: a whole set of files under its name at every moment |
//! | `inspection_set.rs` | the files of a set |
//! | `generation.rs` | whether files belong together |
//! | `contents.rs` | which files of a folder are ours |
//! | `export_folder.rs` | the folder that exports are written into |
//! | `dataset_folder.rs` | the folder that a data set is written into |
//! | `write.rs`, `lock.rs` | files that are whole or not there; one writer at a time |
//! | `saved.rs` | an inspection read back |
//! | `amended.rs` | the record of a written inspection, changed |
//! | `data/` | the data folder: catalogue, blobs, captures; verified, backed up, cleared |

mod amended;
mod contents;
pub mod data;
mod dataset_folder;
mod error;
mod export_folder;
mod generation;
mod inspection_set;
#[cfg(test)]
mod kills;
mod lock;
mod result_folder;
mod saved;
mod write;

pub use amended::{AmendError, amend_record};
pub use dataset_folder::{DATASET_KIND, DatasetFolder, MANIFEST};
pub use error::StoreError;
pub use export_folder::{ExportError, ExportFolder};
pub use generation::{SetError, check_beside_record, check_folder, check_set};
pub use inspection_set::{Additions, ReportWriter};
pub use lock::FolderLock;
pub use result_folder::{Kept, ResultFolder};
pub use saved::{SavedError, SavedInspection, read_inspection, read_record};
pub use write::{check_place, write_file};
