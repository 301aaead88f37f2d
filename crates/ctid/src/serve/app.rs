//! What all requests share: the tabs, and the room for what is sent.

use tokio::sync::Semaphore;

use super::sessions::Sessions;

/// Data that all requests share.
#[derive(Debug)]
pub(super) struct App {
    pub sessions: Sessions,
    /// Number of bytes of files that may be transferred at once.
    pub uploading: Semaphore,
    /// Number of bytes of other requests.
    pub asking: Semaphore,
}
