//! Says what this machine has beside the checkout, so that a test that needs it is ignored where it is not there, and not passed unchecked:
//! `cfg(measured_records)` and `cfg(blind_records)` for the records in `../shared`, `cfg(chromium)` for the browser, `cfg(rumoca)` where
//! python3 has the Modelica compiler of that name (`pip install rumoca`).

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=PATH");
    let shared = Path::new("../../shared");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let browsers: Vec<PathBuf> = std::env::split_paths(&path)
        .map(|folder| folder.join("chromium"))
        .collect();
    let browser = browsers.iter().find(|browser| browser.exists());
    let has = [
        (
            "measured_records",
            ["real", "data/cascaded_tanks"]
                .map(|folder| shared.join(folder))
                .to_vec(),
        ),
        ("blind_records", vec![shared.join("blind/public")]),
        ("chromium", browser.cloned().into_iter().collect()),
    ];
    println!("cargo::rustc-check-cfg=cfg(rumoca)");
    if has_rumoca() {
        println!("cargo::rustc-cfg=rumoca");
    } else {
        println!("cargo::rerun-if-changed=rumoca is missing");
    }
    for (name, needed) in has {
        println!("cargo::rustc-check-cfg=cfg({name})");
        if !needed.is_empty() && needed.iter().all(|path| path.exists()) {
            for path in &needed {
                println!("cargo::rerun-if-changed={}", path.display());
            }
            println!("cargo::rustc-cfg={name}");
        } else {
            // A missing file: the script runs again at the next build, when the file may exist.
            println!("cargo::rerun-if-changed={name} is missing");
        }
    }
}

fn has_rumoca() -> bool {
    let quiet = Stdio::null;
    let mut python = Command::new("python3");
    python.args(["-c", "import rumoca"]);
    let done = python.stdout(quiet()).stderr(quiet()).status();
    done.is_ok_and(|status| status.success())
}
