//! `semascan serve`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::spec_args::SpecArgs;
use super::{Failure, format_error, run};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_inspection::bus::Events;
use semascan_inspection::{Inspection, InspectionHandle};
use semascan_server::{AccessRule, EmbeddedFiles, LiveModel, LiveStream, Server, ServerConfig, WebFiles};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const DEFAULT_PORT: u16 = 8787;

/// How the agent is reached.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReachArgs {
    /// Port; 0 picks a free one [default: 8787]
    #[arg(long)]
    port: Option<u16>,
    /// Address to listen on; anything but loopback lets other machines in [default: 127.0.0.1]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<IpAddr>,
    /// A name under which browsers may reach this agent (repeatable)
    #[arg(long = "allow-host", value_name = "NAME")]
    allow_hosts: Vec<String>,
    /// Serve the viewer's files from this folder instead of the built-in ones
    #[arg(long, value_name = "DIR")]
    web_dir: Option<PathBuf>,
    /// Threads to compute with
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<usize>,
}

/// Arguments of `semascan serve`.
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// What to inspect; without it the agent waits
    #[arg(long)]
    source: Option<String>,
    /// Configuration of the cell
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Folder to write the finished inspection into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    inspection: SpecArgs,
    #[command(flatten)]
    reach: ReachArgs,
}

impl ServeArgs {
    pub(crate) fn run(self, viewer: EmbeddedFiles) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        let mut spec = self.inspection.apply(config.inspection.clone());
        spec.source.uri = self.source.or(spec.source.uri);
        let job = match spec.source.uri {
            Some(_) => Some(Job { inspection: run::prepare(spec)?, out: self.out }),
            None => None,
        };
        serve(&self.reach, &config, viewer, false, job)
    }
}

/// An inspection to be served, and where it is written to.
pub(crate) struct Job {
    pub(crate) inspection: Inspection,
    pub(crate) out: Option<PathBuf>,
}

/// Serves until it is interrupted; a running inspection is then stopped and written.
pub(crate) fn serve(
    reach: &ReachArgs,
    config: &CellConfig,
    viewer: EmbeddedFiles,
    open_browser: bool,
    job: Option<Job>,
) -> Result<(), Failure> {
    let loopback = SocketAddr::from((Ipv4Addr::LOCALHOST, DEFAULT_PORT));
    let mut address = config.serve.listen.unwrap_or(loopback);
    if let Some(ip) = reach.listen {
        address.set_ip(ip);
    }
    if let Some(port) = reach.port {
        address.set_port(port);
    }
    let allowed_hosts = [reach.allow_hosts.clone(), config.serve.allow_hosts.clone()].concat();
    let web_dir = reach.web_dir.clone().or_else(|| config.serve.web_dir.clone());
    let files = web_dir.map_or(WebFiles::Embedded(viewer), WebFiles::Folder);
    let settings = ServerConfig { address, access: AccessRule { allowed_hosts }, files };

    let live = Arc::new(LiveModel::new());
    let runtime = tokio::runtime::Runtime::new().context("cannot start the network runtime")?;
    runtime.block_on(async {
        let server = Server::bind(&settings, Arc::clone(&live))?;
        let address = server.local_address()?;
        let url = format!("http://{address}");
        tracing::info!("listening on {url}");
        if !address.ip().is_loopback() {
            tracing::warn!("other machines can reach this agent, and it asks nobody for a password");
        }
        if open_browser && let Err(error) = open::that_detached(&url) {
            tracing::info!("open {url} in a browser ({error})");
        }
        let running = job.map(|Job { inspection, out }| {
            let events = inspection.subscribe();
            let handle = inspection.start();
            let (live, stop) = (Arc::clone(&live), handle.stop_switch());
            (std::thread::spawn(move || follow(events, handle, out.as_deref(), &live)), stop)
        });
        server.run(interrupted()).await?;
        // The view in work is finished first, so that the record on disk is whole.
        if let Some((follower, stop)) = running {
            stop.set();
            if follower.join().is_err() {
                return Err(Failure::Work(anyhow!("the inspection ended unexpectedly")));
            }
        }
        Ok(())
    })
}

/// Publishes an inspection to `live` until its end, and writes it; a failure is published too and does not end the server.
fn follow(events: Events, handle: InspectionHandle, out: Option<&Path>, live: &LiveModel) {
    LiveStream::new(live).follow(events);
    let inspected = run::finish(handle).and_then(|inspected| {
        if let Some(folder) = out {
            run::write(folder, &inspected)?;
        }
        Ok(inspected)
    });
    match inspected {
        Ok(inspected) => {
            let totals = live.totals();
            tracing::info!(
                "{} finished: {} points; {} chunks sent in {} kB, final model {} kB",
                inspected.record.part,
                inspected.record.points,
                totals.messages,
                totals.bytes / 1000,
                totals.snapshot_bytes / 1000
            );
        }
        Err(failure) => {
            let (_, error) = failure.into_parts();
            let error = format_error(&error);
            tracing::error!("inspection failed: {error}");
            live.fail(&error);
        }
    }
}

async fn interrupted() {
    if tokio::signal::ctrl_c().await.is_err() {
        // Without signals the process can still be killed.
        std::future::pending::<()>().await;
    }
}

/// Limits the threads of all computations that follow; called before anything is opened, because that computes already.
pub(crate) fn use_threads(threads: Option<usize>) -> Result<(), Failure> {
    match threads {
        None => Ok(()),
        Some(0) => Err(Failure::Call(anyhow!("--threads 0: at least one is needed"))),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}
