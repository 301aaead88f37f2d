//! The blind records: their files, and where they lie.

use std::io;
use std::path::{Path, PathBuf};
use std::{env, fs};

use ctid::input::Files;

/// The folder of the blind records: the first argument of the program, or `../shared/blind/public` beside the checkout; `None`, and a
/// printed reason, if it is not there.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/blind/public");
    let folder = env::args().nth(1).map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: no blind records at {}", folder.display());
        return None;
    }
    Some(folder)
}

/// The names of the records in a folder that contain a text, sorted, and the files of each.
///
/// # Errors
/// If the folder cannot be read.
pub fn cases(folder: &Path, part: &str) -> io::Result<Vec<(String, Files)>> {
    let mut records: Vec<PathBuf> = fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    records.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    records.retain(|path| {
        path.file_stem()
            .is_some_and(|stem| stem.to_string_lossy().contains(part))
    });
    records.sort();
    let case = |record: PathBuf| {
        let stem = record.file_stem();
        let name = stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let files = Files {
            model: record.with_extension("toml"),
            data: vec![record],
            test: Vec::new(),
            options: ct_signals::ReadOptions::default(),
        };
        (name, files)
    };
    Ok(records.into_iter().map(case).collect())
}
