//! Packs the plotting script of the report: plotly.js as the `plotly` crate carries it (without
//! MathJax), gzipped and in base64, so that a report can hold it and unpack it without a network.

use std::error::Error;
use std::io::Write;
use std::path::Path;

use base64::Engine;
use flate2::Compression;
use flate2::write::GzEncoder;

const OPENING: &str = "<script type=\"text/javascript\">";
const CLOSING: &str = "</script>";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let sources = plotly::Plot::offline_js_sources();
    let script =
        plotting_script(&sources).ok_or("the plotly crate no longer leads with plotly.js")?;
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(script.as_bytes())?;
    let text = base64::engine::general_purpose::STANDARD.encode(packed.finish()?);
    let folder = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&folder).join("plotly.js.gz.base64"), text)?;
    Ok(())
}

/// The first script of the crate's list, plotly.js; MathJax comes after it and is left out.
fn plotting_script(sources: &str) -> Option<&str> {
    let (_, rest) = sources.split_once(OPENING)?;
    let (script, _) = rest.split_once(CLOSING)?;
    script.contains("plotly.js v").then_some(script)
}
