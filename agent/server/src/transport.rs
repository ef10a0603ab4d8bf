//! A TCP connection that notes when something moves, and ends when it is told to.
//!
//! It goes with the connection from the first request into the WebSocket, so that both are counted and ended alike.

use super::connections::Place;
use socket2::{SockRef, TcpKeepalive};
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

/// A quiet peer is asked after that time whether it is still there ...
const KEEPALIVE_AFTER: Duration = Duration::from_secs(20);
/// ... and again, if it does not answer ...
const KEEPALIVE_EVERY: Duration = Duration::from_secs(10);
/// ... so often.
#[cfg(not(windows))]
const KEEPALIVE_TRIES: u32 = 3;
/// What was sent must be acknowledged within that time.
#[cfg(any(target_os = "linux", target_os = "android"))]
const ACKNOWLEDGED_WITHIN: Duration = Duration::from_secs(50);

/// A connection and its place among all.
#[derive(Debug)]
pub(super) struct Transport {
    stream: TcpStream,
    place: Place,
}

impl Transport {
    /// A connection that notices within a minute that its peer has vanished.
    ///
    /// # Errors
    /// If the system does not take the settings: the peer has gone already.
    pub(super) fn new(stream: TcpStream, place: Place) -> io::Result<Self> {
        let socket = SockRef::from(&stream);
        let keepalive = TcpKeepalive::new().with_time(KEEPALIVE_AFTER).with_interval(KEEPALIVE_EVERY);
        #[cfg(not(windows))]
        let keepalive = keepalive.with_retries(KEEPALIVE_TRIES);
        socket.set_tcp_keepalive(&keepalive)?;
        #[cfg(any(target_os = "linux", target_os = "android"))]
        socket.set_tcp_user_timeout(Some(ACKNOWLEDGED_WITHIN))?;
        Ok(Self { stream, place })
    }

    /// An error if the connection has to end; else the task is woken when it has to.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        match Pin::new(&mut self.place.ended).poll(context) {
            Poll::Ready(_) => Err(io::Error::new(io::ErrorKind::ConnectionAborted, "the server ended the connection")),
            Poll::Pending => Ok(()),
        }
    }

    fn note<T>(&self, moved: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if matches!(moved, Poll::Ready(Ok(_))) {
            self.place.connection.moved();
        }
        moved
    }
}

impl AsyncRead for Transport {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.check(cx)?;
        let read = Pin::new(&mut self.stream).poll_read(cx, buffer);
        self.note(read)
    }
}

impl AsyncWrite for Transport {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.check(cx)?;
        let written = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.note(written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.check(cx)?;
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, slices);
        self.note(written)
    }

    // Vectored writes let an answer go out from where it lies: without them it would be copied for each connection.
    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
