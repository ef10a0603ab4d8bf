//! `semascan serve`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::criteria_file::CriteriaFile;
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
use std::cell::Cell;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;

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
    /// Judge what the inspections find by these criteria, those that are continued, too
    #[arg(long, value_name = "TOML", conflicts_with = "saved")]
    criteria: Option<PathBuf>,
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
        let criteria = self.criteria.as_deref().or(config.serve.criteria.as_deref());
        let criteria = criteria.map(CriteriaFile::open).transpose()?;
        let spec = config.complete(self.inspection.apply(config.inspection.clone()), self.source);
        // Who writes into a folder of their own does not keep.
        let data = self.data.as_ref().or(config.cell.data.as_ref().filter(|_| self.out.is_none()));
        let job = match (data, &spec.source.uri) {
            (Some(data), uri) => {
                let spec = uri.is_some().then(|| Box::new(keep::anchored(spec.clone())));
                Some(Job::Keep { data: Arc::new(DataFolder::open(data)?), spec, criteria })
            }
            (None, Some(_)) => {
                let open = |folder: PathBuf| Target::open(&folder, self.overwrite, false);
                let target = self.out.map(open).transpose()?.map(Box::new);
                Some(Job::Inspect { spec: Box::new(spec), target, criteria })
            }
            (None, None) => None,
        };
        serve(&self.reach, &config, viewer, false, job, signals)
    }
}

/// What is served.
pub(crate) enum Job {
    /// What is inspected and how, where it is written to, and what it is judged by.
    Inspect { spec: Box<InspectionSpec>, target: Option<Box<Target>>, criteria: Option<CriteriaFile> },
    /// Those that were cut off in a data folder, then what is inspected and how, and what all of them are judged by.
    Keep { data: Arc<DataFolder>, spec: Option<Box<InspectionSpec>>, criteria: Option<CriteriaFile> },
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
        if let Some(address) = server.metrics_address()? {
            tracing::info!("metrics at http://{address}/metrics, for everybody who reaches it");
        }
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
        let (refuse, refused) = oneshot::channel();
        let running = match job {
            Some(Job::Inspect { spec, target, criteria }) => {
                tracing::info!("opening {}", spec.source.uri.as_deref().unwrap_or_default());
                live.say(STARTS);
                let prepared = tokio::task::spawn_blocking(move || {
                    let inspection = run::prepare(*spec.clone())?;
                    let taxonomy = &inspection.info().taxonomy;
                    let criteria = criteria.map(|criteria| criteria.for_classes(&spec, taxonomy)).transpose()?;
                    Ok::<_, Failure>((inspection, criteria))
                });
                let (inspection, criteria) = prepared.await.context("the source could not be opened")??;
                live.say("");
                let target = target.map(|target| target.judged_by(criteria.clone()));
                let running = Running { criteria, ..run::start(inspection, target, signals)? };
                let (live, signals) = (Arc::clone(&live), signals.clone());
                Some(std::thread::spawn(move || follow(running, &live, &signals)))
            }
            Some(Job::Keep { data, spec, criteria }) => {
                idle(signals)?;
                let (live, signals) = (Arc::clone(&live), signals.clone());
                Some(std::thread::spawn(move || keep_all(&data, spec, criteria.as_ref(), &live, &signals, refuse)))
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
        tokio::select! {
            ended = answering => ended.context("the server ended unexpectedly")?,
            Ok(failure) = refused => return Err(failure),
        }
        // What the inspection has by now is written first.
        let Some(follower) = running else { return Ok(()) };
        match follower.join() {
            Ok(result) => result,
            Err(_) => Err(Failure::Work(anyhow!("the inspection ended unexpectedly"))),
        }
    })
}

/// How long after an obstacle was met it is tried again.
const AGAIN: Duration = Duration::from_millis(500);

/// What is said while a source is opened.
const STARTS: &str = "the agent starts: it opens what is to be inspected";

/// Says in the log who may do what.
fn say_who_is_let_in(entry: &Entry, address: SocketAddr) {
    match entry {
        Entry::Accounts { provider, .. } => {
            tracing::info!("users log in; `semascan user` and `semascan token` say who may");
            if let Some(provider) = provider {
                let (name, callback) = (provider.name(), provider.callback());
                tracing::info!(
                    "people of {name} log in, too; it sends them back to {callback}, which is registered there"
                );
            }
        }
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

/// Continues the inspections that were cut off in `data`, one after the other, and then does the one that is asked for; all of
/// them are judged by `criteria`. Returns the result of the last. A wrong call, such as one whose source is not there, goes to
/// `refuse`, which ends the server.
fn keep_all(
    data: &Arc<DataFolder>,
    spec: Option<Box<InspectionSpec>>,
    criteria: Option<&CriteriaFile>,
    live: &Arc<LiveModel>,
    signals: &Signals,
    refuse: oneshot::Sender<Failure>,
) -> Result<(), Failure> {
    let mut result = Ok(());
    let interrupted = unless_hindered(live, signals, || Ok(data.interrupted()?))?;
    for interrupted in interrupted {
        if signals.exit_code().is_some() {
            return result;
        }
        let settings = match serde_json::from_str(&interrupted.row.spec) {
            Ok(settings) => settings,
            Err(error) => {
                let reason = format!("its settings cannot be read: {error}");
                unless_hindered(live, signals, || Ok(data.close_interrupted(&interrupted.row, &reason)?))?;
                continue;
            }
        };
        // One that cannot be continued is closed, and fails nothing else.
        if let Ok(running) = begin(&settings, data, criteria, Some(interrupted), live, signals) {
            result = follow(running, live, signals);
        }
    }
    match spec {
        Some(spec) if signals.exit_code().is_none() => match begin(&spec, data, criteria, None, live, signals) {
            Ok(running) => follow(running, live, signals),
            // If nobody takes it, the server ends by itself, and this is the command's failure.
            Err(wrong @ Failure::Call(_)) => refuse.send(wrong),
            Err(failure) => Err(failure),
        },
        _ => {
            live.set_unready("");
            result
        }
    }
}

/// Begins an inspection as `spec` says that is kept in `data` and judged by `criteria`; it continues `interrupted` if that is given. An obstacle is waited
/// for.
fn begin(
    spec: &InspectionSpec,
    data: &Arc<DataFolder>,
    criteria: Option<&CriteriaFile>,
    mut interrupted: Option<Interrupted>,
    live: &Arc<LiveModel>,
    signals: &Signals,
) -> Result<Running, Failure> {
    let mut is_first = true;
    let begun = unless_hindered(live, signals, || {
        // What an earlier try has left is gone on with.
        if !is_first && interrupted.is_none() {
            interrupted = data.interrupted()?.pop();
        }
        if is_first {
            live.say(STARTS);
            live.set_unready(STARTS);
        }
        is_first = false;
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
        let (inspection, target) = keep::prepare(spec.clone(), data, criteria, interrupted.as_ref(), Box::new(told))?;
        let running = run::start(inspection, Some(target), signals)?;
        live.set_unready("");
        live.say("");
        Ok(running)
    });
    begun.inspect_err(|failure| {
        // A wrong call is said where it ends the command.
        if !matches!(failure, Failure::Call(_)) {
            tracing::error!("{}", failure.reason());
        }
        live.set_unready("");
        live.say(&failure.reason());
    })
}

/// Does `work`; where an obstacle is in the way, which `/readyz` then tells, again until it is gone or a signal comes.
fn unless_hindered<T>(
    live: &LiveModel,
    signals: &Signals,
    mut work: impl FnMut() -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut told = String::new();
    loop {
        let failure = match work() {
            Err(failure) if failure.obstacle().is_some() && signals.exit_code().is_none() => failure,
            done => return done,
        };
        let reason = format!("nothing can be kept: {}; it is tried again", failure.reason());
        if told != reason {
            tracing::error!("{reason}");
        }
        live.say(&reason);
        live.set_unready(&reason);
        told = reason;
        std::thread::sleep(AGAIN);
    }
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
    let Running { events, handle, output, criteria, trigger } = running;
    live.take_captures(&handle.id().to_string(), trigger);
    LiveStream::new(live).follow(events);
    live.end_captures();
    let was_hindered = Cell::new(false);
    let not_saved = |reason: &str| {
        was_hindered.set(true);
        tracing::error!("{reason}");
        live.say(reason);
        live.set_unready(reason);
    };
    let finished = run::finish(handle, output.as_deref(), criteria.as_deref(), None, &not_saved, signals);
    live.set_unready("");
    match finished {
        Ok(inspected) => {
            if was_hindered.get() {
                live.say("");
            }
            let totals = live.totals();
            tracing::info!(
                "{} finished: {} points; {} chunks sent in {} kB, final model {} kB",
                inspected.record.part,
                inspected.record.points,
                totals.messages,
                totals.bytes / 1000,
                totals.snapshot_bytes / 1000
            );
            if let Some(verdict) = &inspected.record.verdict {
                let (decision, criteria) = (verdict.decision(), &verdict.criteria);
                tracing::info!("judged by {} {}: {}", criteria.name, criteria.revision, decision.name());
            }
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
