//! The connections: so many at once, and each says soon what it wants.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::time::sleep;

/// After it could not take a connection, as where too many files are open.
const PAUSE: Duration = Duration::from_secs(1);

/// What a client may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Connections at once; others wait. A browser opens six.
    pub most: usize,
    /// The head of a request is here within this time after the connection or the request before it; else the connection ends.
    pub head: Duration,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            most: 64,
            head: Duration::from_secs(10),
        }
    }
}

/// Serves for ever.
pub(super) async fn serve(listener: TcpListener, router: Router, bounds: Bounds) {
    let room = Arc::new(Semaphore::new(bounds.most));
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(bounds.head);
    // The room is never closed.
    while let Ok(place) = room.clone().acquire_owned().await {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        let connection = http.serve_connection(TokioIo::new(stream), service);
        tokio::spawn(async move {
            // A client that goes away is no fault.
            let _ = connection.await;
            drop(place);
        });
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, SocketAddr, TcpStream};

    use axum::routing::get;

    use super::*;

    fn served(bounds: Bounds) -> (tokio::runtime::Runtime, SocketAddr) {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let listener = runtime
            .block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))
            .unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new().route("/", get(|| async { "here" }));
        runtime.spawn(serve(listener, router, bounds));
        (runtime, address)
    }

    fn begun(address: SocketAddr) -> TcpStream {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n").unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(60)))
            .unwrap();
        stream
    }

    fn answer(mut stream: TcpStream) -> String {
        let mut text = String::new();
        // One that is broken off says nothing.
        let _ = stream.read_to_string(&mut text);
        text
    }

    /// A head that is never ended, though it goes on and on, ends the connection.
    #[test]
    fn a_slow_head_is_not_waited_for() {
        let head = Duration::from_millis(200);
        let (_runtime, address) = served(Bounds { most: 8, head });
        let slow = begun(address);
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
        let mut quick = begun(address);
        quick.write_all(b"Connection: close\r\n\r\n").unwrap();
        assert!(answer(quick).ends_with("here"));
    }

    /// Where all places are taken the next one waits until one is free.
    #[test]
    fn so_many_connections_at_once() {
        let head = Duration::from_secs(60);
        let (_runtime, address) = served(Bounds { most: 2, head });
        let taken = [begun(address), begun(address)];
        let mut waiting = begun(address);
        waiting.write_all(b"Connection: close\r\n\r\n").unwrap();
        waiting
            .set_read_timeout(Some(Duration::from_millis(300)))
            .unwrap();
        assert!(waiting.read(&mut [0]).is_err(), "it is not answered yet");
        waiting
            .set_read_timeout(Some(Duration::from_secs(60)))
            .unwrap();
        drop(taken);
        assert!(answer(waiting).ends_with("here"));
    }
}
