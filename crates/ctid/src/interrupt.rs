//! Ctrl-C during a search: the first one ends the search with the best result so far, the second one ends the program at once.

use std::io::{self, IsTerminal, Write};
use std::process::exit;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a program that was ended by an interrupt (128 + SIGINT).
const INTERRUPTED: i32 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// The flag that an interrupt sets, cleared. If the interrupt cannot be caught, it ends the program as usual.
pub(crate) fn flag() -> &'static AtomicBool {
    ASKED.store(false, Ordering::Relaxed);
    HANDLER.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::Relaxed) {
                exit(INTERRUPTED);
            }
            // On a terminal the progress bar shows this message.
            if !io::stderr().is_terminal() {
                let _ = writeln!(
                    io::stderr(),
                    "ending the search; the best result so far follows (a second interrupt ends the program at once)"
                );
            }
        });
    });
    &ASKED
}

/// The user has requested the best result so far.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
