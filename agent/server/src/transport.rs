//! A connection, TCP as it is or with TLS on it, that notes when something moves, and ends when it is told to.
//!
//! It goes with the connection from the first request into the WebSocket, so that both are counted and ended alike. The HTTP
//! library answers what it cannot read with a bare status: that answer is kept back, and the connection handed to who can say
//! more ([`Remains`]).

use super::connections::Place;
use super::plain_answer::bare_status;
use super::wire::Wire;
use axum::http::StatusCode;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// A connection and its place among all.
#[derive(Debug)]
pub(super) struct Transport {
    /// There until this is dropped.
    open: Option<Open>,
    remains: Remains,
}

/// A connection that is open.
#[derive(Debug)]
pub(super) struct Open {
    pub(super) wire: Wire,
    pub(super) place: Place,
}

/// What is left of a [`Transport`] that was dropped. Clones are the same.
#[derive(Clone, Debug, Default)]
pub(super) struct Remains(Arc<Mutex<Left>>);

#[derive(Debug, Default)]
struct Left {
    open: Option<Open>,
    kept_back: Option<StatusCode>,
}

impl Remains {
    /// The connection, where it is still there, and the status that was kept back.
    pub(super) fn take(&self) -> (Option<Open>, Option<StatusCode>) {
        let mut left = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (left.open.take(), left.kept_back.take())
    }

    fn change(&self, change: impl FnOnce(&mut Left)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Drop for Transport {
    fn drop(&mut self) {
        let open = self.open.take();
        self.remains.change(|left| left.open = open);
    }
}

impl Transport {
    /// A connection, and what will be left of it.
    pub(super) fn new(wire: Wire, place: Place) -> (Self, Remains) {
        let remains = Remains::default();
        (Self { open: Some(Open { wire, place }), remains: remains.clone() }, remains)
    }

    /// The connection, or an error if it has to end; else the task is woken when it has to.
    fn open(&mut self, context: &mut Context<'_>) -> io::Result<&mut Open> {
        let ended = || io::Error::new(io::ErrorKind::ConnectionAborted, "the server ended the connection");
        let open = self.open.as_mut().ok_or_else(ended)?;
        match open.place.poll_ended(context) {
            Poll::Ready(()) => Err(ended()),
            Poll::Pending => Ok(open),
        }
    }

    /// An error if `bytes` are a bare answer of the HTTP library, which is not written.
    fn keep_bare_answers_back(&self, bytes: &[u8]) -> io::Result<()> {
        match bare_status(bytes) {
            None => Ok(()),
            Some(status) => {
                self.remains.change(|left| left.kept_back = Some(status));
                Err(io::Error::other("the request cannot be read"))
            }
        }
    }
}

impl Open {
    fn note<T>(&self, moved: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if matches!(moved, Poll::Ready(Ok(_))) {
            self.place.connection.moved();
        }
        moved
    }

    fn note_sent(&self, written: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        if let Poll::Ready(Ok(bytes)) = written {
            self.place.sent(bytes);
        }
        self.note(written)
    }
}

impl AsyncRead for Transport {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let open = self.open(cx)?;
        let before = buffer.filled().len();
        let read = Pin::new(&mut open.wire).poll_read(cx, buffer);
        let came = buffer.filled().len() - before;
        if came > 0 {
            open.place.connection.heard();
            open.place.received(came);
        }
        open.note(read)
    }
}

impl AsyncWrite for Transport {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.keep_bare_answers_back(bytes)?;
        let open = self.open(cx)?;
        let written = Pin::new(&mut open.wire).poll_write(cx, bytes);
        open.note_sent(written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        if let [bytes] = slices {
            self.keep_bare_answers_back(bytes)?;
        }
        let open = self.open(cx)?;
        let written = Pin::new(&mut open.wire).poll_write_vectored(cx, slices);
        open.note_sent(written)
    }

    // Vectored writes let an answer go out from where it lies: without them it would be copied for each connection.
    fn is_write_vectored(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.wire.is_write_vectored())
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let open = self.open(cx)?;
        Pin::new(&mut open.wire).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let open = self.open(cx)?;
        Pin::new(&mut open.wire).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connections::Connections;
    use crate::limits::Limits;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::{TcpListener, TcpStream};

    #[tokio::test]
    async fn an_ended_connection_refuses_everything_as_often_as_it_is_asked() {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let mut peer = TcpStream::connect(listener.local_addr().expect("bound")).await.expect("connects");
        let (stream, address) = listener.accept().await.expect("accepts");
        let all = Arc::new(Connections::new(&Limits::default(), usize::MAX));
        let (mut transport, remains) = Transport::new(stream.into(), all.admit(address.ip()).expect("a place"));
        peer.write_all(b"x").await.expect("sends");
        assert_eq!(transport.read_u8().await.expect("open"), b'x');
        all.end_all();
        for _ in 0..2 {
            assert!(transport.read_u8().await.is_err());
            assert!(transport.write_all(b"y").await.is_err());
            assert!(transport.flush().await.is_err());
            assert!(transport.shutdown().await.is_err());
        }
        drop(transport);
        let (open, kept_back) = remains.take();
        assert!(open.is_some() && kept_back.is_none());
    }

    #[tokio::test]
    async fn a_bare_answer_is_kept_back_and_nothing_of_it_is_written() {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let mut peer = TcpStream::connect(listener.local_addr().expect("bound")).await.expect("connects");
        let (stream, address) = listener.accept().await.expect("accepts");
        let all = Arc::new(Connections::new(&Limits::default(), usize::MAX));
        let (mut transport, remains) = Transport::new(stream.into(), all.admit(address.ip()).expect("a place"));
        assert!(transport.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n").await.is_err());
        drop(transport);
        let (open, kept_back) = remains.take();
        assert_eq!(kept_back, Some(StatusCode::BAD_REQUEST));
        drop(open);
        let mut written = Vec::new();
        peer.read_to_end(&mut written).await.expect("ends");
        assert_eq!(written, b"");
    }
}
