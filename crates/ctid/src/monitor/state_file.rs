//! The saved state: written completely or not at all, and no other file is overwritten. A checksum of its numbers detects damage.

use std::fs;
use std::io::{self, BufReader};
use std::path::Path;

use ::monitor::State;
use ct_signals::quoted;
use serde::{Deserialize, Serialize};

use crate::{Error, atomic, output};

/// A larger file is not a state of this program \[bytes\].
const LARGEST: u64 = 64 * 1024 * 1024;

#[derive(Serialize)]
struct Written<'a> {
    written_by: &'a str,
    checksum: u32,
    state: &'a State,
}

#[derive(Deserialize)]
struct Read {
    written_by: String,
    checksum: u32,
    state: State,
}

/// Fields that a state of every version has.
#[derive(Deserialize)]
struct Head {
    written_by: String,
}

const WRITTEN_BY: &str = "ctid monitor";

/// Reads the state; `None` if the file does not exist. Checks that the folder is writable.
pub(super) fn read(path: &Path, model: &Path) -> Result<Option<State>, Error> {
    if output::same_file(path, model) {
        return Err(Error::file(
            path,
            "it is the model file; give the state a name of its own",
        ));
    }
    let not_ours = |what: String| {
        Error::file(
            path,
            format!(
                "{what}; use another state file with --state FILE, or delete this one to start again"
            ),
        )
    };
    let metadata = match fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = atomic::folder(path);
            atomic::beside(path)
                .and_then(tempfile::NamedTempFile::close)
                .map_err(|error| {
                    Error::file(
                        path,
                        format!(
                            "nothing can be written in {}: {error}; choose another folder",
                            folder.display()
                        ),
                    )
                })?;
            return Ok(None);
        }
        Err(error) => return Err(not_ours(format!("it cannot be read: {error}"))),
        Ok(metadata) => metadata,
    };
    if !metadata.is_file() {
        return Err(not_ours("it is not a file".to_string()));
    }
    if metadata.len() > LARGEST {
        return Err(not_ours(format!(
            "it has {} bytes, and a state at most {LARGEST}",
            metadata.len()
        )));
    }
    let text = fs::read_to_string(path)
        .map_err(|error| not_ours(format!("it cannot be read: {error}")))?;
    let read: Read = serde_json::from_str(&text).map_err(|error| {
        let head = serde_json::from_str::<Head>(&text);
        // The message may quote content of the file.
        let why = quoted(&error.to_string());
        not_ours(if head.is_ok_and(|head| head.written_by == WRITTEN_BY) {
            format!("another version of `ctid monitor` wrote it, or it is damaged ({why})")
        } else {
            format!("it is not a state file of `ctid monitor` ({why})")
        })
    })?;
    if read.written_by != WRITTEN_BY {
        return Err(not_ours(
            "it is not a state file of `ctid monitor`".to_string(),
        ));
    }
    if read.checksum != checksum(&read.state).map_err(|error| not_ours(error.to_string()))? {
        return Err(not_ours(
            "it is damaged: its numbers do not agree with its checksum".to_string(),
        ));
    }
    Ok(Some(read.state))
}

/// CRC-32 of the state as written: numbers are read and written again exactly.
fn checksum(state: &State) -> serde_json::Result<u32> {
    Ok(crc32fast::hash(&serde_json::to_vec(state)?))
}

/// Whether the file is a state of this program, in any version.
fn is_ours(path: &Path) -> bool {
    let Ok(file) = fs::File::open(path) else {
        return false;
    };
    let head = serde_json::from_reader::<_, Head>(BufReader::new(file));
    head.is_ok_and(|head| head.written_by == WRITTEN_BY)
}

/// Saves a state to a new file or over an earlier state of this program. A file that another program wrote since the start is not
/// overwritten.
pub(super) fn write(path: &Path, state: &State) -> Result<(), Error> {
    let text = checksum(state)
        .and_then(|checksum| {
            serde_json::to_string(&Written {
                written_by: WRITTEN_BY,
                checksum,
                state,
            })
        })
        .map_err(|error| Error::file(path, format!("the state cannot be written: {error}")))?;
    let written = if fs::symlink_metadata(path).is_ok() {
        atomic::write_if(path, text.as_bytes(), || is_ours(path))?
    } else {
        atomic::create(path, text.as_bytes())?
    };
    if written {
        return Ok(());
    }
    Err(Error::file(
        path,
        "it is no longer a state file of `ctid monitor`, or cannot be read, so the state was not saved; move it away",
    ))
}
