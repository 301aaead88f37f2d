//! The connections: so many at once, and none that stands still keeps another out.
//!
//! On a new connection nobody has shown yet that he knows the secret. Such connections have places of their own, so that other users
//! of the machine, who can connect too, take none of the owner's; they end with their first answer, a refusal. Where all places are
//! taken the next connection is let in and the one that has stood still for the longest time is closed: of those that do not know the
//! secret the oldest, whatever it sends.

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

/// After it could not take a connection, as where too many files are open.
const PAUSE: Duration = Duration::from_millis(100);
/// Bytes of a request that are held before they are looked at; the head is smaller.
const BUFFER: usize = 64 << 10;

/// What a client may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Connections at once on which the secret was known. A browser opens six.
    pub known: usize,
    /// Connections at once on which it was not known yet.
    pub unknown: usize,
    /// The head of a request is here within this time after the connection or the request before it; else the connection ends.
    pub head: Duration,
    /// Some of an answer is taken within this time; else the connection ends.
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

/// What is known of a connection.
#[derive(Debug)]
struct Client {
    knows: AtomicBool,
    /// When something was read or written last; where the secret is not known, when it began.
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

/// Those that are open.
#[derive(Debug, Default)]
struct Clients(Mutex<Vec<(Arc<Client>, AbortHandle)>>);

impl Clients {
    /// Closes those that have stood still for the longest time, until there are at most so many that know the secret, or do not.
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

/// What all connections share.
struct Door {
    guard: Guard,
    router: TowerToHyperService<Router>,
    clients: Clients,
    bounds: Bounds,
}

/// Serves for ever.
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
        // The lock is held until it is among them: it may be over at once.
        let mut all = lock(&door.clients.0);
        let task = tokio::spawn(async move {
            // A client that goes away is no fault.
            let _ = connection.await;
            at.clients.leave(&of);
        });
        all.push((client, task.abort_handle()));
    }
}

/// Answers where the guard admits it.
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

/// A stream that tells of its movement and fails where nothing of an answer is taken for long.
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
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, SocketAddr, TcpStream};

    use axum::routing::get;

    use super::*;

    const MINUTE: Duration = Duration::from_secs(60);
    const PATIENT: Bounds = Bounds {
        known: 2,
        unknown: 3,
        head: MINUTE,
        silence: MINUTE,
    };

    /// A server, kept as long as its runtime, and the heads of its requests.
    struct Served {
        _runtime: tokio::runtime::Runtime,
        address: SocketAddr,
        secret: String,
    }

    fn served(bounds: Bounds) -> Served {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let listener = runtime
            .block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))
            .unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new()
            .route("/", get(|| async { "here" }))
            .route("/large", get(|| async { "1".repeat(1 << 20) }));
        let guard = Guard::new(address.port());
        let secret = guard.secret().to_string();
        runtime.spawn(serve(listener, guard, router, bounds));
        Served {
            _runtime: runtime,
            address,
            secret,
        }
    }

    impl Served {
        fn connect(&self) -> TcpStream {
            let stream = TcpStream::connect(self.address).unwrap();
            stream.set_read_timeout(Some(MINUTE)).unwrap();
            stream.set_write_timeout(Some(MINUTE)).unwrap();
            stream
        }

        fn head(&self, path: &str) -> String {
            format!("GET {path} HTTP/1.1\r\nHost: {}\r\n", self.address)
        }

        fn own(&self, path: &str) -> String {
            self.head(&format!("/{}{path}", self.secret))
        }

        fn begun(&self) -> TcpStream {
            let mut stream = self.connect();
            stream.write_all(self.own("/").as_bytes()).unwrap();
            stream
        }

        /// A request that is asked for as the page asks.
        fn answers(&self) -> bool {
            let mut stream = self.begun();
            stream.write_all(b"Connection: close\r\n\r\n").unwrap();
            answer(stream).ends_with("here")
        }
    }

    fn answer(mut stream: TcpStream) -> String {
        let mut text = String::new();
        // One that is broken off says nothing.
        let _ = stream.read_to_string(&mut text);
        text
    }

    /// One answer of a connection that stays open.
    fn one(stream: &mut TcpStream) -> String {
        let mut text = String::new();
        let mut byte = [0];
        while !text.ends_with("here") && matches!(stream.read(&mut byte), Ok(1)) {
            text.push(char::from(byte[0]));
        }
        text
    }

    /// A head that is never ended, though it goes on and on, ends the connection.
    #[test]
    fn a_slow_head_is_not_waited_for() {
        let head = Duration::from_millis(200);
        let served = served(Bounds { head, ..PATIENT });
        let slow = served.begun();
        let mut dripping = slow.try_clone().unwrap();
        let dripped = std::thread::spawn(move || {
            (0..1000)
                .take_while(|_| {
                    std::thread::sleep(Duration::from_millis(20));
                    dripping.write_all(b"a: b\r\n").is_ok()
                })
                .count()
        });
        assert!(!answer(slow).contains("here"));
        assert!(dripped.join().unwrap() < 1000);
        assert!(served.answers());
    }

    /// Nor do those who are silent take the places of who is here already.
    #[test]
    fn who_does_not_know_the_secret_keeps_nobody_out() {
        let served = served(PATIENT);
        let mut here = served.connect();
        here.write_all(format!("{}\r\n", served.own("/")).as_bytes())
            .unwrap();
        assert!(one(&mut here).ends_with("here"));
        let silent: Vec<TcpStream> = (0..20).map(|_| served.connect()).collect();
        assert!(served.answers());
        here.write_all(format!("{}\r\n", served.own("/")).as_bytes())
            .unwrap();
        assert!(one(&mut here).ends_with("here"), "it is still open");
        drop(silent);
    }

    /// What it asks for next is not answered.
    #[test]
    fn a_connection_without_the_secret_ends_with_its_refusal() {
        let served = served(PATIENT);
        let mut stream = served.connect();
        let two = format!("{}\r\n{}\r\n", served.head("/"), served.own("/"));
        stream.write_all(two.as_bytes()).unwrap();
        let text = answer(stream);
        assert!(text.starts_with("HTTP/1.1 403"), "{text}");
        assert!(!text.contains("here"), "{text}");
    }

    /// Asks for far more than the sockets hold.
    fn greedy(served: &Served) -> TcpStream {
        let mut stream = served.connect();
        let many = format!("{}\r\n", served.own("/large")).repeat(64);
        stream.write_all(many.as_bytes()).unwrap();
        // The first of it is here: it knows the secret.
        stream.read_exact(&mut [0]).unwrap();
        stream
    }

    #[test]
    fn answers_that_are_never_taken_keep_nobody_out() {
        let served = served(PATIENT);
        let greedy: Vec<TcpStream> = (0..6).map(|_| greedy(&served)).collect();
        assert!(served.answers());
        drop(greedy);
    }

    #[test]
    fn an_answer_that_is_never_taken_ends_its_connection() {
        let silence = Duration::from_millis(200);
        let served = served(Bounds { silence, ..PATIENT });
        let mut stream = greedy(&served);
        // Written to until the other end is gone.
        let head = format!("{}\r\n", served.own("/large"));
        while stream.write_all(head.as_bytes()).is_ok() {
            std::thread::sleep(Duration::from_millis(20));
        }
        let text = answer(stream);
        assert!(text.len() < 64 << 20, "not all of it was sent");
    }
}
