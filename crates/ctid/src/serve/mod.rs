//! `ctid serve`: a page on 127.0.0.1 that does what the commands do, with the mouse.
//!
//! # What it is made of
//! | what | where |
//! |---|---|
//! | who may ask | `guard.rs`; how many at once: `connections.rs`; what they send: `body.rs` |
//! | the page's files | `assets.rs`, `page/` |
//! | what one tab works on | `session.rs`, its records `upload.rs`; all of them: `sessions.rs`; what they hold: `held.rs` |
//! | the form of the model | `settings.rs` |
//! | a model of its user's own, and its fits | `own.rs`; its changes `own_change.rs`; what is computed for it `own_work.rs`; what was found `own_findings.rs`; its experiments `own_design.rs` |
//! | computations | `jobs.rs` |
//! | what the page is told | `state.rs`, `words.rs` |
//! | the routes | `api.rs`, those of computations `api/run.rs`; `downloads.rs`; what they share: `app.rs`, `tab.rs` |
//!
//! The state is a model file, that of `--model` or a text that is kept for the tab and can be downloaded. It is changed by the
//! functions of `ctid add` and `ctid remove`, fitted by those of `ctid compare` and `ctid diagnose`; a file is read again at
//! every request, so that page and commands can be mixed.
//!
//! # The requests
//! Every tab has a session, named in the query; requests are JSON except for a record, and answers are JSON except for a download. No
//! parameter is used as a file path. Every address begins with the secret of the run, `/SECRET/api/state`, which the table leaves
//! out. A refusal is `{"error": "..."}` with a status of 400 or more: one line with the correction, as the commands write it. What the page
//! never sends, such as broken JSON, is refused in plain text.
//!
//! | request | takes | gives |
//! |---|---|---|
//! | `POST /api/session` | `{session}`, the one that the tab had, or null | `{session, state, plants}` |
//! | `GET /api/state?session=&since=` | the version that the page shows | the state, or `{version, job}` where it is the same |
//! | `POST /api/record?session=&name=&held_out=` | the CSV itself, at most 64 MB | the state |
//! | `POST /api/forget?session=` | `{name}` of a record | the state |
//! | `POST /api/settings?session=` | `{plant, hold, columns, known, controller}`, as the model file has them, and `from`: the same as the form was filled from | the state; 409 where the model says something else than `from` |
//! | `POST /api/text?session=` | `{text}`, a whole model file, and `from`: the text that it replaces | the state; 409 where another stands there |
//! | `POST /api/own?session=` | `{do: "begin"}`, `{do: "end"}`, `{do: "example", name}`, `{do: "write", text, file}` of which one may be missing, `{do: "column", signal, column}`, `{do: "add" or "remove", effect}` | the state |
//! | `POST /api/effect?session=` | `{do: "add" or "remove", effect, place}`; `{do: "keep", effect}` adds what the diagnosis left unexplained under that name | the state |
//! | `POST /api/loop?session=` | `{measured}`: whether models run on the measured command where the loop could be simulated | the state |
//! | `POST /api/run?session=` | `{what: "compare"}`, `{what: "diagnose", max_effects, effort}`, effort `quick`, `normal` or `thorough`, `{what: "chain", effects: [[effect, place], ...]}`, `{what: "design", group, between: [a, b], range: [low, high], slew, duration}`, of which the last three may be missing; of a model of its user's own `inputs: [{name, apply, range, slew}]` in place of range and slew | the state |
//! | `POST /api/cancel?session=` | | the state; what was computed is dropped |
//! | `POST /api/finish?session=` | | the state; a search ends soon with the best that it has found |
//! | `GET /api/data?session=` | | the records' curves, as the report draws them |
//! | `GET /api/model?session=&id=` | the number of a fit or of the diagnosis | its curves, parameters and sentences |
//! | `GET /api/file?session=&of=` | `model`, `text`, `report` or `experiment` | the file |
//!
//! The state is `{version, own, file, text, model_error, settings, effects, waiting, records, warnings, headings, guessed, current, trail,
//! models, chains, loop, diagnosis, design, job, failure}`: `current` is the number of the fit of the model as it stands, `trail` the fits
//! of its first effects, `job` `{what, phase, done, total, seconds, limit, ending}` while something is computed. A fit stops where the
//! model becomes another.
//!
//! # What is bounded
//! Eight tabs. 64 connections on which the secret was known, and 128 others whose request begins within ten seconds and which end with
//! their one refusal; where there are more, the one that was idle for the longest time is closed. An answer that is not taken, and
//! a body of which nothing more comes, for ten seconds end their connection; no thread waits for them. Of the bodies 256 MB are under way at
//! once. 64 MB of files and 20 records in a tab, 500 columns in a file, twelve fits in a tab. Over all tabs 512 MB of files, of what is
//! read from them (at most four times as much) and of what was computed; the tab that was seen last may hold more, and is then alone. One
//! computation in a tab, which takes a copy of what was read; it stops when another begins, when its tab is forgotten, and three minutes
//! after its page has asked last.

mod api;
mod app;
mod assets;
mod body;
mod connections;
mod downloads;
mod guard;
mod held;
mod jobs;
mod own;
mod own_change;
mod own_design;
mod own_findings;
mod own_work;
mod session;
mod sessions;
mod settings;
mod state;
mod tab;
mod upload;
mod words;

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use clap::Args;
use ct_signals::ReadOptions;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;

use self::api::LARGEST_REQUEST;
use self::app::App;
use self::connections::Bounds;
use self::guard::{Guard, LARGEST_BODY};
use self::own::Own;
use self::sessions::Sessions;
use self::upload::Upload;
use crate::Error;
use crate::finish::say;
use crate::input::Files;
use crate::own_model::AnyModelFile;

/// Default port of the page.
const PORT: u16 = 8420;
/// Number of ports that are tried, from the first on.
const TRIED: u16 = 20;
/// Number of files of the largest size that may be transferred at once.
const FILES_AT_ONCE: usize = 4;
/// Other requests of the largest size.
const REQUESTS_AT_ONCE: usize = 64;

/// Command line options.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Records (CSV) that are loaded at the start; others can be dropped on the page
    #[arg(value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Model file that the page edits; without it the page holds one that can be downloaded
    #[arg(long, value_name = "M.toml")]
    model: Option<PathBuf>,
    /// Held-out record; may be repeated
    #[arg(long, value_name = "T.csv")]
    test: Vec<PathBuf>,
    /// Port on 127.0.0.1; if it is in use, the next free one; 0 for any
    #[arg(long, value_name = "PORT", default_value_t = PORT)]
    port: u16,
}

impl Arguments {
    /// Runs the server until the process ends; prints the address to `out` first.
    pub(crate) fn run(&self, out: &mut dyn Write) -> Result<(), Error> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()?;
        let (records, own) = self.records()?;
        let listener = runtime.block_on(listen(self.port))?;
        let address = listener.local_addr()?;
        let guard = Guard::new(address.port());
        let secret = guard.secret();
        say(
            out,
            &format!(
                "The page is at http://{address}/{secret}/, on this machine, for whoever knows this address; Ctrl-C ends it.\n"
            ),
        )?;
        // The page edits only the model file of a plant.
        let file = self.model.clone().filter(|_| own.is_none());
        let sessions = Sessions::new(file, own, records);
        runtime.block_on(serve(listener, guard, sessions))
    }

    /// The records of the command line; errors in the records or the model are reported before the server starts.
    fn records(&self) -> Result<(Vec<Upload>, Option<Own>), Error> {
        let files = Files {
            data: self.data.clone(),
            test: self.test.clone(),
            model: self.model.clone().unwrap_or_default(),
            options: ReadOptions::default(),
        };
        files.check_repetition()?;
        let mut own = None;
        if let Some(path) = &self.model {
            match AnyModelFile::read(path)? {
                AnyModelFile::Plant(model) if !self.data.is_empty() => {
                    files.read_with(*model)?;
                }
                AnyModelFile::Plant(_) => {}
                AnyModelFile::Own(model) => {
                    if !self.data.is_empty() {
                        model.records(&files)?;
                    }
                    own = Some(Own::read(path)?);
                }
            }
        }
        let fitted = self.data.iter().map(|path| (path, false));
        let held_out = self.test.iter().map(|path| (path, true));
        let records = fitted
            .chain(held_out)
            .map(|(path, held_out)| read(path, &files.name_of(path), held_out));
        Ok((records.collect::<Result<_, Error>>()?, own))
    }
}

fn read(path: &Path, name: &str, held_out: bool) -> Result<Upload, Error> {
    let content = ct_signals::read_file(path, LARGEST_BODY as u64).map_err(|error| match error {
        ct_signals::Error::Read(ct_signals::ReadError::FileTooLarge { .. }) => Error::file(
            path,
            format!(
                "it is larger than {} MB, the most that the page takes; run `ctid diagnose` on it",
                LARGEST_BODY >> 20
            ),
        ),
        other => other.into(),
    })?;
    Upload::new(name, held_out, content.into()).map_err(|refusal| Error::Usage(refusal.to_string()))
}

/// The port, or the next free one.
async fn listen(port: u16) -> Result<TcpListener, Error> {
    let mut tried = port;
    loop {
        match TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, tried))).await {
            Ok(listener) => return Ok(listener),
            Err(error) => {
                let last = tried == u16::MAX || tried - port + 1 >= TRIED;
                if last || error.kind() != std::io::ErrorKind::AddrInUse {
                    return Err(Error::Usage(format!(
                        "port {tried} of 127.0.0.1 cannot be used: {error}; choose another with --port, or 0 for any"
                    )));
                }
                tried += 1;
            }
        }
    }
}

async fn serve(listener: TcpListener, guard: Guard, sessions: Sessions) -> Result<(), Error> {
    let app = Arc::new(App {
        sessions,
        uploading: Semaphore::new(FILES_AT_ONCE * LARGEST_BODY),
        asking: Semaphore::new(REQUESTS_AT_ONCE * LARGEST_REQUEST),
    });
    let watched = app.clone();
    tokio::spawn(async move {
        let mut clock = tokio::time::interval(Duration::from_secs(5));
        loop {
            clock.tick().await;
            let watched = watched.clone();
            // Waits for a busy tab.
            let _ = tokio::task::spawn_blocking(move || {
                watched.sessions.stop_abandoned();
                watched.sessions.make_room();
            })
            .await;
        }
    });
    let router = Router::new()
        .merge(assets::routes())
        .merge(api::routes(&app))
        .with_state(app);
    connections::serve(listener, guard, router, Bounds::default()).await;
    Ok(())
}
