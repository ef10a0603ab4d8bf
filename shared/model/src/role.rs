//! What somebody may do with an agent: four roles, each of which may do what those before it may.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A role; a later one may do everything that an earlier one may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Role {
    /// Watches inspections and reads their results.
    Viewer,
    /// Decides about parts and findings.
    Reviewer,
    /// Runs inspections and looks after the cell.
    Operator,
    /// Looks after users, tokens and what is kept.
    Admin,
}

/// What is no role.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no role: there are viewer, reviewer, operator, admin")]
pub struct InvalidRole(String);

impl Role {
    /// Every role, the least first.
    pub const ALL: [Self; 4] = [Self::Viewer, Self::Reviewer, Self::Operator, Self::Admin];

    /// Its name in files, on the command line and in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Reviewer => "reviewer",
            Self::Operator => "operator",
            Self::Admin => "admin",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Role {
    type Err = InvalidRole;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|role| role.name() == name).ok_or_else(|| InvalidRole(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_are_ordered_and_have_one_name_everywhere() {
        assert!(Role::ALL.is_sorted() && Role::Viewer < Role::Reviewer && Role::Operator < Role::Admin);
        for role in Role::ALL {
            assert_eq!(role.to_string().parse(), Ok(role));
            assert_eq!(serde_json::to_string(&role).expect("written"), format!("\"{role}\""));
        }
        let wrong = "Admin".parse::<Role>().expect_err("no role").to_string();
        assert!(wrong.contains("\"Admin\"") && wrong.contains("viewer, reviewer, operator, admin"), "{wrong}");
    }
}
