//! Slow clients, clients with large requests, and clients without the access key.

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

    /// Sends a request like the page.
    fn answers(&self) -> bool {
        let mut stream = self.begun();
        stream.write_all(b"Connection: close\r\n\r\n").unwrap();
        answer(stream).ends_with("here")
    }
}

fn answer(mut stream: TcpStream) -> String {
    let mut text = String::new();
    // A broken connection gives no answer.
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

/// The next request is not answered.
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

/// Requests far more than the socket buffers hold.
fn greedy(served: &Served) -> TcpStream {
    let mut stream = served.connect();
    let many = format!("{}\r\n", served.own("/large")).repeat(64);
    stream.write_all(many.as_bytes()).unwrap();
    // The first byte has arrived: the access key is known.
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
    // Written to until the other end is closed.
    let head = format!("{}\r\n", served.own("/large"));
    while stream.write_all(head.as_bytes()).is_ok() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let text = answer(stream);
    assert!(text.len() < 64 << 20, "not all of it was sent");
}
