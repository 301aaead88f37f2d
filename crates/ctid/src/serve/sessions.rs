//! Sessions of all tabs: each has a random number that cannot be guessed; the number of sessions and their memory are limited.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::own::Own;
use super::session::{Session, lock};
use super::upload::Upload;

/// Largest number of tabs; the tab with the oldest request is dropped.
const MOST: usize = 8;
/// Limit in bytes over all tabs: records as sent and as read, and results. A single tab may use more.
const BYTES: usize = 512 << 20;
/// A computation is stopped if its page sends no request for this time. Browsers let a page in the background send one request per minute.
const ALONE: Duration = Duration::from_secs(180);

/// A tab's session.
pub(super) type Shared = Arc<Mutex<Session>>;

/// A tab. The time of the page's last request is stored outside the session, which may be locked: no tab waits for another one.
#[derive(Debug)]
struct Tab {
    id: String,
    seen: Instant,
    session: Shared,
}

/// All sessions, and the initial state of a new one.
#[derive(Debug)]
pub(super) struct Sessions {
    model: Option<PathBuf>,
    own: Option<Own>,
    records: Vec<Upload>,
    /// Never held while a session is locked.
    all: Mutex<Vec<Tab>>,
}

impl Sessions {
    pub(super) fn new(model: Option<PathBuf>, own: Option<Own>, records: Vec<Upload>) -> Self {
        Self {
            model,
            own,
            records,
            all: Mutex::new(Vec::new()),
        }
    }

    /// The session of that number.
    pub(super) fn find(&self, id: &str) -> Option<Shared> {
        let mut all = lock(&self.all);
        let tab = all.iter_mut().find(|tab| tab.id == id)?;
        tab.seen = Instant::now();
        Some(tab.session.clone())
    }

    /// A new session and its number.
    pub(super) fn open(&self) -> (String, Shared) {
        let id = format!("{:032x}", rand::random::<u128>());
        let session = Session::new(self.model.clone(), self.own.clone(), self.records.clone());
        let session = Arc::new(Mutex::new(session));
        let mut all = lock(&self.all);
        all.push(Tab {
            id: id.clone(),
            seen: Instant::now(),
            session: session.clone(),
        });
        let many = all.len() > MOST;
        drop(all);
        if many {
            self.forget_oldest(&id);
        }
        (id, session)
    }

    /// Drops sessions if their memory is too large; the latest one stays.
    pub(super) fn make_room(&self) {
        self.make_room_for(BYTES);
    }

    fn make_room_for(&self, bytes: usize) {
        let held = || -> usize {
            let sessions = self.those(|_| true);
            sessions.iter().map(|session| lock(session).held()).sum()
        };
        let last = || {
            let all = lock(&self.all);
            let last = all.iter().max_by_key(|tab| tab.seen);
            last.map(|tab| tab.id.clone())
        };
        while held() > bytes && last().is_some_and(|id| self.forget_oldest(&id)) {}
    }

    /// Stops computations of closed pages.
    pub(super) fn stop_abandoned(&self) {
        self.stop_unseen_for(ALONE);
    }

    fn stop_unseen_for(&self, alone: Duration) {
        for session in self.those(|tab| tab.seen.elapsed() >= alone) {
            lock(&session).stop_abandoned();
        }
    }

    fn those(&self, which: impl Fn(&Tab) -> bool) -> Vec<Shared> {
        let all = lock(&self.all);
        let some = all.iter().filter(|tab| which(tab));
        some.map(|tab| tab.session.clone()).collect()
    }

    /// Drops the tab with the oldest last request, except `id`; its computation stops. Returns whether there was one.
    fn forget_oldest(&self, id: &str) -> bool {
        let mut all = lock(&self.all);
        let others = all.iter().enumerate().filter(|(_, tab)| tab.id != id);
        let oldest = others.min_by_key(|(_, tab)| tab.seen).map(|(at, _)| at);
        let oldest = oldest.map(|at| all.remove(at));
        drop(all);
        let Some(tab) = oldest else { return false };
        lock(&tab.session).stop();
        true
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::atomic::Ordering;

    use super::super::session::{Job, Kind};
    use super::*;
    use crate::model_file;

    #[test]
    fn the_oldest_tab_goes() {
        let sessions = Sessions::new(None, None, Vec::new());
        let (first, _) = sessions.open();
        let (second, _) = sessions.open();
        assert!(sessions.find(&first).is_some());
        for _ in 0..MOST - 1 {
            sessions.open();
        }
        assert!(sessions.find(&second).is_none(), "it was not seen since");
        assert!(sessions.find(&first).is_some());
        assert_eq!(lock(&sessions.all).len(), MOST);
    }

    /// Two records with small files and larger memory after reading.
    #[test]
    fn what_is_read_needs_room_too() {
        let sessions = Sessions::new(None, None, Vec::new());
        let tabs = [sessions.open(), sessions.open()];
        let rows: String = (0..500)
            .map(|k| format!("{k},{},{}\n", k % 3, k % 9))
            .collect();
        let text = format!("t,u,y\n{rows}");
        let sent = 2 * text.len();
        for (_, session) in &tabs {
            let upload = Upload::new("a.csv", false, text.clone().into()).unwrap();
            lock(session).take(upload).unwrap();
        }
        sessions.make_room_for(sent);
        assert_eq!(lock(&sessions.all).len(), 2);
        for (_, session) in &tabs {
            let state = super::super::state::state(&mut lock(session));
            assert!(state["records"][0]["error"].is_null(), "{state}");
        }
        sessions.make_room_for(sent + 2 * 500 * 3 * 8);
        assert_eq!(lock(&sessions.all).len(), 2);
        sessions.make_room_for(sent + 2 * 500 * 3 * 8 - 1);
        assert!(sessions.find(&tabs[0].0).is_none(), "the older one goes");
        // A single session stays, whatever its memory is.
        sessions.make_room_for(0);
        assert!(sessions.find(&tabs[1].0).is_some());
    }

    fn job(kind: Kind) -> Job {
        Job {
            number: 1,
            kind,
            model: Some(model_file::parse("m.toml", "plant = \"single-tank\"").unwrap()),
            begun: Instant::now(),
            limit: None,
            interrupt: Arc::default(),
            stop: Arc::default(),
            progress: Arc::default(),
        }
    }

    #[test]
    fn what_was_stopped_because_nobody_asked_says_so() {
        let sessions = Sessions::new(None, None, Vec::new());
        let (id, session) = sessions.open();
        for (kind, button) in [
            (Kind::Diagnose, "Diagnose"),
            (Kind::Design, "Design an experiment"),
        ] {
            let job = job(kind);
            let (stop, version) = (job.stop.clone(), lock(&session).version);
            lock(&session).job = Some(job);
            sessions.stop_unseen_for(Duration::from_secs(60));
            assert!(lock(&session).job.is_some(), "it was just seen");
            sessions.stop_unseen_for(Duration::ZERO);
            assert!(stop.load(Ordering::Relaxed));
            let seen = sessions.find(&id).unwrap();
            let seen = lock(&seen);
            assert!(seen.job.is_none() && seen.version > version);
            let said = seen.failure.clone().unwrap();
            assert!(
                said.contains("was stopped")
                    && said.ends_with(&format!("{button} starts it again")),
                "{said}"
            );
        }
        // The page restarts a fit by itself, so no message is needed.
        lock(&session).failure = None;
        lock(&session).job = Some(job(Kind::Compare));
        sessions.stop_unseen_for(Duration::ZERO);
        assert!(lock(&session).job.is_none() && lock(&session).failure.is_none());
        // Stopping without a running computation has no effect.
        sessions.stop_unseen_for(Duration::ZERO);
        assert!(lock(&session).failure.is_none());
    }

    #[test]
    fn a_busy_tab_is_found_and_keeps_no_other_waiting() {
        let sessions = Sessions::new(None, None, Vec::new());
        let (busy, session) = sessions.open();
        let (other, _) = sessions.open();
        let work = lock(&session);
        assert!(sessions.find(&busy).is_some());
        assert!(sessions.find(&other).is_some());
        drop(work);
    }
}
