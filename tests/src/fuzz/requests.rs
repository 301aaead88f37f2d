//! Requests to the page.

mod running;

use serde_json::{Value, json};

use self::running::{AT_ONCE, PATIENCE, Running};
use super::process::{message, shortened};
use super::source::Source;
use super::{Ended, models, records};
use crate::http::Answer;

/// Requests of a case.
const REQUESTS: usize = 12;

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

/// Requests of the page that only read.
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
