//! How an agent is reached and by whom: arguments of `serve` and `demo`, over those of `[serve]` in `cell.toml`.

use super::config::ServeSection;
use super::limit_args::LimitArgs;
use super::{Failure, numbers};
use anyhow::anyhow;
use clap::Args;
use semascan_server::{AccessRule, EmbeddedFiles, Entry, ServerConfig, Tls, TlsFiles, WebFiles, own_certificate};
use semascan_store::data::SqliteAccounts;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const DEFAULT_PORT: u16 = 8787;
/// The folder of a certificate that the agent made, in the data folder.
const OWN_CERTIFICATE: &str = "tls";

/// How the agent is reached.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReachArgs {
    /// Port; 0 picks a free one [default: 8787]
    #[arg(long)]
    port: Option<u16>,
    /// Address to listen on; anything but loopback lets other machines in, over TLS and after a login [default: 127.0.0.1]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<IpAddr>,
    /// A name under which browsers may reach this agent (repeatable)
    #[arg(long = "allow-host", value_name = "NAME")]
    allow_hosts: Vec<String>,
    /// The origin of a page elsewhere that may follow this agent, as http://HOST:PORT (repeatable)
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    allow_origins: Vec<String>,
    /// Another agent that this agent's page may follow with ?ws=, as ws://HOST:PORT (repeatable)
    #[arg(long = "allow-agent", value_name = "AGENT")]
    allow_agents: Vec<String>,
    /// A second address at which /metrics alone is answered, without a login and TLS, to everybody who reaches it
    #[arg(long, value_name = "ADDRESS:PORT")]
    metrics: Option<SocketAddr>,
    /// Serve the viewer's files from this folder instead of the built-in ones
    #[arg(long, value_name = "DIR")]
    web_dir: Option<PathBuf>,
    /// Threads to compute with
    #[arg(long, value_name = "N", value_parser = numbers::threads(), allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    door: DoorArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Who is let in, and how.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Who is let in")]
struct DoorArgs {
    /// The certificate to show, as PEM, with those that it rests on; read again on SIGHUP. Without it, where other machines can
    /// reach the agent, one that is made in the data folder
    #[arg(long, value_name = "PEM", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The private key of the certificate, as PEM
    #[arg(long, value_name = "PEM", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Speak HTTPS on loopback, too
    #[arg(long)]
    tls: bool,
    /// Let users log in on loopback, too
    #[arg(long, conflicts_with = "anyone_may_watch")]
    login: bool,
    /// The data folder that has the users [default: that of --data]
    #[arg(long, value_name = "DIR", conflicts_with = "anyone_may_watch")]
    users: Option<PathBuf>,
    /// Let everybody who reaches the agent watch, without a login and TLS, and nobody do more
    #[arg(long)]
    anyone_may_watch: bool,
}

impl ReachArgs {
    /// What the server is started with. `data` is the data folder, where there is one.
    ///
    /// # Errors
    /// [`Failure`] naming what cannot be used.
    pub(super) fn server(
        &self,
        file: &ServeSection,
        viewer: EmbeddedFiles,
        data: Option<&Path>,
    ) -> Result<ServerConfig, Failure> {
        let loopback = SocketAddr::from((Ipv4Addr::LOCALHOST, DEFAULT_PORT));
        let mut address = file.listen.unwrap_or(loopback);
        if let Some(ip) = self.listen {
            address.set_ip(ip);
        }
        if let Some(port) = self.port {
            address.set_port(port);
        }
        let access = AccessRule {
            allowed_hosts: [self.allow_hosts.clone(), file.allow_hosts.clone()].concat(),
            allowed_origins: [self.allow_origins.clone(), file.allow_origins.clone()].concat(),
            allowed_agents: [self.allow_agents.clone(), file.allow_agents.clone()].concat(),
        };
        let users = self.door.users.as_deref().or(file.users.as_deref()).or(data);
        let entry = self.entry(file, address.ip(), users)?;
        let tls = self.tls(file, address.ip(), &entry, &access.allowed_hosts, users)?.map(Arc::new);
        let web_dir = self.web_dir.clone().or_else(|| file.web_dir.clone());
        let files = web_dir.map_or(WebFiles::Embedded(viewer), WebFiles::folder);
        let (limits, metrics) = (self.limits.apply(file.limits.clone()), self.metrics.or(file.metrics));
        Ok(ServerConfig { address, access, entry, tls, files, limits, metrics })
    }

    /// Who is let in at `address`; the server refuses it where that is too many. Where there is an identity provider, users log in
    /// on loopback, too.
    fn entry(&self, file: &ServeSection, address: IpAddr, users: Option<&Path>) -> Result<Entry, Failure> {
        let provider = file.oidc.provider()?.map(Arc::new);
        let login = (self.door.login || file.login || provider.is_some()) && !self.door.anyone_may_watch;
        if (self.door.anyone_may_watch || file.anyone_may_watch) && !self.door.login {
            return match provider {
                None => Ok(Entry::Watch),
                Some(_) => Err(Failure::Call(anyhow!("[serve.oidc]: nobody logs in where everybody may watch"))),
            };
        }
        if address.to_canonical().is_loopback() && !login {
            return Ok(Entry::Local);
        }
        match users {
            Some(folder) => Ok(Entry::Accounts { accounts: Arc::new(SqliteAccounts::open(folder)?), provider }),
            None if login => {
                Err(Failure::Call(anyhow!("users are to log in: name the data folder that has them, with --users DIR")))
            }
            None => Ok(Entry::Local),
        }
    }

    /// The certificate, where there is or has to be one.
    fn tls(
        &self,
        file: &ServeSection,
        address: IpAddr,
        entry: &Entry,
        names: &[String],
        folder: Option<&Path>,
    ) -> Result<Option<Tls>, Failure> {
        let given = match (&self.door.tls_cert, &self.door.tls_key) {
            (Some(certificate), Some(key)) => Some((certificate, key)),
            _ => match (&file.tls_cert, &file.tls_key) {
                (Some(certificate), Some(key)) => Some((certificate, key)),
                (None, None) => None,
                _ => return Err(Failure::Call(anyhow!("[serve] tls_cert and tls_key belong together"))),
            },
        };
        if let Some((certificate, key)) = given {
            let files = TlsFiles { certificate: certificate.clone(), key: key.clone() };
            return Tls::open(files).map(Some).map_err(|error| Failure::Call(error.into()));
        }
        let is_open = !address.to_canonical().is_loopback();
        let needed = is_open && matches!(entry, Entry::Accounts { .. });
        if !needed && !self.door.tls && !file.tls {
            return Ok(None);
        }
        let Some(folder) = folder else {
            let reason = "a certificate is made in the data folder: name one with --data DIR or --users DIR, or name a \
                          certificate with --tls-cert FILE --tls-key FILE";
            return Err(Failure::Call(anyhow!(reason)));
        };
        let files = own_certificate(&folder.join(OWN_CERTIFICATE), names, &[address])?;
        let tls = Tls::open(files)?;
        tracing::info!(
            "the certificate was made by this agent, and browsers warn of it: compare its SHA-256 fingerprint, {}",
            tls.fingerprint()
        );
        Ok(Some(tls))
    }
}
