//! `semascan serve`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::reach::ReachArgs;
use super::run::{self, Running, Target};
use super::signals::{Signals, Work};
use super::spec_args::SpecArgs;
use super::{Failure, keep, past, source};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_inspection::StopSwitch;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::record::Outcome;
use semascan_server::{EmbeddedFiles, Entry, LiveModel, LiveStream, OpenError, ServeError, Server, Tls, publish_saved};
use semascan_store::data::{DataFolder, Interrupted};
use semascan_store::{SavedInspection, read_inspection};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

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
    let data = match &job {
        Some(Job::Keep { data, .. }) => Some(data.path()),
        _ => None,
    };
    let settings = reach.server(&config.serve, viewer, data)?;

    let live = Arc::new(LiveModel::new());
    live.set_unready(STARTS);
    // Whoever keeps inspections says it for each of them.
    let keeps = matches!(job, Some(Job::Keep { .. }));
    let runtime = tokio::runtime::Runtime::new().context("cannot start the network runtime")?;
    runtime.block_on(async {
        let past = match &job {
            Some(Job::Keep { data, .. }) => Some(Arc::new(past::past(data))),
            _ => None,
        };
        let server = Server::bind_with_past(&settings, Arc::clone(&live), past).map_err(|error| match error {
            ServeError::Bind { .. } | ServeError::Accounts(_) | ServeError::Open(OpenError::Port(_)) => {
                Failure::Work(error.into())
            }
            _ => Failure::Call(error.into()),
        })?;
        let address = server.local_address()?;
        let scheme = if settings.tls.is_some() { "https" } else { "http" };
        let url = format!("{scheme}://{address}");
        tracing::info!("listening on {url}");
        say_who_is_let_in(&settings.entry, address);
        if let Some(tls) = settings.tls.clone() {
            tokio::spawn(read_certificate_again(tls));
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
                live.say(STARTS);
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
        if !keeps {
            live.set_unready("");
        }
        answering.await.context("the server ended unexpectedly")?;
        // What the inspection has by now is written first.
        let Some(follower) = running else { return Ok(()) };
        match follower.join() {
            Ok(result) => result,
            Err(_) => Err(Failure::Work(anyhow!("the inspection ended unexpectedly"))),
        }
    })
}

/// What is said while a source is opened.
const STARTS: &str = "the agent starts: it opens what is to be inspected";

/// Says in the log who may do what.
fn say_who_is_let_in(entry: &Entry, address: SocketAddr) {
    match entry {
        Entry::Accounts(_) => tracing::info!("users log in; `semascan user` and `semascan token` say who may"),
        Entry::Local => {
            tracing::info!("no login is asked for: who uses this machine may do everything; --login asks for one");
        }
        Entry::Watch if address.ip().to_canonical().is_loopback() => {
            tracing::info!("no login is asked for: who uses this machine may watch, and nobody more");
        }
        Entry::Watch => {
            tracing::warn!(
                "everybody who reaches {address} may watch, without a login, and what is sent is not encrypted"
            );
        }
    }
}

/// Reads the certificate again whenever the process gets SIGHUP.
#[cfg(unix)]
async fn read_certificate_again(tls: Arc<Tls>) {
    use tokio::signal::unix::{SignalKind, signal};
    let mut asked = match signal(SignalKind::hangup()) {
        Ok(asked) => asked,
        Err(error) => return tracing::warn!("SIGHUP cannot be handled: {error}"),
    };
    while asked.recv().await.is_some() {
        match tls.reload() {
            Ok(()) => tracing::info!("the certificate was read again; its SHA-256 fingerprint: {}", tls.fingerprint()),
            Err(error) => tracing::error!("the certificate of before stays: {error}"),
        }
    }
}

/// There is no such signal.
#[cfg(not(unix))]
async fn read_certificate_again(_tls: Arc<Tls>) {}

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
    live.set_unready("");
    for interrupted in interrupted.chain(asked) {
        if signals.exit_code().is_some() {
            return result;
        }
        live.say(STARTS);
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
                live.set_unready(text);
            }
        };
        live.set_unready(STARTS);
        let prepared = keep::prepare(settings, data, interrupted.as_ref(), Box::new(told));
        live.set_unready("");
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
    let _in_span = running.span().entered();
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
