//! `semascan serve` and `semascan demo`: the live stream and the viewer.

use super::config::{self, CellConfig};
use super::run::{InspectionArgs, run, unique_id};
use super::{Failure, told};
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_inspection::source::Source;
use semascan_server::{AccessRule, LiveModel, LiveSink, Server, ServerConfig};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const DEFAULT_PORT: u16 = 8787;

/// What the demo shows.
const DEMO_SOURCE: &str = "virtual:starter-motor?seed=7&views=12";

/// How the agent is reached.
#[derive(Clone, Debug, Args)]
struct ReachArgs {
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
    threads: Option<usize>,
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
    inspection: InspectionArgs,
    #[command(flatten)]
    reach: ReachArgs,
}

/// Arguments of `semascan demo`.
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// What to inspect
    #[arg(long, default_value = DEMO_SOURCE)]
    source: String,
    /// Do not open the browser
    #[arg(long)]
    no_open: bool,
    /// Least time between two captures in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 1.5)]
    pace: f64,
    /// Voxel edge in millimetres
    #[arg(long, value_name = "MM")]
    voxel: Option<f64>,
    #[command(flatten)]
    reach: ReachArgs,
}

impl DemoArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let inspection = InspectionArgs {
            labels: super::run::Labels::Source,
            network: super::network::NetworkArgs::default(),
            camera_mask: "auto".into(),
            registration: super::run::Registration::Auto,
            masks: super::run::Masks::AsIs,
            association: super::run::Association::None,
            voxel: self.voxel,
            keyframes: false,
            denoise: false,
            background: super::run::BackgroundArg::Keep,
            pace: self.pace,
        };
        let source = inspection.open(&self.source)?;
        serve(&self.reach, &CellConfig::default(), !self.no_open, Some((source, inspection, None)))
    }
}

impl ServeArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        let mut inspection = self.inspection;
        inspection.configure(&config);
        let uri = self.source.or_else(|| config.source.uri.clone());
        let job = match uri {
            Some(uri) => Some((inspection.open(&uri)?, inspection, self.out)),
            None => None,
        };
        serve(&self.reach, &config, false, job)
    }
}

type Job = (Box<dyn Source>, InspectionArgs, Option<PathBuf>);

fn serve(reach: &ReachArgs, config: &CellConfig, open_browser: bool, job: Option<Job>) -> Result<(), Failure> {
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
    let settings = ServerConfig { address, access: AccessRule { allowed_hosts }, web_dir };

    let live = Arc::new(LiveModel::new());
    let stop = Arc::new(AtomicBool::new(false));
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
        let worker = job.map(|job| {
            let (live, stop) = (Arc::clone(&live), Arc::clone(&stop));
            std::thread::spawn(move || inspect(job, &live, &stop))
        });
        server.run(interrupted()).await?;
        stop.store(true, Ordering::Relaxed);
        // The view in work is finished first, so that the record on disk is whole.
        if let Some(worker) = worker
            && worker.join().is_err()
        {
            return Err(Failure::Work(anyhow!("the inspection ended unexpectedly")));
        }
        Ok(())
    })
}

/// One inspection, told to `live`; a failure is told there too and does not end the server.
fn inspect((mut source, args, out): Job, live: &Arc<LiveModel>, stop: &AtomicBool) {
    let id = unique_id();
    let sink = LiveSink::begin(Arc::clone(live), source.info(), &id);
    let done = run(source.as_mut(), &args, &id, &sink, stop).and_then(|done| {
        if let Some(folder) = &out {
            done.write(folder, source.as_ref())?;
        }
        Ok(done)
    });
    match done {
        Ok(done) => {
            let t = live.totals();
            tracing::info!(
                "{} finished: {} points; {} chunks sent in {} kB, final model {} kB",
                done.record.part,
                done.record.points,
                t.messages,
                t.bytes / 1000,
                t.snapshot_bytes / 1000
            );
        }
        Err(failure) => {
            let (_, error) = failure.into_parts();
            let error = told(&error);
            tracing::error!("inspection failed: {error}");
            sink.fail(&error);
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
