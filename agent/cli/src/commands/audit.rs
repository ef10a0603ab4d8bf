//! `semascan audit`: whether the logs of reviews and accounts are what was written, and what the log of accounts says.

use super::Failure;
use crate::stdout::{print, print_json};
use anyhow::anyhow;
use clap::{Args, Subcommand};
use semascan_inspection::ports::{Accounts, BlobDigest};
use semascan_store::data::{Audited, BadEntry, DataFolder, SqliteAccounts};
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Arguments of `semascan audit`.
#[derive(Debug, Args)]
pub(crate) struct AuditArgs {
    #[command(subcommand)]
    command: AuditCommand,
}

#[derive(Debug, Subcommand)]
enum AuditCommand {
    /// Read the whole logs of reviews and accounts and name the first entry that is not what was written
    Verify(VerifyArgs),
    /// Print what was done with users, tokens and logins: when, by whom, what
    Accounts(AccountsArgs),
}

/// Arguments of `semascan audit verify`.
#[derive(Debug, Args)]
struct VerifyArgs {
    /// The data folder
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// The hash of the last review as an earlier run printed it: whether that entry is still there. Without it nothing can
    /// tell that the last entries were removed
    #[arg(long, value_name = "SHA256")]
    head: Option<BlobDigest>,
    /// The same of the log of accounts
    #[arg(long, value_name = "SHA256")]
    accounts_head: Option<BlobDigest>,
    /// Print what was found as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Arguments of `semascan audit accounts`.
#[derive(Debug, Args)]
struct AccountsArgs {
    /// The data folder
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Print the last N entries
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    last: u32,
    /// Print them as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// What `verify --json` prints: the log of reviews, and that of accounts.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    reviews: &'a Audited,
    accounts: &'a Audited,
}

impl AuditArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            AuditCommand::Verify(args) => args.run(),
            AuditCommand::Accounts(args) => args.run(),
        }
    }
}

impl VerifyArgs {
    fn run(self) -> Result<(), Failure> {
        let data = DataFolder::open_beside(&self.data)?;
        let noted = |head: Option<BlobDigest>| head.map(|head| head.to_string());
        let reviews = data.catalogue().audit(noted(self.head).as_deref())?;
        let accounts = SqliteAccounts::open(&self.data)?.audit(noted(self.accounts_head).as_deref())?;
        if self.json {
            print_json(&Report { reviews: &reviews, accounts: &accounts })?;
        }
        let (reviews, accounts) = (said(&self.data, "reviews", reviews), said(&self.data, "accounts", accounts));
        if let (Err(_), Err(other)) = (&reviews, &accounts) {
            tracing::error!("{}", other.reason());
        }
        reviews.and(accounts)
    }
}

/// Says what a log came to.
///
/// # Errors
/// [`Failure::Work`] that names the first bad entry.
fn said(data: &Path, log: &str, audited: Audited) -> Result<(), Failure> {
    let Audited { entries, head, fault } = audited;
    match fault {
        None => {
            tracing::info!("log of {log}: {entries} entries, all good; the last has the hash {head}");
            Ok(())
        }
        Some(BadEntry { sequence, id, reason }) => {
            let name = if id.is_empty() { String::new() } else { format!(" (review {id})") };
            let data = data.display();
            Err(Failure::Work(anyhow!("{data}: entry {sequence}{name} of the log of {log} {reason}")))
        }
    }
}

impl AccountsArgs {
    fn run(self) -> Result<(), Failure> {
        let mut entries = SqliteAccounts::open(&self.data)?.log(None, self.last)?;
        entries.reverse();
        if self.json {
            return print_json(&serde_json::json!({ "entries": entries }));
        }
        let mut text = String::new();
        for entry in entries {
            let _ = writeln!(text, "{:>6}  {}  {}: {}", entry.sequence, entry.at, entry.by, entry.action);
        }
        print(text.as_bytes())
    }
}
