//! `semascan serve`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::limit_args::LimitArgs;
use super::run::{self, Running, Target};
use super::signals::{Signals, Work};
use super::spec_args::SpecArgs;
use super::{Failure, keep, numbers, past, source};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_inspection::StopSwitch;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::record::Outcome;
use semascan_server::{
    AccessRule, EmbeddedFiles, LiveModel, LiveStream, ServeError, Server, ServerConfig, WebFiles, publish_saved,
};
use semascan_store::data::{DataFolder, Interrupted};
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
    #[arg(long, value_name = "N", value_parser = numbers::threads(), allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Arguments of `semascan serve`.
#[derive(Debug, Args)]
#[command(after_long_help = source::help())]
pub(crate) struct ServeArgs {
    /// A saved inspection to show: its folder
    #[arg(value_name = "DIR", conflicts_with_all = ["source", "out"])]
    saved: Option<PathBuf>,
    /// What to inspect (`--help` lists what there is); without it the agent waits
    #[arg(long)]
    source: Option<String>,
    /// Configuration of the cell; `semascan config --sample` prints one with every key
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Folder to write the finished inspection into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Data folder to keep inspections in while they run: their views as captures, their history and their models. Those
    /// that were cut off there are continued first, and all of them are there for the API (`/api/v1`) and for
    /// `?inspection=ID`
    #[arg(long, value_name = "DIR", conflicts_with_all = ["saved", "out", "overwrite"])]
    data: Option<PathBuf>,
    /// Replace the earlier inspection that the folder holds, when the new one is whole: until then, and where the new one
    /// fails, the earlier one stays. A folder with other files is refused
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    inspection: SpecArgs,
    #[command(flatten)]
    reach: ReachArgs,
}

impl ServeArgs {
    pub(crate) fn run(self, viewer: EmbeddedFiles, signals: &Signals) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        if let Some(folder) = self.saved {
            let saved = read_inspection(&folder)?;
            return serve(&self.reach, &config, viewer, false, Some(Job::Saved(Box::new(saved))), signals);
        }
        let mut spec = self.inspection.apply(config.inspection.clone());
        spec.source.uri = self.source.or(spec.source.uri);
        let job = match (&self.data, &spec.source.uri) {
            (Some(data), uri) => {
                let spec = uri.is_some().then(|| Box::new(keep::anchored(spec.clone())));
                Some(Job::Keep { data: Arc::new(DataFolder::open(data)?), spec })
            }
            (None, Some(_)) => {
                let open = |folder: PathBuf| Target::open(&folder, self.overwrite, false);
                let target = self.out.map(open).transpose()?.map(Box::new);
                Some(Job::Inspect { spec: Box::new(spec), target })
            }
            (None, None) => None,
        };
        serve(&self.reach, &config, viewer, false, job, signals)
    }
}

/// What is served.
pub(crate) enum Job {
    /// What is inspected and how, and where it is written to.
    Inspect { spec: Box<InspectionSpec>, target: Option<Box<Target>> },
    /// Those that were cut off in a data folder, and then what is inspected and how.
    Keep { data: Arc<DataFolder>, spec: Option<Box<InspectionSpec>> },
    /// One that was.
    Saved(Box<SavedInspection>),
}

/// Serves until a signal ends it; a running inspection is then stopped and written.
pub(crate) fn serve(
    reach: &ReachArgs,
    config: &CellConfig,
    viewer: EmbeddedFiles,
    open_browser: bool,
    job: Option<Job>,
    signals: &Signals,
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
        let past = match &job {
            Some(Job::Keep { data, .. }) => Some(Arc::new(past::past(data))),
            _ => None,
        };
        let server = Server::bind_with_past(&settings, Arc::clone(&live), past).map_err(|error| match error {
            ServeError::Bind { .. } => Failure::Work(error.into()),
            _ => Failure::Call(error.into()),
        })?;
        let address = server.local_address()?;
        let url = format!("http://{address}");
        tracing::info!("listening on {url}");
        if !address.ip().is_loopback() {
            tracing::warn!("other machines can reach this agent, and it asks nobody for a password");
        }
        let asked = signals.clone();
        // Pages are answered from now on, also while a source is opened, which may take seconds.
        let answering = tokio::spawn(server.run(async move { asked.asked_to_end().await }));
        if open_browser && let Err(error) = open::that_detached(&url) {
            tracing::info!("open {url} in a browser ({error})");
        }
        let running = match job {
            Some(Job::Inspect { spec, target }) => {
                tracing::info!("opening {}", spec.source.uri.as_deref().unwrap_or_default());
                live.say("the agent starts: it opens what is to be inspected");
                let prepared = tokio::task::spawn_blocking(|| run::prepare(*spec)).await;
                let inspection = prepared.context("the source could not be opened")??;
                live.say("");
                let running = run::start(inspection, target.map(|target| *target), signals)?;
                let (live, signals) = (Arc::clone(&live), signals.clone());
                Some(std::thread::spawn(move || follow(running, &live, &signals)))
            }
            Some(Job::Keep { data, spec }) => {
                idle(signals)?;
                let (live, signals) = (Arc::clone(&live), signals.clone());
                Some(std::thread::spawn(move || keep_all(&data, spec, &live, &signals)))
            }
            Some(Job::Saved(saved)) => {
                // First: a signal that comes while it is shown ends the server in order, too.
                idle(signals)?;
                show(&saved, &live)?;
                None
            }
            None => {
                idle(signals)?;
                None
            }
        };
        answering.await.context("the server ended unexpectedly")?;
        // What the inspection has by now is written first.
        let Some(follower) = running else { return Ok(()) };
        match follower.join() {
            Ok(result) => result,
            Err(_) => Err(Failure::Work(anyhow!("the inspection ended unexpectedly"))),
        }
    })
}

/// Continues the inspections that were cut off in `data`, one after the other, and then does the one that is asked for.
/// Returns the result of the last.
fn keep_all(
    data: &Arc<DataFolder>,
    spec: Option<Box<InspectionSpec>>,
    live: &Arc<LiveModel>,
    signals: &Signals,
) -> Result<(), Failure> {
    let mut result = Ok(());
    let interrupted = data.interrupted()?.into_iter().map(Some);
    let asked = spec.as_ref().map(|_| None);
    for interrupted in interrupted.chain(asked) {
        if signals.exit_code().is_some() {
            return result;
        }
        live.say("the agent starts: it opens what is to be inspected");
        let settings = match (&interrupted, &spec) {
            (Some(Interrupted { row, .. }), _) => match serde_json::from_str(&row.spec) {
                Ok(settings) => settings,
                Err(error) => {
                    data.close_interrupted(row, &format!("its settings cannot be read: {error}"))?;
                    continue;
                }
            },
            (None, Some(spec)) => (**spec).clone(),
            (None, None) => break,
        };
        let told = {
            let live = Arc::clone(live);
            move |text: &str| {
                if !text.is_empty() {
                    tracing::error!("{text}");
                }
                live.say(text);
            }
        };
        let prepared = keep::prepare(settings, data, interrupted.as_ref(), Box::new(told));
        live.say("");
        result = match prepared.and_then(|(inspection, target)| run::start(inspection, Some(target), signals)) {
            Ok(running) => follow(running, live, signals),
            Err(failure) => {
                tracing::error!("{}", failure.reason());
                live.say(&failure.reason());
                // One that cannot be continued is closed, and fails nothing else.
                if interrupted.is_some() { Ok(()) } else { Err(failure) }
            }
        };
    }
    result
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

/// Registers a server that has nothing to lose: a signal ends it in order.
fn idle(signals: &Signals) -> Result<(), Failure> {
    signals.begin(|| Ok(((), Work { stop: StopSwitch::default(), too_late: Box::new(|| ()) })))
}

/// Publishes an inspection to `live` until its end, and writes it; a failure is published too and does not end the server,
/// but is the command's when that ends. A save that fails is tried again as long as the server runs.
fn follow(running: Running, live: &LiveModel, signals: &Signals) -> Result<(), Failure> {
    let Running { events, handle, output } = running;
    LiveStream::new(live).follow(events);
    let not_saved = |reason: &str| {
        tracing::error!("{reason}");
        live.say(reason);
    };
    match run::finish(handle, output.as_deref(), None, &not_saved, signals) {
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
            if let Some(output) = &output {
                tracing::info!("written to {}", output.path().display());
            }
            let verdict = run::verdict(&inspected.record, signals);
            if let Err(Failure::Work(reason) | Failure::Stopped(_, reason)) = &verdict {
                tracing::warn!("{reason}");
                live.say(&reason.to_string());
            }
            verdict
        }
        Err(failure) => {
            let text = failure.reason();
            tracing::error!("inspection failed: {text}");
            live.fail(&text);
            Err(failure)
        }
    }
}

/// Limits the threads of all computations that follow; called before anything is opened, because that computes already.
pub(crate) fn use_threads(threads: Option<usize>) -> Result<(), Failure> {
    match threads {
        None => Ok(()),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}
