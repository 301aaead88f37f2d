//! A server that is asked.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::thread;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::super::{Ended, models};
use super::answered;
use crate::fuzz::process::{Folder, check_limits, drained, result, waited};
use crate::fuzz::source::Source;
use crate::http;
use crate::http::Answer;

/// Time limit for the answer to another request, whatever was sent before.
pub(super) const AT_ONCE: Duration = Duration::from_secs(2);

/// A request that is not answered by then is not answered.
pub(super) const PATIENCE: Duration = Duration::from_secs(10);

/// A computation ends within this.
const COMPUTED: Duration = Duration::from_secs(30);

/// A page that runs.
pub(super) struct Running {
    child: Child,
    /// Folder of its model file.
    _folder: Folder,
    address: String,
    secret: String,
    pub(super) session: String,
    err: Option<JoinHandle<String>>,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

impl Running {
    pub(super) fn begin() -> Result<Self, String> {
        let folder = Folder::new();
        folder.write("model.toml", "plant = \"single-tank\"\n");
        let mut command = folder.command(["serve", "--port", "0", "--model", "model.toml"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| error.to_string())?;
        let mut line = String::new();
        if let Some(out) = child.stdout.take() {
            BufReader::new(out)
                .read_line(&mut line)
                .map_err(|error| error.to_string())?;
        }
        let mut parts = line.split("http://").nth(1).unwrap_or_default().split('/');
        let (address, secret) = (
            parts.next().unwrap_or_default(),
            parts.next().unwrap_or_default(),
        );
        let mut running = Self {
            err: child.stderr.take().map(drained),
            child,
            _folder: folder,
            address: address.to_string(),
            secret: secret.to_string(),
            session: String::new(),
        };
        running.open()?;
        let path = format!("/api/record?session={}&name=data.csv", running.session);
        let record = models::record(&mut Source::new(0));
        let answer =
            running.exchange(&running.request("POST", &path, record.as_bytes()), PATIENCE)?;
        if answer.status != Some(200) {
            return Err(format!("a good record is not taken: {answer:?}"));
        }
        Ok(running)
    }

    /// Opens a new tab.
    fn open(&mut self) -> Result<(), String> {
        let answer = self.exchange(
            &self.request("POST", "/api/session", b"{\"session\": null}"),
            PATIENCE,
        )?;
        let json: Value =
            serde_json::from_str(&answer.body).map_err(|error| format!("{error}: {answer:?}"))?;
        self.session = json["session"].as_str().unwrap_or_default().to_string();
        Ok(())
    }

    pub(super) fn request(&self, method: &str, path: &str, body: &[u8]) -> Vec<u8> {
        let head = format!(
            "{method} /{}{path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n",
            self.secret,
            self.address,
            body.len()
        );
        [head.as_bytes(), body].concat()
    }

    pub(super) fn exchange(&self, bytes: &[u8], patience: Duration) -> Result<Answer, String> {
        http::exchange(self.address.as_str(), bytes, patience)
            .map_err(|error| format!("no connection: {error}"))
    }

    /// Another request is answered, and soon; on a machine that is busy for a moment at the second time.
    pub(super) fn answers(&self) -> Result<(), String> {
        let mut took = Duration::ZERO;
        for _ in 0..2 {
            let began = Instant::now();
            let answer = self.exchange(&self.request("GET", "/", b""), PATIENCE)?;
            if answer.status != Some(200) {
                return Err(format!(
                    "the page itself is answered with {:?}",
                    answer.status
                ));
            }
            took = began.elapsed();
            if took <= AT_ONCE {
                return Ok(());
            }
        }
        Err(format!("the page itself is answered after {took:?}"))
    }

    fn get(&self, path: &str) -> Result<Answer, String> {
        let path = format!("{path}session={}", self.session);
        self.exchange(&self.request("GET", &path, b""), PATIENCE)
    }

    /// Waits for the end of a computation, and checks its result.
    pub(super) fn computed(&self) -> Result<(), String> {
        let body = [
            r#"{"what": "compare"}"#,
            r#"{"what": "diagnose", "max_effects": 1, "effort": "quick"}"#,
        ];
        for body in body {
            let path = format!("/api/run?session={}", self.session);
            let answer = self.exchange(&self.request("POST", &path, body.as_bytes()), PATIENCE)?;
            if answer.status != Some(200) {
                return Ok(());
            }
            let began = Instant::now();
            loop {
                let answer = self.get("/api/state?")?;
                let state: Value = serde_json::from_str(&answer.body)
                    .map_err(|error| format!("{error}: {answer:?}"))?;
                if state["job"].is_null() {
                    break;
                }
                if began.elapsed() > COMPUTED {
                    return Err(format!("{body} computes for more than {COMPUTED:?}"));
                }
                thread::sleep(Duration::from_millis(20));
            }
        }
        for of in ["json", "report", "model"] {
            let answer = self.get(&format!("/api/file?of={of}&"))?;
            answered(&answer)?;
            if answer.status == Some(200) && of == "json" {
                result("the page's out.json", answer.body.as_bytes())?;
            }
        }
        Ok(())
    }

    /// Ends the page: what it has used, and what of it must not be.
    pub(super) fn end(mut self) -> Ended {
        let gone = self.child.try_wait().ok().flatten();
        let _ = self.child.kill();
        let (_, seconds, megabytes) = waited(&mut self.child);
        let said = self
            .err
            .take()
            .and_then(|err| err.join().ok())
            .unwrap_or_default();
        let mut ended = Ended {
            seconds,
            megabytes,
            ..Ended::without_process(true, String::new(), None)
        };
        ended.fault = match gone {
            Some(status) => Some(format!("the page ended: {status}: {said}")),
            None if !said.is_empty() => Some(format!("the page says {said}")),
            None => check_limits(&ended).err(),
        };
        ended
    }
}
