//! Why a message from outside cannot be used.

/// Why a message cannot be used; it names the field at fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// The message ends within a field, or before it.
    #[error("field {field}: the message ends there")]
    Cut {
        /// The field.
        field: &'static str,
    },
    /// A field holds what it must not, or what is not read.
    #[error("field {field}: {reason}")]
    Field {
        /// The field.
        field: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The bytes are no message of their encoding.
    #[error("is no {encoding} message: {reason}")]
    Encoding {
        /// What they should be.
        encoding: &'static str,
        /// What is wrong.
        reason: String,
    },
}

impl MessageError {
    /// The error of one field.
    pub(crate) fn field(field: &'static str, reason: impl Into<String>) -> Self {
        Self::Field { field, reason: reason.into() }
    }
}
