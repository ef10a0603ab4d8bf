//! Which files were written with a record, so that a reader notices one that is missing or of another inspection.

use serde::{Deserialize, Serialize};

/// The set of files that a record belongs to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FilesRecord {
    /// Identifier of this writing of the set (a UUID). Every other file of the set carries it too: a PLY file as
    /// `comment generation`, a GLB file as `asset.extras.generation`.
    pub generation: String,
    /// The other files, relative to the folder of the record, `/` between folders.
    pub names: Vec<String>,
}
