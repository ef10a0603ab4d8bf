//! SIGINT and SIGTERM. They are handled from the first moment of the program on, also where it is process 1 of a container,
//! which the kernel gives no default action.
//!
//! A command without anything to keep ends at once. An inspection, or a server, registers how it is stopped: it then has
//! [`DRAIN`] to write what it has, and after that the program ends whatever it does. A second signal ends it at once. The exit
//! code is 128 and the signal's number, 130 or 143, wherever work was cut off.

use semascan_inspection::StopSwitch;
use std::io;
use std::process;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use tokio::runtime::Builder;
use tokio::sync::watch;

/// Time between the first signal and the end of the program.
pub(crate) const DRAIN: Duration = Duration::from_secs(5);
/// Part of it that is kept for what is done when the rest was not enough.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The signals that this process gets. Clones are the same.
#[derive(Clone, Debug)]
pub(crate) struct Signals {
    /// Number of the signal that asked for the end; 0 while none did.
    number: Arc<AtomicU8>,
    work: Arc<Mutex<Option<Work>>>,
    asked: watch::Receiver<bool>,
}

/// What is to be ended in order.
pub(crate) struct Work {
    /// Stops it.
    pub(crate) stop: StopSwitch,
    /// Done where it does not end in time.
    pub(crate) too_late: Box<dyn FnOnce() + Send>,
}

impl std::fmt::Debug for Work {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Work").field("stop", &self.stop).finish_non_exhaustive()
    }
}

impl Signals {
    /// Handles signals from now on.
    ///
    /// # Errors
    /// The I/O error of the system.
    pub(crate) fn handle() -> io::Result<Self> {
        let (sender, asked) = watch::channel(false);
        let signals = Self { number: Arc::default(), work: Arc::default(), asked };
        let runtime = Builder::new_current_thread().enable_all().build()?;
        // Registered before this returns, so that no signal gets lost.
        let mut incoming = runtime.block_on(async { Incoming::new() })?;
        let own = signals.clone();
        thread::Builder::new().name("signals".into()).spawn(move || {
            let first = runtime.block_on(incoming.next());
            own.begin_to_end(first, sender);
            let second = runtime.block_on(incoming.next());
            exit(second);
        })?;
        Ok(signals)
    }

    /// Begins work that is not simply cut off: `begin` makes it, and no signal is looked at until it is made.
    ///
    /// # Errors
    /// Those of `begin`.
    pub(crate) fn begin<T, E>(&self, begin: impl FnOnce() -> Result<(T, Work), E>) -> Result<T, E> {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let (made, registered) = begin()?;
        *work = Some(registered);
        Ok(made)
    }

    /// The exit code of work that was cut off by a signal; `None` while there was none.
    pub(crate) fn exit_code(&self) -> Option<u8> {
        match self.number.load(Ordering::SeqCst) {
            0 => None,
            number => Some(128 + number),
        }
    }

    /// Completes when the process is asked to end.
    pub(crate) async fn asked_to_end(&self) {
        let mut asked = self.asked.clone();
        // The sender is gone only with the thread that waits for signals.
        if asked.wait_for(|asked| *asked).await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    fn begin_to_end(self, number: u8, sender: watch::Sender<bool>) {
        self.number.store(number, Ordering::SeqCst);
        let Some(work) = self.work.lock().unwrap_or_else(PoisonError::into_inner).take() else { exit(number) };
        tracing::warn!(
            "stopping: what there is by now is kept, in {} s at most; once more ends at once",
            DRAIN.as_secs()
        );
        let Work { stop, too_late } = work;
        stop.set();
        let _ = sender.send(true);
        thread::spawn(move || {
            // The channel stays open as long as the process.
            let _open = sender;
            thread::sleep(DRAIN - LAST_WORDS);
            let last_words = thread::spawn(too_late);
            let mut waited = Duration::ZERO;
            const STEP: Duration = Duration::from_millis(20);
            while !last_words.is_finished() && waited < LAST_WORDS {
                thread::sleep(STEP);
                waited += STEP;
            }
            exit(number);
        });
    }
}

fn exit(number: u8) -> ! {
    process::exit(128 + i32::from(number))
}

/// The signals that ask for the end.
#[cfg(unix)]
struct Incoming {
    interrupt: tokio::signal::unix::Signal,
    terminate: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl Incoming {
    fn new() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self { interrupt: signal(SignalKind::interrupt())?, terminate: signal(SignalKind::terminate())? })
    }

    /// The number of the next one.
    async fn next(&mut self) -> u8 {
        tokio::select! {
            _ = self.interrupt.recv() => 2,
            _ = self.terminate.recv() => 15,
        }
    }
}

#[cfg(not(unix))]
struct Incoming;

#[cfg(not(unix))]
impl Incoming {
    fn new() -> io::Result<Self> {
        Ok(Self)
    }

    async fn next(&mut self) -> u8 {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
        2
    }
}
