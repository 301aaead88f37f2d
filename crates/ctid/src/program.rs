//! The program from its arguments to its exit code: 0 for any verdict, 2 with one line on standard error after an error.

use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;
#[cfg(unix)]
use nix::sys::signal::{SigSet, Signal};

use crate::look::Look;
use crate::{Cli, one_line, run};

/// Runs the program with its arguments, of which the first is its name. The function starts the threads of the whole process: call it once.
pub fn program(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let message = match Cli::try_parse_from(arguments) {
        Ok(cli) => match start_threads().and_then(|()| done(cli)) {
            Ok(()) => return ExitCode::SUCCESS,
            Err(error) => format!("error: {error}"),
        },
        // Help and version were requested: they are no errors, and go to standard output.
        Err(asked) if !asked.use_stderr() => {
            return match asked.print() {
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => ExitCode::from(2),
                _ => ExitCode::SUCCESS,
            };
        }
        Err(error) => error.to_string(),
    };
    // If standard error is closed, the exit code is still correct.
    let _ = writeln!(io::stderr(), "{}", one_line(&message));
    ExitCode::from(2)
}

fn done(cli: Cli) -> Result<(), String> {
    run(cli, &mut io::stdout().lock(), Look::of_stdout()).map_err(|error| error.to_string())
}

/// Starts the threads that compute. Left to the first computation, a failed start ends the program with a panic. All threads keep back the
/// signal that a file larger than allowed sends, which would end the program: the write then fails with an error.
fn start_threads() -> Result<(), String> {
    #[cfg(unix)]
    {
        let mut held_back = SigSet::empty();
        held_back.add(Signal::SIGXFSZ);
        held_back
            .thread_block()
            .map_err(|error| format!("a signal handler cannot be installed: {error}"))?;
    }
    rayon::ThreadPoolBuilder::new().build_global().map_err(|error| {
        format!(
            "the threads that compute cannot be started: {error}; allow more processes or memory, or set RAYON_NUM_THREADS=1"
        )
    })
}
