//! Requests to the page.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::process::{Folder, check_limits, drained, message, result, shortened, waited};
use super::source::Source;
use super::{Ended, models, records};
use crate::http::{self, Answer};

/// Within this another request is answered, whatever was sent before.
const AT_ONCE: Duration = Duration::from_secs(2);
/// A request that is not answered by then is not answered.
const PATIENCE: Duration = Duration::from_secs(10);
/// A computation ends within this.
const COMPUTED: Duration = Duration::from_secs(30);
/// Requests of a case.
const REQUESTS: usize = 12;

/// A page that runs.
struct Running {
    child: Child,
    /// Of its model file.
    _folder: Folder,
    address: String,
    secret: String,
    session: String,
    err: Option<JoinHandle<String>>,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

impl Running {
    fn begin() -> Result<Self, String> {
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

    /// A tab of its own.
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

    fn request(&self, method: &str, path: &str, body: &[u8]) -> Vec<u8> {
        let head = format!(
            "{method} /{}{path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n",
            self.secret,
            self.address,
            body.len()
        );
        [head.as_bytes(), body].concat()
    }

    fn exchange(&self, bytes: &[u8], patience: Duration) -> Result<Answer, String> {
        http::exchange(self.address.as_str(), bytes, patience)
            .map_err(|error| format!("no connection: {error}"))
    }

    /// Another request is answered, and soon; on a machine that is busy for a moment at the second time.
    fn answers(&self) -> Result<(), String> {
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

    /// Lets a computation end, and looks at what it gives.
    fn computed(&self) -> Result<(), String> {
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
    fn end(mut self) -> Ended {
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

/// A value for a key of a request.
fn value(source: &mut Source, usual: &[Value]) -> Value {
    match source.below(10) {
        0 => serde_json::from_str(&source.number()).unwrap_or(Value::Null),
        1 => json!(source.word()),
        2 => json!(source.name()),
        3 => [
            Value::Null,
            json!([]),
            json!({}),
            json!(true),
            json!([[[[[]]]]]),
        ][source.below(5)]
        .clone(),
        _ => usual[source.below(usual.len())].clone(),
    }
}

/// Path and body of a request as the page sends them, with other values.
fn asked(source: &mut Source, running: &Running) -> (&'static str, String, Vec<u8>) {
    let effects = [
        json!("overflow"),
        json!("pump_lag"),
        json!("sensor_drift"),
        json!("no_such_effect"),
    ];
    let places = [Value::Null, json!("upper"), json!("sensor"), json!("T3")];
    let session = &running.session;
    let (path, body) = match source.below(14) {
        0 => (
            "/api/session",
            json!({ "session": value(source, &[json!(session), Value::Null]) }),
        ),
        1 => {
            let plants = [
                json!("single-tank"),
                json!("cascaded-tanks"),
                json!("three-tank"),
                json!("first-order"),
            ];
            let mut form = json!({ "plant": value(source, &plants) });
            let hold = value(source, &[json!("zero"), json!("first")]);
            let known = json!({ "area": value(source, &[json!(154.0), Value::Null]) });
            let columns = json!({ "time": value(source, &[json!("t [s]")]), "input": value(source, &[json!("u [V]")]) });
            let list = [json!([1.0, 2.0]), json!([1e300, -1e300])];
            let controller = json!({ "type": value(source, &[json!("PI"), json!("RS")]), "gain": value(source, &[json!(0.5)]),
                "integral_time": value(source, &[json!(100.0)]), "r": value(source, &list), "s": value(source, &list) });
            for (key, entry) in [
                ("hold", hold),
                ("known", known),
                ("columns", columns),
                ("controller", controller),
            ] {
                if source.chance(0.4) {
                    form[key] = entry;
                }
            }
            if source.chance(0.3) {
                form["from"] = form.clone();
            }
            ("/api/settings", form)
        }
        2 => {
            let text = String::from_utf8_lossy(&models::text(source)).into_owned();
            (
                "/api/text",
                json!({ "text": text, "from": value(source, &[json!("")]) }),
            )
        }
        3 | 4 => {
            let ways = [json!("add"), json!("remove"), json!("keep")];
            let (way, effect, place) = (
                value(source, &ways),
                value(source, &effects),
                value(source, &places),
            );
            (
                "/api/effect",
                json!({ "do": way, "effect": effect, "place": place }),
            )
        }
        5 => (
            "/api/loop",
            json!({ "measured": value(source, &[json!(true), json!(false)]) }),
        ),
        6 => ("/api/run", json!({ "what": "compare" })),
        7 => {
            let (most, effort) = (
                value(source, &[json!(1), json!(2)]),
                value(source, &[json!("quick"), json!("normal")]),
            );
            (
                "/api/run",
                json!({ "what": "diagnose", "max_effects": most, "effort": effort }),
            )
        }
        8 => {
            let between = json!([value(source, &effects), value(source, &effects)]);
            let numbers = [json!([3.0, 6.0]), Value::Null];
            let (range, slew) = (
                value(source, &numbers),
                value(source, &[json!(1.0), Value::Null]),
            );
            let duration = value(source, &[json!(100.0), Value::Null]);
            (
                "/api/run",
                json!({ "what": "design", "group": source.below(3), "between": between, "range": range, "slew": slew, "duration": duration }),
            )
        }
        9 => (
            "/api/run",
            json!({ "what": "chain", "effects": [[value(source, &effects), value(source, &places)]] }),
        ),
        10 => ("/api/cancel", json!({})),
        11 => ("/api/finish", json!({})),
        12 => (
            "/api/forget",
            json!({ "name": value(source, &[json!("data.csv")]) }),
        ),
        _ => {
            let name = [
                "data.csv",
                "",
                "..%2f..%2fx",
                "%e2%80%ae.csv",
                "a%00b",
                "%ff",
            ][source.below(6)];
            let held = ["", "", "&held_out=true", "&held_out=7"][source.below(4)];
            let path = format!("/api/record?session={session}&name={name}{held}");
            return ("POST", path, records::text(source));
        }
    };
    (
        "POST",
        format!("{path}?session={session}"),
        body.to_string().into_bytes(),
    )
}

/// What the page only reads.
fn read(source: &mut Source, running: &Running) -> (&'static str, String, Vec<u8>) {
    let paths = [
        "/",
        "/plotly.js",
        "/page.js",
        "/api/state",
        "/api/data",
        "/api/model",
        "/api/file",
        "/api/no_such",
    ];
    let numbers = [
        source.number(),
        source.word(),
        source.name().replace([' ', '\r', '\n'], ""),
    ];
    let path = format!(
        "{}?session={}&since={}&of={}&id={}",
        source.pick(&paths),
        running.session,
        numbers[source.below(3)],
        ["json", "report", "experiment", "x"][source.below(4)],
        numbers[source.below(3)],
    );
    (
        ["GET", "GET", "HEAD", "PUT", "OPTIONS", "DELETE"][source.below(6)],
        path,
        Vec::new(),
    )
}

/// A request, damaged or not; whether it was answered with a result.
fn asks(source: &mut Source, running: &Running) -> Result<bool, String> {
    let (method, path, mut body) = if source.chance(0.15) {
        read(source, running)
    } else {
        asked(source, running)
    };
    if source.chance(0.15) {
        body = source.damaged(&body, ',');
    }
    let mut bytes = running.request(method, &path, &body);
    // A damaged head may promise more than comes: the page waits for it, and this does not.
    let damaged = source.chance(0.1);
    let mut patience = PATIENCE;
    if damaged {
        bytes = source.damaged(&bytes, ' ');
        patience = AT_ONCE / 10;
    }
    let checked = running.exchange(&bytes, patience).and_then(|answer| {
        if answer.status.is_none() && !damaged && method != "HEAD" {
            return Err("no answer".to_string());
        }
        answered(&answer)?;
        running.answers()?;
        Ok(answer.status.is_some_and(|status| status < 300))
    });
    checked.map_err(|fault| {
        let body = String::from_utf8_lossy(&body);
        format!("{method} {path} {}: {fault}", shortened(&body))
    })
}

/// A page from its begin to its end: some requests, and now and then a computation.
pub(super) fn case(source: &mut Source) -> Ended {
    let running = match Running::begin() {
        Ok(running) => running,
        Err(fault) => return Ended::without_process(false, String::new(), Some(fault)),
    };
    let asked = (0..REQUESTS).try_fold(false, |_, _| asks(source, &running));
    let accepted = asked == Ok(true);
    let mut fault = asked.err();
    if fault.is_none() && source.chance(0.2) {
        fault = running.computed().err();
    }
    let ended = running.end();
    let both = fault.into_iter().chain(ended.fault);
    let fault = both.collect::<Vec<_>>().join("; ");
    Ended {
        accepted,
        fault: Some(fault).filter(|fault| !fault.is_empty()),
        ..ended
    }
}

/// Every answer is one of those that the page is made to give.
fn answered(answer: &Answer) -> Result<(), String> {
    match answer.status {
        Some(status) if status >= 500 => Err(format!("{answer:?}")),
        Some(400..) => {
            let json: Value = serde_json::from_str(&answer.body).unwrap_or_default();
            json["error"].as_str().map_or(Ok(()), message)
        }
        _ => Ok(()),
    }
}
