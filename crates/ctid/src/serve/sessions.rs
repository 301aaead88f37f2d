//! The sessions of all tabs: each has a number that nobody can guess, there are a few of them, and what they hold is bounded.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::session::{Session, Upload, lock};

/// Tabs at most; the one that was not seen for the longest time goes.
const MOST: usize = 8;
/// Bytes of records over all tabs.
const BYTES: usize = 256 << 20;
/// A computation whose page has not asked for so long is nobody's. Browsers let a page in the background ask once a minute.
const ALONE: Duration = Duration::from_secs(180);

/// A tab's session.
pub(super) type Shared = Arc<Mutex<Session>>;

/// All of them, and what a new one begins with.
#[derive(Debug)]
pub(super) struct Sessions {
    model: Option<PathBuf>,
    records: Vec<Upload>,
    all: Mutex<Vec<(String, Shared)>>,
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
        let all = lock(&self.all);
        let (_, session) = all.iter().find(|(known, _)| known == id)?;
        lock(session).seen = Instant::now();
        Some(session.clone())
    }

    /// A new session and its number.
    pub(super) fn open(&self) -> (String, Shared) {
        let id = format!("{:032x}", rand::random::<u128>());
        let session = Session::new(self.model.clone(), self.records.clone());
        let session = Arc::new(Mutex::new(session));
        let mut all = lock(&self.all);
        all.push((id.clone(), session.clone()));
        if all.len() > MOST {
            forget_oldest(&mut all, &id);
        }
        (id, session)
    }

    /// Makes room after a record was taken by `id`.
    pub(super) fn make_room(&self, id: &str) {
        let mut all = lock(&self.all);
        let bytes = |all: &[(String, Shared)]| -> usize {
            all.iter().map(|(_, session)| lock(session).bytes()).sum()
        };
        while bytes(&all) > BYTES && all.len() > 1 {
            forget_oldest(&mut all, id);
        }
    }

    /// Stops what nobody waits for.
    pub(super) fn stop_abandoned(&self) {
        for (_, session) in lock(&self.all).iter() {
            let mut session = lock(session);
            if session.seen.elapsed() > ALONE {
                session.stop();
            }
        }
    }
}

/// The one that was not seen for the longest time, but `id`; what it computes stops.
fn forget_oldest(all: &mut Vec<(String, Shared)>, id: &str) {
    let others = all.iter().enumerate().filter(|(_, (other, _))| other != id);
    let oldest = others.min_by_key(|(_, (_, session))| lock(session).seen);
    if let Some(at) = oldest.map(|(at, _)| at) {
        let (_, session) = all.remove(at);
        lock(&session).stop();
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
}
