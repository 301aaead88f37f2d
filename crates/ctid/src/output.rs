//! `--json` and `--report`: checked before anything is computed, written at the end, whole or not at all.

use std::fs;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use missing_effect::Diagnosis;
use serde::{Deserialize, Serialize};

use crate::{Error, atomic, report, term_file};
use linear_identification::{Identification, side_by_side::SideBySide};

/// How much of an existing page is looked at: the mark stands in its head.
const HEAD: u64 = 4096;

/// Who has written a file of results, as its first key says.
const WRITTEN_BY: &str = "ctid";

/// Results as they are written.
#[derive(Serialize)]
struct Marked<'a, T> {
    written_by: &'static str,
    #[serde(flatten)]
    found: &'a T,
}

/// What tells JSON of ctid's from others'.
#[derive(Deserialize)]
struct Mark {
    written_by: String,
    #[serde(rename = "schema")]
    _schema: u32,
}

/// What is in a file that the program writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The result as JSON.
    Json,
    /// The result as a page.
    Report,
    /// A record as CSV; nothing is written where there is none to play.
    Record,
    /// The shape of what is missing, as CSV; nothing is written where nothing is.
    Unknown,
    /// A model's text.
    Model,
}

/// What a command finds, which is written as JSON with `schema` and the mark that ctid knows its own files by, or as a page.
pub trait Found: Serialize {
    /// The page, complete, where there is one.
    fn page(&self) -> String {
        String::new()
    }

    /// The record as CSV, where there is one.
    fn record(&self) -> Option<String> {
        None
    }

    /// The model's text, where there is one.
    fn model(&self) -> Option<String> {
        None
    }

    /// The shape of what nothing explains as CSV, where there is one.
    fn unknown(&self) -> Option<String> {
        None
    }
}

impl Found for Diagnosis {
    fn page(&self) -> String {
        report::html(self)
    }
    fn unknown(&self) -> Option<String> {
        self.unknown.as_ref().map(term_file::text)
    }
}

/// A file that will be written.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    kind: Kind,
    path: PathBuf,
    /// A file of ctid's, or an empty one, stood there when the command began.
    replaces: bool,
}

impl Found for SideBySide {
    fn page(&self) -> String {
        report::side_by_side(self)
    }
}

impl Found for Identification {
    fn page(&self) -> String {
        report::identification(self)
    }
}

/// Checks where results may go: not onto an input, not onto each other, not over a file that ctid
/// did not write, and into a folder that is there and may be written to.
///
/// # Errors
/// One line that names the file and the mend; nothing has been written.
pub fn plan(wanted: &[(Kind, &Path)], inputs: &[&Path]) -> Result<Vec<Output>, Error> {
    let mut outputs = Vec::with_capacity(wanted.len());
    for (index, &(kind, path)) in wanted.iter().enumerate() {
        if kind == Kind::Report && cfg!(not(feature = "plotly")) {
            return Err(Error::file(
                path,
                "ctid was built without plotly.js, which a page needs; build it with its feature `plotly`",
            ));
        }
        if inputs.iter().any(|input| same_file(input, path)) {
            return Err(Error::file(
                path,
                "it is one of the inputs and would be overwritten; choose another name",
            ));
        }
        if wanted[..index]
            .iter()
            .any(|(_, other)| same_file(other, path))
        {
            return Err(Error::file(
                path,
                "two results cannot share a file; choose another name for one of them",
            ));
        }
        outputs.push(Output {
            kind,
            path: path.to_path_buf(),
            replaces: check(kind, path)? == Standing::Ours,
        });
    }
    Ok(outputs)
}

impl Output {
    /// What is in it.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Where it goes.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes it; says whether there was something to write.
    ///
    /// # Errors
    /// Where the disk does not take it, or something else stands there than when the command began; that is then still there.
    pub fn write(&self, found: &impl Found) -> Result<bool, Error> {
        let content = match self.kind {
            Kind::Json => {
                let marked = Marked {
                    written_by: WRITTEN_BY,
                    found,
                };
                let text = serde_json::to_string_pretty(&marked)
                    .map_err(|error| Error::file(&self.path, error.to_string()))?;
                Some(text + "\n")
            }
            Kind::Report => Some(found.page()),
            Kind::Record => found.record(),
            Kind::Unknown => found.unknown(),
            Kind::Model => found.model(),
        };
        let Some(content) = content else {
            return Ok(false);
        };
        let as_it_was = || standing(self.kind, &self.path) == Standing::Ours;
        let written = if self.replaces && !is_missing(&self.path) {
            atomic::write_if(&self.path, content.as_bytes(), as_it_was)?
        } else {
            atomic::create(&self.path, content.as_bytes())?
        };
        if written {
            return Ok(true);
        }
        Err(Error::file(
            &self.path,
            "somebody else has written it while this command ran, so that it was not overwritten; choose another name and run it again",
        ))
    }
}

/// The first of `report.html`, `report-2.html`, `report-3.html`, ... in a folder that is free, or
/// that is a report on this record already: nobody asked for that name, so a report on anything
/// else stays.
///
/// # Errors
/// Where the folder cannot be written to.
pub fn free_report(folder: &Path, record: &str) -> Result<Output, Error> {
    let mut number = 1;
    loop {
        let name = match number {
            1 => "report.html".to_string(),
            n => format!("report-{n}.html"),
        };
        let path = folder.join(name);
        let free = match standing(Kind::Report, &path) {
            Standing::Nothing => true,
            Standing::Ours => is_empty_or_shows(record, &path),
            Standing::Folder | Standing::NotOurs | Standing::LeadsNowhere => false,
        };
        if free {
            return Ok(plan(&[(Kind::Report, &path)], &[])?.remove(0));
        }
        number += 1;
    }
}

/// The first of `STEM.csv`, `STEM-2.csv`, ... in a folder that is free: nothing in a record says who wrote it.
pub(crate) fn free_record(folder: &Path, stem: &str) -> PathBuf {
    let first = PathBuf::from(format!("{stem}.csv"));
    let others = (2_u64..).map(|number| PathBuf::from(format!("{stem}-{number}.csv")));
    let mut names = std::iter::once(first.clone()).chain(others);
    let free = names.find(|name| fs::symlink_metadata(folder.join(name)).is_err());
    free.unwrap_or(first)
}

/// A report on this record, as its data name it.
fn is_empty_or_shows(record: &str, path: &Path) -> bool {
    let name = format!("\"{record}\"");
    fs::read_to_string(path).is_ok_and(|page| page.is_empty() || page.contains(&name))
}

/// What stands where a result is to go.
#[derive(Debug, PartialEq, Eq)]
enum Standing {
    Nothing,
    Ours,
    Folder,
    NotOurs,
    LeadsNowhere,
}

fn is_missing(path: &Path) -> bool {
    fs::symlink_metadata(path).is_err()
}

fn standing(kind: Kind, path: &Path) -> Standing {
    if atomic::leads_nowhere(path) {
        return Standing::LeadsNowhere;
    }
    let Ok(metadata) = fs::metadata(path) else {
        return Standing::Nothing;
    };
    if metadata.is_dir() {
        Standing::Folder
    } else if metadata.is_file() && (metadata.len() == 0 || is_ours(kind, path)) {
        // An empty file has nothing to lose.
        Standing::Ours
    } else {
        Standing::NotOurs
    }
}

/// ctid wrote it: a page that begins as its pages do, JSON with the mark, or the header of a shape with all its columns.
fn is_ours(kind: Kind, path: &Path) -> bool {
    let Ok(file) = fs::File::open(path) else {
        return false;
    };
    match kind {
        // Nothing in a record says who wrote it, and a text may have been changed by hand since.
        Kind::Record | Kind::Model => false,
        Kind::Report => {
            let mut head = Vec::new();
            let read = file.take(HEAD).read_to_end(&mut head);
            read.is_ok() && head.starts_with(report::head().as_bytes())
        }
        Kind::Unknown => {
            let mut head = Vec::new();
            let read = file.take(HEAD).read_to_end(&mut head);
            read.is_ok() && term_file::is_own(&String::from_utf8_lossy(&head))
        }
        Kind::Json => {
            // As a stream: it may be of any size.
            let mark = serde_json::from_reader::<_, Mark>(BufReader::new(file));
            mark.is_ok_and(|mark| mark.written_by == WRITTEN_BY)
        }
    }
}

fn check(kind: Kind, path: &Path) -> Result<Standing, Error> {
    let standing = standing(kind, path);
    match standing {
        Standing::Folder => {
            return Err(Error::file(
                path,
                "it is a folder; give the name of a file in it",
            ));
        }
        Standing::NotOurs => {
            // These do not say who wrote them.
            let why = match kind {
                Kind::Record | Kind::Model => {
                    "it is there already; choose another name or delete it"
                }
                _ => {
                    "it is there already, and ctid did not write it; choose another name or delete it"
                }
            };
            return Err(Error::file(path, why));
        }
        Standing::LeadsNowhere => {
            return Err(Error::file(
                path,
                "it is a link to a file that is not there; give the name of that file, or delete the link",
            ));
        }
        Standing::Nothing | Standing::Ours => {}
    }
    let folder = atomic::folder(path);
    if !folder.is_dir() {
        return Err(Error::file(
            path,
            format!("there is no folder {}; make it first", folder.display()),
        ));
    }
    // A file that vanishes at once shows whether the folder takes one, before hours of computing.
    atomic::beside(path)
        .and_then(tempfile::NamedTempFile::close)
        .map_err(|error| {
            Error::file(
                path,
                format!("nothing can be written there: {error}; choose another folder"),
            )
        })?;
    Ok(standing)
}

/// Two paths lead to one file, whether it is there yet or not.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    let resolve = |path: &Path| {
        fs::canonicalize(path).ok().or_else(|| {
            let folder = fs::canonicalize(atomic::folder(path)).ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    a == b || matches!((resolve(a), resolve(b)), (Some(a), Some(b)) if a == b)
}

#[cfg(test)]
mod tests;
