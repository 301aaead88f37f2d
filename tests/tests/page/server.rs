//! The program's server on a thread of its own, and requests to it as bytes.

use std::fmt::{Display, Formatter};
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use clap::Parser;
use ct_signals::{Channel, Record};
use ctid::look::Look;
use ctid::{Cli, run};
use ctid_tests::http;
use serde_json::Value;

/// One test after the other where something is computed: what one looks at is the whole process.
static ALONE: Mutex<()> = Mutex::new(());

/// Held as long as a test computes.
pub fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A bundled file.
pub fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../examples/records")
        .join(name)
        .canonicalize()
        .unwrap()
}

/// A record as a file.
pub fn csv(record: &Record) -> String {
    let signals: Vec<&Channel> = record.channels().collect();
    let header = signals.iter().map(|s| format!(",{} [{}]", s.name, s.unit));
    let rows = record.time.iter().enumerate().map(|(k, t)| {
        let values = signals.iter().map(|s| format!(",{}", s.values[k]));
        format!("{t}{}\n", values.collect::<String>())
    });
    format!(
        "t [s]{}\n{}",
        header.collect::<String>(),
        rows.collect::<String>()
    )
}

/// What a command prints.
pub fn command(arguments: &[&str]) -> String {
    let cli = Cli::try_parse_from([&["ctid"], arguments].concat()).unwrap();
    let mut out = Vec::new();
    run(cli, &mut out, Look::plain()).unwrap();
    String::from_utf8(out).unwrap()
}

/// Hands on what is printed.
struct Pipe(mpsc::Sender<Vec<u8>>);

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let _ = self.0.send(bytes.to_vec());
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Where the page is.
#[derive(Debug, Clone)]
pub struct Page {
    pub address: SocketAddr,
    pub secret: String,
}

/// As it is printed.
impl Display for Page {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "http://{}/{}/", self.address, self.secret)
    }
}

/// Serves until the test ends.
pub fn serve(arguments: &[&str]) -> Page {
    // A thread is named like the one that begins it: the pool's are not to be named like one that computes.
    rayon::broadcast(|_| ());
    let words: Vec<String> = ["ctid", "serve", "--port", "0"]
        .iter()
        .chain(arguments)
        .map(|word| (*word).to_string())
        .collect();
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let cli = Cli::try_parse_from(words).unwrap();
        if let Err(error) = run(cli, &mut Pipe(sender), Look::plain()) {
            println!("{error}");
        }
    });
    let mut said = String::new();
    while !said.contains('\n') {
        said +=
            &String::from_utf8(receiver.recv_timeout(Duration::from_secs(60)).unwrap()).unwrap();
    }
    let rest = said.split("http://").nth(1).unwrap();
    let mut parts = rest.split('/');
    Page {
        address: parts.next().unwrap().parse().unwrap(),
        secret: parts.next().unwrap().to_string(),
    }
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    pub fn error(&self) -> String {
        self.json()["error"]
            .as_str()
            .unwrap_or_else(|| panic!("{self:?}"))
            .to_string()
    }
}

/// Sends bytes and reads to the end.
pub fn exchange(address: SocketAddr, bytes: &[u8]) -> Answer {
    let answer = http::exchange(address, bytes, Duration::from_secs(60)).unwrap();
    let status = answer
        .status
        .unwrap_or_else(|| panic!("no answer: {answer:?}"));
    Answer {
        status,
        head: answer.head.to_lowercase(),
        body: answer.body,
    }
}

/// A tab without a browser.
#[derive(Clone)]
pub struct Tab {
    pub page: Page,
    pub session: String,
}

impl Tab {
    /// Opens a session.
    pub fn open(page: &Page) -> Self {
        let mut tab = Self {
            page: page.clone(),
            session: String::new(),
        };
        let opened = tab.post("/api/session", br#"{"session": null}"#);
        assert_eq!(opened.status, 200, "{opened:?}");
        tab.session = opened.json()["session"].as_str().unwrap().to_string();
        tab
    }

    pub fn head(&self, method: &str, path: &str, length: usize) -> String {
        format!(
            "{method} /{}{path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n",
            self.page.secret, self.page.address
        )
    }

    fn with_session(&self, path: &str) -> String {
        let mark = if path.contains('?') { '&' } else { '?' };
        format!("{path}{mark}session={}", self.session)
    }

    pub fn get(&self, path: &str) -> Answer {
        exchange(
            self.page.address,
            (self.head("GET", &self.with_session(path), 0) + "\r\n").as_bytes(),
        )
    }

    pub fn post(&self, path: &str, body: &[u8]) -> Answer {
        let mut bytes =
            (self.head("POST", &self.with_session(path), body.len()) + "\r\n").into_bytes();
        bytes.extend_from_slice(body);
        exchange(self.page.address, &bytes)
    }

    pub fn state(&self) -> Value {
        self.get("/api/state").json()
    }

    /// The state once it satisfies something.
    pub fn until(&self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        for _ in 0..6000 {
            let state = self.state();
            if holds(&state) {
                return state;
            }
            thread::sleep(Duration::from_millis(50));
        }
        panic!("never {what}: {}", self.state());
    }
}
