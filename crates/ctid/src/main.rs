//! The program: exit code 0 on any verdict, 2 with one line on standard error where something is wrong.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;
use ctid::look::Look;
use ctid::{Cli, one_line, run};

fn main() -> ExitCode {
    let message = match Cli::try_parse() {
        Ok(cli) => match run(cli, &mut io::stdout().lock(), Look::of_stdout()) {
            Ok(()) => return ExitCode::SUCCESS,
            Err(error) => format!("error: {error}"),
        },
        // Help and version are asked for: they are no errors, and go to standard output.
        Err(asked) if !asked.use_stderr() => {
            return match asked.print() {
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => ExitCode::from(2),
                _ => ExitCode::SUCCESS,
            };
        }
        Err(error) => error.to_string(),
    };
    // Whoever has closed standard error still gets the exit code.
    let _ = writeln!(io::stderr(), "{}", one_line(&message));
    ExitCode::from(2)
}
