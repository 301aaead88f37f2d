//! `--json` and `--report`: checked before the computation, written at the end, completely or not at all.

use std::fs;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use missing_effect::Diagnosis;
use serde::{Deserialize, Serialize};

use crate::{Error, atomic, report, sentences, term_file};
use linear_identification::{Identification, side_by_side::SideBySide};

/// Number of bytes of an existing page that are searched for the mark.
const HEAD: u64 = 4096;

/// Name of the program in the first key of a file of results.
const WRITTEN_BY: &str = "ctid";

/// Results in the written form.
#[derive(Serialize)]
struct Marked<'a, T> {
    written_by: &'static str,
    #[serde(flatten)]
    found: Written<'a, T>,
}

/// A result with its findings in sentences, as both are written.
#[derive(Debug, Serialize)]
pub struct Written<'a, T> {
    #[serde(flatten)]
    found: &'a T,
    #[serde(skip_serializing_if = "Option::is_none")]
    sentences: Option<Vec<String>>,
}

impl<'a, T: Found> Written<'a, T> {
    /// A result with its findings.
    pub fn of(found: &'a T) -> Self {
        Self {
            found,
            sentences: found.sentences(),
        }
    }
}

/// Mark that identifies JSON files of ctid.
#[derive(Deserialize)]
struct Mark {
    written_by: String,
    #[serde(rename = "schema")]
    _schema: u32,
}

/// Kind of a file that the program writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The result as JSON.
    Json,
    /// The result as a page.
    Report,
    /// A record as CSV; no file is written without a record.
    Record,
    /// The unexplained error as CSV; no file is written without it.
    Unknown,
    /// A model's text.
    Model,
}

/// Result of a command, written as JSON with `schema` and a mark that identifies files of ctid, or as a page.
pub trait Found: Serialize {
    /// The complete page, if there is one.
    fn page(&self) -> String {
        String::new()
    }

    /// The findings in sentences, if they are written beside the values.
    fn sentences(&self) -> Option<Vec<String>> {
        None
    }

    /// The record as CSV, if there is one.
    fn record(&self) -> Option<String> {
        None
    }

    /// The model's text, if there is one.
    fn model(&self) -> Option<String> {
        None
    }

    /// The unexplained error as CSV, if there is one.
    fn unknown(&self) -> Option<String> {
        None
    }
}

impl Found for Diagnosis {
    fn page(&self) -> String {
        report::html(self)
    }

    fn sentences(&self) -> Option<Vec<String>> {
        Some(sentences::of_diagnosis(self))
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
    /// A file of ctid, or an empty file, was there when the command began.
    replaces: bool,
}

impl Found for SideBySide {
    fn page(&self) -> String {
        report::side_by_side(self)
    }

    fn sentences(&self) -> Option<Vec<String>> {
        Some(sentences::of_side_by_side(self))
    }
}

impl Found for Identification {
    fn page(&self) -> String {
        report::identification(self)
    }

    fn sentences(&self) -> Option<Vec<String>> {
        Some(sentences::of_identification(self))
    }
}

/// Checks the files of results: not an input, not the same file twice, not over a file of another program, and in an existing writable
/// folder.
///
/// # Errors
/// One line that names the file and the correction; nothing has been written.
pub fn plan(wanted: &[(Kind, &Path)], inputs: &[&Path]) -> Result<Vec<Output>, Error> {
    let mut outputs = Vec::with_capacity(wanted.len());
    for (index, &(kind, path)) in wanted.iter().enumerate() {
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
    /// Kind of the file.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Path of the file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the result; returns whether there was a result to write.
    ///
    /// # Errors
    /// If the file cannot be written, or has changed since the command began; it is not overwritten then.
    pub fn write(&self, found: &impl Found) -> Result<bool, Error> {
        let content = match self.kind {
            Kind::Json => {
                let marked = Marked {
                    written_by: WRITTEN_BY,
                    found: Written::of(found),
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
            "another program has written it while this command ran, so it was not overwritten; choose another name and run it again",
        ))
    }
}

/// The first free name of `report.html`, `report-2.html`, `report-3.html`, ... in a folder, or the name of an earlier report on this
/// record: the user did not choose this name, so other reports are not overwritten.
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

/// The first free name of `STEM.csv`, `STEM-2.csv`, ... in a folder: a record does not contain its author, so it is never overwritten.
pub(crate) fn free_record(folder: &Path, stem: &str) -> PathBuf {
    let first = PathBuf::from(format!("{stem}.csv"));
    let others = (2_u64..).map(|number| PathBuf::from(format!("{stem}-{number}.csv")));
    let mut names = std::iter::once(first.clone()).chain(others);
    let free = names.find(|name| fs::symlink_metadata(folder.join(name)).is_err());
    free.unwrap_or(first)
}

/// A report on this record, identified by its data.
fn is_empty_or_shows(record: &str, path: &Path) -> bool {
    let name = format!("\"{record}\"");
    fs::read_to_string(path).is_ok_and(|page| page.is_empty() || page.contains(&name))
}

/// Kind of the file that exists at the place of a result.
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
        // An empty file may be overwritten.
        Standing::Ours
    } else {
        Standing::NotOurs
    }
}

/// A file of ctid: a page with the beginning of its pages, JSON with the mark, or a shape with all columns in the header.
fn is_ours(kind: Kind, path: &Path) -> bool {
    let Ok(file) = fs::File::open(path) else {
        return false;
    };
    match kind {
        // A CSV record does not show which program wrote it, and a model file may have been edited by hand.
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
            // Read as a stream, because the file may be large.
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
            // Files of these kinds contain no mark.
            let why = match kind {
                Kind::Record | Kind::Model => {
                    "the file exists already; choose another name or delete it"
                }
                _ => {
                    "the file exists already, and ctid did not write it; choose another name or delete it"
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
    // A temporary file shows whether the folder is writable, before hours of computing.
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

/// Whether two paths lead to the same file, existing or not.
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
