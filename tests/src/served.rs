//! An agent served on a free loopback port, and inspections told to it.

use crate::sources::open;
use anyhow::Result;
use semascan_inspection::pipeline;
use semascan_inspection::pipeline::{InspectionSink, PipelineConfig};
use semascan_inspection::source::Source;
use semascan_perception::fuse::SemanticMap;
use semascan_perception::register::{KinematicRegistrar, Registrar};
use semascan_perception::segment::RecordedSegmenter;
use semascan_server::{AccessRule, LiveModel, LiveSink, Server, ServerConfig};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A small simulated part: a second or so of computing.
pub const SMALL_MOTOR: &str = "virtual:starter-motor?seed=7&views=5&size=320x240&errors=none&cell=2.5";

/// A running server; it ends when this is dropped.
#[derive(Debug)]
pub struct Served {
    /// Where it listens.
    pub address: SocketAddr,
    /// What it tells its clients.
    pub live: Arc<LiveModel>,
    stop: Option<tokio::sync::oneshot::Sender<()>>,
}

impl Served {
    /// Serves an empty live model. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// If no port can be had.
    pub fn start() -> Result<Self> {
        let live = Arc::new(LiveModel::new());
        let config = ServerConfig {
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            access: AccessRule::default(),
            web_dir: None,
        };
        let server = Server::bind(&config, Arc::clone(&live))?;
        let address = server.local_address()?;
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        tokio::spawn(server.run(async move {
            let _ = stopped.await;
        }));
        Ok(Self { address, live, stop: Some(stop) })
    }

    /// Inspects `uri` on a thread of its own, told to the clients under the name `id`.
    pub fn inspect(&self, uri: &str, id: &str, pace: Duration) -> std::thread::JoinHandle<Result<SemanticMap>> {
        let (live, uri, id) = (Arc::clone(&self.live), uri.to_owned(), id.to_owned());
        std::thread::spawn(move || {
            let mut source = open(&uri)?;
            let sink = LiveSink::begin(live, source.info(), &id);
            run(source.as_mut(), &PipelineConfig { pace, ..PipelineConfig::default() }, &sink)
        })
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ = stop.send(());
        }
    }
}

/// Runs `source` through the pipeline with its own labels and the poses that kinematics give.
///
/// # Errors
/// If it cannot be run or no view could be used.
pub fn run(source: &mut dyn Source, config: &PipelineConfig, sink: &dyn InspectionSink) -> Result<SemanticMap> {
    run_with(source, &mut KinematicRegistrar, config, sink)
}

/// Runs `source` through the pipeline with its own labels and the poses of `registrar`.
///
/// # Errors
/// If it cannot be run or no view could be used.
pub fn run_with(
    source: &mut dyn Source,
    registrar: &mut dyn Registrar,
    config: &PipelineConfig,
    sink: &dyn InspectionSink,
) -> Result<SemanticMap> {
    let mut segmenter = RecordedSegmenter { required: true };
    let stop = AtomicBool::new(false);
    let inspected = pipeline::run(source, &mut segmenter, registrar, config, sink, &stop)?;
    inspected.map.ok_or_else(|| anyhow::anyhow!("no view could be used"))
}
