//! The program as a process: its path next to an example, and its results.

use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

/// The program that was built with this example; `None`, and a line that says so, where it was not.
#[must_use]
pub fn program() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?.with_file_name("../ctid");
    if program.exists() {
        return Some(program);
    }
    println!(
        "skipped: {} is not built: cargo build --release",
        program.display()
    );
    None
}

/// Result of a command with `--json`, and its duration \[s\].
///
/// # Errors
/// Its message where it refuses, and why its file cannot be read.
pub fn result(command: &mut Command) -> Result<(Value, f64), String> {
    let scratch = tempfile::tempdir().map_err(|error| error.to_string())?;
    let json = scratch.path().join("result.json");
    let began = Instant::now();
    let out = command.arg("--json").arg(&json).output();
    let out = out.map_err(|error| error.to_string())?;
    let seconds = began.elapsed().as_secs_f64();
    if !out.status.success() {
        return Err(String::from_utf8_lossy(&out.stderr).trim().to_string());
    }
    let text = std::fs::read_to_string(json).map_err(|error| error.to_string())?;
    let found = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    Ok((found, seconds))
}
