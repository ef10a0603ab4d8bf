//! Who is connected, and who has to go when there are too many.
//!
//! A connection is only worth its place while something moves. Where all places are taken, the connection that is no viewer
//! and has moved nothing for the longest time is ended for the new one: so idle or mute connections, however many, keep
//! nobody out for long, and a viewer that was let in is never ended for another.

use super::limits::{Limits, seconds};
use std::collections::HashMap;
use std::future::Future;
use std::net::{IpAddr, Ipv6Addr};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::sync::{oneshot, watch};

/// A connection that moved something so recently is not ended for another.
const GRACE: Duration = Duration::from_millis(500);
/// A whole answer may take so many times the time for a piece of it.
const WHOLE_ANSWER: u32 = 15;
/// How often it is looked whether all connections have ended.
const LOOK: Duration = Duration::from_millis(10);

/// What a connection is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Doing {
    /// Nothing was asked for yet.
    Waiting,
    /// Something was asked for, and may still be sent.
    Answering,
    /// The stream is open, its Hello has not come.
    Greeting,
    /// It follows the stream.
    Viewing,
}

impl Doing {
    /// Everything that a connection may be doing.
    pub(super) const ALL: [Self; 4] = [Self::Waiting, Self::Answering, Self::Greeting, Self::Viewing];

    /// Lower-case name.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Answering => "answering",
            Self::Greeting => "greeting",
            Self::Viewing => "viewing",
        }
    }
}

/// One connection, as the others see it.
#[derive(Debug)]
pub(super) struct Connection {
    address: IpAddr,
    began: Instant,
    doing: AtomicU8,
    /// Milliseconds after `began` at which a byte moved last.
    moved: AtomicU64,
    /// Milliseconds after `began` at which the last request came.
    asked: AtomicU64,
    /// Something came that is no whole request yet.
    begun: AtomicBool,
    end: Mutex<Option<oneshot::Sender<()>>>,
}

impl Connection {
    fn since_began(&self) -> u64 {
        self.began.elapsed().as_millis() as u64
    }

    /// Where it comes from: of IPv6 the network that counts as one address.
    pub(super) fn address(&self) -> IpAddr {
        self.address
    }

    /// A byte moved.
    pub(super) fn moved(&self) {
        self.moved.store(self.since_began(), Ordering::Relaxed);
    }

    /// Something came.
    pub(super) fn heard(&self) {
        self.begun.store(true, Ordering::Relaxed);
    }

    /// Whether a request began that is not whole.
    pub(super) fn has_begun_to_ask(&self) -> bool {
        self.begun.load(Ordering::Relaxed)
    }

    /// A whole request came.
    pub(super) fn asked(&self) {
        self.begun.store(false, Ordering::Relaxed);
        self.asked.store(self.since_began(), Ordering::Relaxed);
        self.set(Doing::Answering);
    }

    /// The client follows the stream from now on.
    pub(super) fn views(&self) {
        self.set(Doing::Viewing);
    }

    fn set(&self, doing: Doing) {
        self.doing.store(doing as u8, Ordering::Relaxed);
    }

    fn is(&self, doing: Doing) -> bool {
        self.doing.load(Ordering::Relaxed) == doing as u8
    }

    fn still_for(&self) -> Duration {
        Duration::from_millis(self.since_began().saturating_sub(self.moved.load(Ordering::Relaxed)))
    }

    fn asked_for(&self) -> Duration {
        Duration::from_millis(self.since_began().saturating_sub(self.asked.load(Ordering::Relaxed)))
    }

    fn end(&self) {
        let sender = self.end.lock().unwrap_or_else(PoisonError::into_inner).take();
        // Nobody listens where the connection ended by itself.
        let _ = sender.map(|end| end.send(()));
    }
}

/// A place among the connections; it is free again when this is dropped.
#[derive(Debug)]
pub(super) struct Place {
    pub(super) connection: Arc<Connection>,
    /// Completes once, when the connection has to end.
    ended: oneshot::Receiver<()>,
    number: u64,
    connections: Arc<Connections>,
}

impl Place {
    /// `bytes` came.
    pub(super) fn received(&self, bytes: usize) {
        self.connections.traffic.received.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// `bytes` were sent.
    pub(super) fn sent(&self, bytes: usize) {
        self.connections.traffic.sent.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Ready from when on the connection has to end; may be polled again then.
    pub(super) fn poll_ended(&mut self, context: &mut Context<'_>) -> Poll<()> {
        if self.ended.is_terminated() {
            return Poll::Ready(());
        }
        Pin::new(&mut self.ended).poll(context).map(drop)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.connections.lock().by_number.remove(&self.number);
    }
}

/// All connections.
#[derive(Debug)]
pub(super) struct Connections {
    most: usize,
    most_of_address: usize,
    most_greeting: usize,
    answer: Duration,
    ending: watch::Sender<bool>,
    traffic: Traffic,
    state: Mutex<State>,
}

/// Bytes of all connections, ended ones included. Under TLS those of what is said, not of how it is encrypted.
#[derive(Debug, Default)]
pub(super) struct Traffic {
    pub(super) received: AtomicU64,
    pub(super) sent: AtomicU64,
}

#[derive(Debug, Default)]
struct State {
    next: u64,
    by_number: HashMap<u64, Arc<Connection>>,
}

impl Connections {
    /// None yet; at most `most` are let in, whatever `limits` say.
    pub(super) fn new(limits: &Limits, most: usize) -> Self {
        Self {
            most: limits.connections.min(most),
            most_of_address: limits.connections_per_address,
            most_greeting: limits.hellos,
            answer: seconds(limits.answer_s),
            ending: watch::Sender::new(false),
            traffic: Traffic::default(),
            state: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code below panics between two related writes.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes that moved.
    pub(super) fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    /// A place for a connection from `address`; why there is none.
    pub(super) fn admit(self: &Arc<Self>, address: IpAddr) -> Result<Place, &'static str> {
        let address = network(address);
        let mut state = self.lock();
        let of_address = state.by_number.values().filter(|c| c.address == address).count();
        if of_address >= self.most_of_address && !state.end_stillest(|c| c.address == address) {
            return Err("too many connections from this address");
        }
        if state.by_number.len() >= self.most && !state.end_stillest(|_| true) {
            return Err("too many connections");
        }
        let (end, ended) = oneshot::channel();
        let connection = Arc::new(Connection {
            address,
            began: Instant::now(),
            doing: AtomicU8::new(Doing::Waiting as u8),
            moved: AtomicU64::new(0),
            asked: AtomicU64::new(0),
            begun: AtomicBool::new(false),
            end: Mutex::new(Some(end)),
        });
        let number = state.next;
        state.next += 1;
        state.by_number.insert(number, Arc::clone(&connection));
        Ok(Place { connection, ended, number, connections: Arc::clone(self) })
    }

    /// Lets `connection` say Hello; whether it may.
    pub(super) fn greet(&self, connection: &Connection) -> bool {
        let mut state = self.lock();
        let greeting = state.by_number.values().filter(|c| c.is(Doing::Greeting)).count();
        let may = greeting < self.most_greeting || state.end_stillest(|c| c.is(Doing::Greeting));
        if may {
            connection.set(Doing::Greeting);
        }
        may
    }

    /// Ends every connection whose answer is not taken in time; how many.
    pub(super) fn sweep(&self) -> usize {
        let mut state = self.lock();
        let before = state.by_number.len();
        state.by_number.retain(|_, c| {
            let late = c.still_for() > self.answer || c.asked_for() > self.answer * WHOLE_ANSWER;
            let ends = c.is(Doing::Answering) && late;
            if ends {
                c.end();
            }
            !ends
        });
        before - state.by_number.len()
    }

    /// Ends the connection that is most easily missed, where the system has no more of them to give.
    pub(super) fn end_one(&self) {
        self.lock().end_stillest(|_| true);
    }

    /// Completes when the server ends, and every connection has to be ended in order.
    pub(super) async fn ending(&self) {
        // The sender is `self`'s: it does not go before that.
        let _ = self.ending.subscribe().wait_for(|ending| *ending).await;
    }

    /// Asks all to end in order, and waits until they have.
    pub(super) async fn end_in_order(&self) {
        self.ending.send_replace(true);
        while !self.lock().by_number.is_empty() {
            tokio::time::sleep(LOOK).await;
        }
    }

    /// Ends all at once.
    pub(super) fn end_all(&self) {
        self.lock().by_number.drain().for_each(|(_, connection)| connection.end());
    }

    /// How many follow the stream.
    pub(super) fn viewers(&self) -> usize {
        self.count(Doing::Viewing)
    }

    /// How many do that.
    pub(super) fn count(&self, doing: Doing) -> usize {
        self.lock().by_number.values().filter(|c| c.is(doing)).count()
    }

    /// Whether the server ends.
    pub(super) fn is_ending(&self) -> bool {
        *self.ending.borrow()
    }
}

impl State {
    /// Ends the connection among `candidates` that is no viewer and has moved nothing for the longest time; whether there is
    /// one.
    fn end_stillest(&mut self, candidates: impl Fn(&Connection) -> bool) -> bool {
        let idle = self.by_number.iter().filter(|(_, c)| !c.is(Doing::Viewing) && candidates(c));
        let stillest = idle.map(|(number, c)| (c.still_for(), *number)).max().filter(|(still, _)| *still >= GRACE);
        let Some(connection) = stillest.and_then(|(_, number)| self.by_number.remove(&number)) else { return false };
        connection.end();
        true
    }
}

/// The network that counts as one address: of IPv6 the first 64 bits, which one subscriber has.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) if address.is_loopback() => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & !u128::from(u64::MAX)).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn connections(most: usize, most_of_address: usize, hellos: usize) -> Arc<Connections> {
        let limits = Limits {
            connections: most,
            connections_per_address: most_of_address,
            hellos,
            answer_s: 0.01,
            ..Limits::default()
        };
        Arc::new(Connections::new(&limits, usize::MAX))
    }

    fn address(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    #[test]
    fn a_full_address_keeps_others_free_and_gives_the_stillest_place_away() {
        let all = connections(3, 2, 8);
        let (one, two) = (address("10.0.0.1"), address("10.0.0.2"));
        let mut first = all.admit(one).expect("a place");
        let second = all.admit(one).expect("a place");
        assert!(all.admit(one).is_err(), "both are too young to be ended");
        let other = all.admit(two).expect("another address is free");
        assert!(all.admit(two).is_err(), "all places are taken");
        std::thread::sleep(GRACE);
        second.connection.moved();
        other.connection.views();
        let third = all.admit(one).expect("the first one's place");
        assert!(first.ended.try_recv().is_ok(), "it was ended");
        assert!(all.admit(two).is_err(), "a viewer is not ended, and the others just moved something");
        drop(third);
        assert!(all.admit(two).is_ok(), "a place that was left is free");
    }

    #[test]
    fn hellos_are_bounded_and_answers_must_be_taken() {
        let all = connections(8, 8, 1);
        let (one, mut two) = (all.admit(address("::1")).expect("1"), all.admit(address("::1")).expect("2"));
        assert!(all.greet(&one.connection));
        assert!(!all.greet(&two.connection));
        one.connection.views();
        assert!(all.greet(&two.connection));
        assert_eq!((all.viewers(), all.sweep()), (1, 0));
        two.connection.asked();
        std::thread::sleep(Duration::from_millis(30));
        assert_eq!(all.sweep(), 1);
        assert!(two.ended.try_recv().is_ok());
        all.end_all();
        assert_eq!(all.viewers(), 0);
    }

    #[test]
    fn one_subscriber_of_ipv6_is_one_address() {
        assert_eq!(network(address("2001:db8::1")), network(address("2001:db8::ffff:1")));
        assert_ne!(network(address("2001:db8::1")), network(address("2001:db8:0:1::1")));
        assert_eq!(network(address("::ffff:10.0.0.1")), address("10.0.0.1"));
    }
}
