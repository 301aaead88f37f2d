//! Connections: their number is limited, and an idle connection does not block others.
//!
//! A new connection has not sent the access key yet. Such connections have a separate limit, so that other users of the machine cannot use
//! up the owner's connections; without the key they end with their first answer, an error. If the limit is reached, a new connection is
//! accepted and the one that was idle for the longest time is closed; among connections without the key, the oldest one.

use std::convert::Infallible;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use axum::Router;
use axum::http::{HeaderValue, Request, header};
use axum::response::{IntoResponse, Response};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::{Sleep, sleep};

use super::guard::{Guard, restrict};
use super::session::lock;

/// Pause after a failed accept, for example with too many open files.
const PAUSE: Duration = Duration::from_millis(100);
/// Bytes of a request that are buffered before they are parsed; the head is smaller.
const BUFFER: usize = 64 << 10;

/// Limits of a client.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Limit of simultaneous connections with the access key. A browser opens six.
    pub known: usize,
    /// Limit of simultaneous connections without the access key.
    pub unknown: usize,
    /// Time limit for the head of a request after the connection or the preceding request; else the connection ends.
    pub head: Duration,
    /// Time limit for the transfer of a part of an answer; else the connection ends.
    pub silence: Duration,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            known: 64,
            unknown: 128,
            head: Duration::from_secs(10),
            silence: Duration::from_secs(10),
        }
    }
}

/// State of a connection.
#[derive(Debug)]
struct Client {
    knows: AtomicBool,
    /// Time of the last read or write; before the access key is checked, time of the start.
    moved: Mutex<Instant>,
}

impl Client {
    fn knows(&self) -> bool {
        self.knows.load(Ordering::Relaxed)
    }

    fn moves(&self) {
        if self.knows() {
            *lock(&self.moved) = Instant::now();
        }
    }
}

/// Open connections.
#[derive(Debug, Default)]
struct Clients(Mutex<Vec<(Arc<Client>, AbortHandle)>>);

impl Clients {
    /// Closes the connections that were idle for the longest time, until at most `most` of this kind (with or without the access key) are
    /// left.
    fn keep(&self, knowing: bool, most: usize) {
        let mut all = lock(&self.0);
        loop {
            let those = (0..all.len()).filter(|&at| all[at].0.knows() == knowing);
            if those.clone().count() <= most {
                return;
            }
            let stillest = those.min_by_key(|&at| *lock(&all[at].0.moved));
            let Some(at) = stillest else { return };
            all.swap_remove(at).1.abort();
        }
    }

    fn leave(&self, client: &Arc<Client>) {
        lock(&self.0).retain(|(other, _)| !Arc::ptr_eq(other, client));
    }
}

/// Data that all connections share.
struct Door {
    guard: Guard,
    router: TowerToHyperService<Router>,
    clients: Clients,
    bounds: Bounds,
}

/// Runs the server without end.
pub(super) async fn serve(listener: TcpListener, guard: Guard, router: Router, bounds: Bounds) {
    let door = Arc::new(Door {
        guard,
        router: TowerToHyperService::new(router),
        clients: Clients::default(),
        bounds,
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(bounds.head)
        .max_buf_size(BUFFER);
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            door.clients.keep(false, 0);
            sleep(PAUSE).await;
            continue;
        };
        door.clients.keep(false, bounds.unknown.saturating_sub(1));
        let client = Arc::new(Client {
            knows: AtomicBool::new(false),
            moved: Mutex::new(Instant::now()),
        });
        let watched = Watched {
            stream,
            client: client.clone(),
            silence: bounds.silence,
            untaken: None,
        };
        let (at, of) = (door.clone(), client.clone());
        let service = service_fn(move |request| answer(at.clone(), of.clone(), request));
        let connection = http.serve_connection(TokioIo::new(watched), service);
        let (at, of) = (door.clone(), client.clone());
        // The lock is held until the connection is in the list, because it may end at once.
        let mut all = lock(&door.clients.0);
        let task = tokio::spawn(async move {
            // A client that disconnects is no error.
            let _ = connection.await;
            at.clients.leave(&of);
        });
        all.push((client, task.abort_handle()));
    }
}

/// Answers requests that the guard admits.
async fn answer(
    door: Arc<Door>,
    client: Arc<Client>,
    mut request: Request<Incoming>,
) -> Result<Response, Infallible> {
    let mut response = match door.guard.admit(&mut request) {
        Ok(()) => {
            if !client.knows.swap(true, Ordering::Relaxed) {
                client.moves();
                door.clients.keep(true, door.bounds.known);
            }
            door.router.call(request).await?
        }
        Err(refusal) => {
            let mut response = refusal.into_response();
            let close = HeaderValue::from_static("close");
            response.headers_mut().insert(header::CONNECTION, close);
            response
        }
    };
    restrict(&mut response);
    Ok(response)
}

/// A stream that records the time of transfers, and fails if the client reads no part of an answer for long.
struct Watched {
    stream: TcpStream,
    client: Arc<Client>,
    silence: Duration,
    untaken: Option<Pin<Box<Sleep>>>,
}

impl Watched {
    fn written(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.untaken = None;
            self.client.moves();
            return written;
        }
        let silence = self.silence;
        let end = self.untaken.get_or_insert_with(|| Box::pin(sleep(silence)));
        ready!(end.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for Watched {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        if buffer.filled().len() > before {
            self.client.moves();
        }
        read
    }
}

impl AsyncWrite for Watched {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.written(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, parts);
        self.written(context, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests;
