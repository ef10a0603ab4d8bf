//! Why the agent's REST interface did not answer as it was asked, and whether it may later.

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ApiError {
    /// The agent did not answer, or not in time: the same may be asked again.
    Unreachable,
    /// The agent refused.
    Refused {
        /// HTTP status.
        status: u16,
        /// Why, for people.
        reason: String,
    },
}

/// Whether what was refused with `status` may be taken later: when the person has logged in again, it comes faster, or the disk is no
/// longer full.
pub fn may_pass(status: u16) -> bool {
    matches!(status, 401 | 408 | 507)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_person_or_time_can_mend_may_pass() {
        assert!([401, 408, 507].into_iter().all(may_pass));
        assert!(![400, 403, 404, 409, 413, 422].into_iter().any(may_pass));
    }
}
