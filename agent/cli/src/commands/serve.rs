//! `semascan serve`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::limit_args::LimitArgs;
use super::run::{self, Output};
use super::spec_args::SpecArgs;
use super::{Failure, format_error};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_inspection::bus::Events;
use semascan_inspection::{Inspection, InspectionHandle};
use semascan_model::record::Outcome;
use semascan_server::{
    AccessRule, EmbeddedFiles, LiveModel, LiveStream, ServeError, Server, ServerConfig, WebFiles, publish_saved,
};
use semascan_store::{SavedInspection, read_inspection};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
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
    /// The origin of a page elsewhere that may follow this agent, as http://HOST:PORT (repeatable)
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    allow_origins: Vec<String>,
    /// Another agent that this agent's page may follow with ?ws=, as ws://HOST:PORT (repeatable)
    #[arg(long = "allow-agent", value_name = "AGENT")]
    allow_agents: Vec<String>,
    /// Serve the viewer's files from this folder instead of the built-in ones
    #[arg(long, value_name = "DIR")]
    web_dir: Option<PathBuf>,
    /// Threads to compute with
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Arguments of `semascan serve`.
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// A saved inspection to show: its folder
    #[arg(value_name = "DIR", conflicts_with_all = ["source", "out"])]
    saved: Option<PathBuf>,
    /// What to inspect; without it the agent waits
    #[arg(long)]
    source: Option<String>,
    /// Configuration of the cell
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Folder to write the finished inspection into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into the folder even if it holds something: the results of an earlier inspection are replaced
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    inspection: SpecArgs,
    #[command(flatten)]
    reach: ReachArgs,
}

impl ServeArgs {
    pub(crate) fn run(self, viewer: EmbeddedFiles) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        if let Some(folder) = self.saved {
            let saved = read_inspection(&folder)?;
            return serve(&self.reach, &config, viewer, false, Some(Job::Saved(Box::new(saved))));
        }
        let mut spec = self.inspection.apply(config.inspection.clone());
        spec.source.uri = self.source.or(spec.source.uri);
        let job = match spec.source.uri {
            Some(_) => {
                let inspection = run::prepare(spec)?;
                let begin = |out: &PathBuf| Output::begin(out, &inspection, self.overwrite);
                let output = self.out.as_ref().map(begin).transpose()?;
                Some(Job::Inspect { inspection: Box::new(inspection), output })
            }
            None => None,
        };
        serve(&self.reach, &config, viewer, false, job)
    }
}

/// What is served.
pub(crate) enum Job {
    /// An inspection that is run, and where it is written to.
    Inspect { inspection: Box<Inspection>, output: Option<Output> },
    /// One that was.
    Saved(Box<SavedInspection>),
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
    let access = AccessRule {
        allowed_hosts: [reach.allow_hosts.clone(), config.serve.allow_hosts.clone()].concat(),
        allowed_origins: [reach.allow_origins.clone(), config.serve.allow_origins.clone()].concat(),
        allowed_agents: [reach.allow_agents.clone(), config.serve.allow_agents.clone()].concat(),
    };
    let web_dir = reach.web_dir.clone().or_else(|| config.serve.web_dir.clone());
    let files = web_dir.map_or(WebFiles::Embedded(viewer), WebFiles::folder);
    let limits = reach.limits.apply(config.serve.limits.clone());
    let settings = ServerConfig { address, access, files, limits };

    let live = Arc::new(LiveModel::new());
    let runtime = tokio::runtime::Runtime::new().context("cannot start the network runtime")?;
    runtime.block_on(async {
        let server = Server::bind(&settings, Arc::clone(&live)).map_err(|error| match error {
            ServeError::Bind { .. } => Failure::Work(error.into()),
            _ => Failure::Call(error.into()),
        })?;
        let address = server.local_address()?;
        let url = format!("http://{address}");
        tracing::info!("listening on {url}");
        if !address.ip().is_loopback() {
            tracing::warn!("other machines can reach this agent, and it asks nobody for a password");
        }
        if open_browser && let Err(error) = open::that_detached(&url) {
            tracing::info!("open {url} in a browser ({error})");
        }
        let running = match job {
            Some(Job::Inspect { inspection, output }) => {
                let events = inspection.subscribe();
                let handle = inspection.start();
                let (live, stop) = (Arc::clone(&live), handle.stop_switch());
                Some((std::thread::spawn(move || follow(events, handle, output.as_ref(), &live)), stop))
            }
            Some(Job::Saved(saved)) => {
                show(&saved, &live)?;
                None
            }
            None => None,
        };
        server.run(run::interrupted()).await;
        // The view in work is finished first, so that the record on disk is whole.
        let Some((follower, stop)) = running else { return Ok(()) };
        stop.set();
        match follower.join() {
            Ok(result) => result,
            Err(_) => Err(Failure::Work(anyhow!("the inspection ended unexpectedly"))),
        }
    })
}

/// Publishes a saved inspection to `live`.
fn show(saved: &SavedInspection, live: &LiveModel) -> Result<(), Failure> {
    let SavedInspection { record, cloud, taxonomy } = saved;
    let doubled = publish_saved(live, record, taxonomy, cloud)?;
    if doubled > 0 {
        tracing::warn!("{doubled} points are not shown: they share a voxel with another");
    }
    tracing::info!("{} of {}: {} points", record.part, record.began, record.points);
    match &record.outcome {
        Outcome::Finished => {}
        Outcome::Running => tracing::warn!("this inspection did not end: it was killed, or still runs"),
        Outcome::Stopped => tracing::warn!("this inspection was stopped after {} views", record.views.len()),
        Outcome::Failed { reason } => tracing::warn!("this inspection failed: {reason}"),
    }
    Ok(())
}

/// Publishes an inspection to `live` until its end, and writes it; a failure is published too and does not end the server,
/// but is the command's when that ends.
fn follow(events: Events, handle: InspectionHandle, output: Option<&Output>, live: &LiveModel) -> Result<(), Failure> {
    LiveStream::new(live).follow(events);
    match run::finish(handle, output) {
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
            let verdict = run::verdict(&inspected.record);
            if let Err(Failure::Work(reason)) = &verdict {
                tracing::warn!("{reason}");
                live.say(&reason.to_string());
            }
            verdict
        }
        Err(failure) => {
            let (_, error) = failure.into_parts();
            let text = format_error(&error);
            tracing::error!("inspection failed: {text}");
            live.fail(&text);
            Err(Failure::Work(error))
        }
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
