//! Long computations: the interpreter's lock is released, and Ctrl-C is checked.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use ctid::MessageNames;
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

use crate::error;
use crate::message_names::PYTHON;

/// Interval of the checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// Stack size of a main thread: the texts of models are parsed by recursion.
const STACK: usize = 8 << 20;

/// Message of the work.
enum Said<T> {
    Phase(&'static str),
    Done(T),
}

/// Reports the present phase to the caller.
pub struct Phases<T>(Sender<Said<T>>);

impl<T> Phases<T> {
    pub fn tell(&self, phase: &'static str) {
        // Who does not listen any more does not mind.
        let _ = self.0.send(Said::Phase(phase));
    }
}

/// Runs work in a pool of its own if the process has one thread for all parallel loops (`RAYON_NUM_THREADS=1`): calls from several Python threads
/// would take turns in it.
fn in_own_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if rayon::current_num_threads() > 1 {
        return work();
    }
    let pool = ThreadPoolBuilder::new().num_threads(1).stack_size(STACK);
    match pool.build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

/// Runs work as [`run_worded`] does, with the names of arguments that most calls have.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&AtomicBool, &Phases<Result<T, ctid::Error>>) -> Result<T, ctid::Error> + Send,
) -> PyResult<T> {
    run_worded(py, progress, &PYTHON, work)
}

/// Runs work that may take long. Ctrl-C sets a flag that the work receives: the work ends soon then, and a `KeyboardInterrupt` replaces its
/// result. `progress`: called with every new phase. `names`: names of arguments in messages.
pub fn run_worded<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    names: &MessageNames,
    work: impl FnOnce(&AtomicBool, &Phases<Result<T, ctid::Error>>) -> Result<T, ctid::Error> + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    py.detach(|| {
        thread::scope(|scope| {
            let (sender, receiver) = channel();
            let stop = &stop;
            let worker = thread::Builder::new().stack_size(STACK);
            let worker = worker.spawn_scoped(scope, move || {
                let phases = Phases(sender);
                let found = in_own_pool(|| work(stop, &phases));
                let _ = phases.0.send(Said::Done(found));
            });
            let worker = worker.map_err(|error| {
                error::Error::new_err(format!("no thread can be started: {error}"))
            })?;
            let mut raised = None;
            let found = loop {
                match receiver.recv_timeout(LOOK) {
                    Ok(Said::Done(found)) => break Some(found),
                    Ok(Said::Phase(phase)) => {
                        let Some(progress) = progress.filter(|_| raised.is_none()) else {
                            continue;
                        };
                        raised = Python::attach(|py| progress.call1(py, (phase,)).err());
                    }
                    Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                        raised = Python::attach(|py| py.check_signals().err());
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break None,
                }
                if raised.is_some() {
                    stop.store(true, Ordering::Relaxed);
                }
            };
            // A panic is an internal error of ctid; its message is already printed.
            let ended = worker.join();
            if let Some(raised) = raised {
                return Err(raised);
            }
            match (ended, found) {
                (Ok(()), Some(found)) => found.map_err(|error| error::worded(&error, names)),
                _ => Err(error::Error::new_err(
                    "this is an internal error of ctid: please report the line above",
                )),
            }
        })
    })
}
