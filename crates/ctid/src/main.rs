//! The program: exit code 0 on any verdict, 2 with one line on standard error where something is wrong.

use std::process::ExitCode;

use clap::Parser;
use ctid::look::Look;
use ctid::{Cli, run};

fn main() -> ExitCode {
    match run(
        Cli::parse(),
        &mut std::io::stdout().lock(),
        Look::of_stdout(),
    ) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", error.to_string().replace('\n', "; "));
            ExitCode::from(2)
        }
    }
}
