//! The sessions of all tabs: each has a number that nobody can guess, there are a few of them, and what they hold is bounded.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::session::{Session, lock};
use super::upload::Upload;

/// Tabs at most; the one that was not seen for the longest time goes.
const MOST: usize = 8;
/// Bytes of records over all tabs.
const BYTES: usize = 256 << 20;
/// A computation whose page has not asked for so long is nobody's. Browsers let a page in the background ask once a minute.
const ALONE: Duration = Duration::from_secs(180);

/// A tab's session.
pub(super) type Shared = Arc<Mutex<Session>>;

/// A tab. When its page asked last stands beside its session, which may be busy: no tab waits for another's.
#[derive(Debug)]
struct Tab {
    id: String,
    seen: Instant,
    session: Shared,
}

/// All of them, and what a new one begins with.
#[derive(Debug)]
pub(super) struct Sessions {
    model: Option<PathBuf>,
    records: Vec<Upload>,
    /// Never held while a session is locked.
    all: Mutex<Vec<Tab>>,
}

impl Sessions {
    pub(super) fn new(model: Option<PathBuf>, records: Vec<Upload>) -> Self {
        Self {
            model,
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
        let session = Session::new(self.model.clone(), self.records.clone());
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

    /// Makes room after a record was taken by `id`.
    pub(super) fn make_room(&self, id: &str) {
        let bytes = || -> usize {
            let sessions = self.those(|_| true);
            sessions.iter().map(|session| lock(session).bytes()).sum()
        };
        while bytes() > BYTES && self.forget_oldest(id) {}
    }

    /// Stops what nobody waits for.
    pub(super) fn stop_abandoned(&self) {
        for session in self.those(|tab| tab.seen.elapsed() > ALONE) {
            lock(&session).stop();
        }
    }

    fn those(&self, which: impl Fn(&Tab) -> bool) -> Vec<Shared> {
        let all = lock(&self.all);
        let some = all.iter().filter(|tab| which(tab));
        some.map(|tab| tab.session.clone()).collect()
    }

    /// The one that was not seen for the longest time, but `id`; what it computes stops. Whether there was one.
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
    use super::*;

    #[test]
    fn the_oldest_tab_goes() {
        let sessions = Sessions::new(None, Vec::new());
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

    #[test]
    fn a_busy_tab_is_found_and_keeps_no_other_waiting() {
        let sessions = Sessions::new(None, Vec::new());
        let (busy, session) = sessions.open();
        let (other, _) = sessions.open();
        let work = lock(&session);
        assert!(sessions.find(&busy).is_some());
        assert!(sessions.find(&other).is_some());
        drop(work);
    }
}
