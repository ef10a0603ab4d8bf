//! System packages: installed here where we may (root on a Debian-like machine), else the one command to type is
//! printed and the task ends with exit code 2.

use crate::process::{capture, exists, run};
use crate::report::note;
use anyhow::Result;
use std::fmt;
use std::process::Command;

/// Something only a person can do, and the command for it.
#[derive(Debug)]
pub(crate) struct NeedsYou {
    why: String,
    command: String,
}

impl NeedsYou {
    /// `why` completes "cannot go on: ..."; `command` is typed by a person.
    pub(crate) fn new(why: impl Into<String>, command: impl Into<String>) -> Self {
        Self { why: why.into(), command: command.into() }
    }
}

impl fmt::Display for NeedsYou {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot go on: {}. Please type:\n\n    {}\n", self.why, self.command)
    }
}

impl std::error::Error for NeedsYou {}

/// Installs Debian packages because of `why`, without questions and without recommended extras.
pub(crate) fn install(why: &str, packages: &[&str]) -> Result<()> {
    let command = format!("sudo apt-get install --no-install-recommends {}", packages.join(" "));
    if !exists("apt-get") {
        let names = packages.join(", ");
        return Err(NeedsYou::new(format!("{why}; this machine has no apt-get"), format!("# install: {names}")).into());
    }
    if capture(Command::new("id").arg("-u"))? != "0" {
        return Err(NeedsYou::new(why, command).into());
    }
    note(format!("{why}: installing {}", packages.join(" ")));
    // An outdated or missing index is the usual state of a fresh machine; a failed update may still leave a usable one.
    if let Err(error) = run(apt_get().args(["-q", "update"])) {
        note(format!("going on with the package index as it is ({error})"));
    }
    run(apt_get().args(["-q", "install", "--yes", "--no-install-recommends"]).args(packages))
}

fn apt_get() -> Command {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_person_has_to_type_is_in_the_message() {
        let text = NeedsYou::new("no browser", "sudo apt-get install chromium").to_string();
        assert!(text.contains("no browser") && text.contains("    sudo apt-get install chromium"), "{text}");
    }
}
