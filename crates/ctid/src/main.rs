//! The program.

use std::process::ExitCode;

fn main() -> ExitCode {
    ctid::program(std::env::args_os())
}
