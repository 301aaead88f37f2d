//! Packs the plotting script of the report: plotly.js as the `plotly` crate carries it (without
//! MathJax), gzipped, so that a report can hold it and unpack it without a network.
//!
//! For the tests it sets `cfg(strace)` where strace can make calls of the system fail; where it cannot those tests are ignored.

use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use flate2::Compression;
use flate2::write::GzEncoder;

const OPENING: &str = "<script type=\"text/javascript\">";
const CLOSING: &str = "</script>";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let sources = plotly::Plot::offline_js_sources();
    let script = plotting_script(&sources)
        .ok_or("the first script of the plotly crate is no longer plotly.js")?;
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(script.as_bytes())?;
    let folder = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&folder).join("plotly.js.gz"), packed.finish()?)?;
    println!("cargo:rerun-if-env-changed=PATH");
    println!("cargo:rustc-check-cfg=cfg(strace)");
    if calls_can_fail() {
        println!("cargo:rustc-cfg=strace");
    } else {
        // A file that is not there: the script runs again at the next build, when strace may be present.
        println!("cargo:rerun-if-changed=strace is missing");
    }
    Ok(())
}

/// Whether strace is there and may make a call fail.
fn calls_can_fail() -> bool {
    Command::new("strace")
        .args(["-qq", "-o", "/dev/null"])
        .args(["-e", "inject=getppid:error=EIO", "true"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// The first script of the crate's list, plotly.js; MathJax comes after it and is left out.
fn plotting_script(sources: &str) -> Option<&str> {
    let (_, rest) = sources.split_once(OPENING)?;
    let (script, _) = rest.split_once(CLOSING)?;
    script.contains("plotly.js v").then_some(script)
}
