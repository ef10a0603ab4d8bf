//! `semascan init`: what a new cell needs: `cell.toml`, `criteria.toml`, a data folder, and the first user.

use super::accounts::{add_user, name};
use super::{Failure, config, password};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_model::Role;
use semascan_store::data::{DataFolder, SqliteAccounts};
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const CRITERIA: &str = include_str!("criteria.sample.toml");
const CELL_FILE: &str = "cell.toml";
const CRITERIA_FILE: &str = "criteria.toml";
const DATA_FOLDER: &str = "data";

/// Arguments of `semascan init`.
#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// The folder to make them in
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// Name of the first user, who is an administrator; the password is typed, or the first line of stdin
    #[arg(long, value_name = "NAME", value_parser = name, required_unless_present = "no_user")]
    user: Option<String>,
    /// Make no user: for an agent that only this machine reaches
    #[arg(long, conflicts_with = "user")]
    no_user: bool,
}

impl InitArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let [cell, criteria, data] = [CELL_FILE, CRITERIA_FILE, DATA_FOLDER].map(|name| self.folder.join(name));
        for path in [&cell, &criteria, &data] {
            if fs::symlink_metadata(path).is_ok() {
                return Err(Failure::Call(anyhow!("{}: is there already, and nothing is overwritten", path.display())));
            }
        }
        // Whoever gives no password or a weak one has made nothing.
        let user = match self.user {
            Some(name) => {
                let password = password::read_new(&name)?;
                semascan_server::hash_password(&name, &password).map_err(|error| Failure::Call(error.into()))?;
                Some((name, password))
            }
            None => None,
        };
        fs::create_dir_all(&self.folder).with_context(|| self.folder.display().to_string())?;
        write(&cell, config::SAMPLE)?;
        write(&criteria, CRITERIA)?;
        drop(DataFolder::open(&data)?);
        if let Some((name, password)) = &user {
            add_user(&SqliteAccounts::open(&data)?, name, Role::Admin, password)?;
        }
        tracing::info!("{}, {} and {} are made", cell.display(), criteria.display(), data.display());
        let serve = format!("semascan serve --config {} --data {}", cell.display(), data.display());
        match user {
            Some(_) => tracing::info!("begin with: {serve} --listen 0.0.0.0"),
            None => tracing::info!("begin with: {serve}"),
        }
        let criteria = criteria.display();
        tracing::info!("once {criteria} says what is acceptable of your part, add: --criteria {criteria}");
        Ok(())
    }
}

/// Writes a new file and brings it to the disk.
fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let written = OpenOptions::new().write(true).create_new(true).open(path).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()
    });
    written.map_err(|error: io::Error| anyhow!("{}: {error}", path.display()).into())
}
