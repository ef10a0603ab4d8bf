//! An agent served on a free loopback port, and inspections published to it.

use crate::sources::open;
use anyhow::{Context, Result};
use semascan_inspection::spec::InspectionSpec;
use semascan_inspection::{Inspected, Inspection};
use semascan_model::InspectionId;
use semascan_server::{AccessRule, Entry, Limits, LiveModel, LiveStream, Server, ServerConfig, WebFiles};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::thread::JoinHandle;

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
    server: Option<tokio::task::JoinHandle<()>>,
}

impl Served {
    /// Serves an empty live model. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// If no port can be had.
    pub fn start() -> Result<Self> {
        Self::start_with(WebFiles::Embedded(|_| None), Limits::default())
    }

    /// Serves an empty live model and `files` within `limits`. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// If no port can be had, or a setting cannot be kept.
    pub fn start_with(files: WebFiles, limits: Limits) -> Result<Self> {
        Self::start_as(ServerConfig {
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            access: AccessRule::default(),
            entry: Entry::default(),
            tls: None,
            files,
            limits,
            metrics: None,
        })
    }

    /// Serves an empty live model as `config` says. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// If no port can be had, or a setting cannot be kept.
    pub fn start_as(config: ServerConfig) -> Result<Self> {
        let live = Arc::new(LiveModel::new());
        let server = Server::bind(&config, Arc::clone(&live))?;
        let address = server.local_address()?;
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        let server = tokio::spawn(server.run(async move {
            let _ = stopped.await;
        }));
        Ok(Self { address, live, stop: Some(stop), server: Some(server) })
    }

    /// Ends the server in order.
    ///
    /// # Errors
    /// If it panicked.
    pub async fn end(mut self) -> Result<()> {
        drop(self.stop.take());
        self.server.take().context("it was ended before")?.await?;
        Ok(())
    }

    /// Inspects `uri` with its own labels on threads of its own, published to the clients.
    ///
    /// # Errors
    /// If it cannot begin.
    pub fn inspect(&self, uri: &str) -> Result<Running> {
        self.inspect_with(InspectionSpec::default(), uri)
    }

    /// Inspects `uri` as `spec` says on threads of its own, published to the clients.
    ///
    /// # Errors
    /// If it cannot begin.
    pub fn inspect_with(&self, spec: InspectionSpec, uri: &str) -> Result<Running> {
        let inspection = Inspection::new(spec, open(uri)?)?;
        let (id, events, live) = (inspection.id(), inspection.subscribe(), Arc::clone(&self.live));
        let handle = inspection.start();
        let worker = std::thread::spawn(move || {
            LiveStream::new(&live).follow(events);
            Ok(handle.wait()?)
        });
        Ok(Running { id, worker })
    }
}

/// An inspection that is published.
#[derive(Debug)]
pub struct Running {
    /// Its identifier.
    pub id: InspectionId,
    worker: JoinHandle<Result<Inspected>>,
}

impl Running {
    /// Waits until it is over and published.
    ///
    /// # Errors
    /// If it has no model.
    pub fn wait(self) -> Result<Inspected> {
        self.worker.join().map_err(|_| anyhow::anyhow!("the inspection panicked"))?
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ = stop.send(());
        }
    }
}
