//! Writes a file completely or not at all: first under a temporary name in the same folder, then renamed.

#[cfg_attr(unix, path = "atomic/unix.rs")]
#[cfg_attr(not(unix), path = "atomic/other.rs")]
mod attributes;

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::Error;

/// A lock is held for some milliseconds: number of attempts to get it, and the pause between them.
const TRIES: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// Prefix of a temporary file, which a killed run may leave behind; random letters and digits follow the prefix.
const PREFIX: &str = ".ctid-";
const SUFFIX: &str = ".part";
const LETTERS: usize = 12;

/// Puts `content` where `path` says, where `still` holds at the last moment before; whether it did. An existing file keeps its owner,
/// permissions and extended attributes, a link stays a link; a file with several hard links, or whose owner or attributes the user cannot
/// give to a new file, is written in place.
pub(crate) fn write_if(
    path: &Path,
    content: &[u8],
    still: impl FnOnce() -> bool,
) -> Result<bool, Error> {
    replace(path, content, still).map_err(|error| unwritten(path, &error))
}

/// Writes `content` into a new file; returns false if the file exists.
pub(crate) fn create(path: &Path, content: &[u8]) -> Result<bool, Error> {
    let created = fs::symlink_metadata(path).is_err();
    let created = created.then(|| new(path, content));
    match created {
        None => Ok(false),
        Some(Ok(())) => Ok(true),
        Some(Err(error)) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Some(Err(error)) => Err(unwritten(path, &error)),
    }
}

fn unwritten(path: &Path, error: &io::Error) -> Error {
    Error::file(
        path,
        format!(
            "cannot be written: {error}; nothing was changed; check the folder's permissions and the free space"
        ),
    )
}

/// A lock on the folder of `path`: until it is dropped, other `ctid` programs do not change files there. `None` if the system cannot lock a
/// folder, or another program holds the lock for too long.
pub(crate) fn lock_beside(path: &Path) -> Option<File> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = File::open(folder(&target)).ok()?;
    for _ in 0..TRIES {
        match folder.try_lock() {
            Ok(()) => return Some(folder),
            Err(TryLockError::WouldBlock) => sleep(PAUSE),
            Err(TryLockError::Error(_)) => return None,
        }
    }
    None
}

fn replace(path: &Path, content: &[u8], still: impl FnOnce() -> bool) -> io::Result<bool> {
    let target = target(path)?;
    let old = match File::open(&target) {
        Ok(old) => old,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return if still() {
                new(&target, content).map(|()| true)
            } else {
                Ok(false)
            };
        }
        Err(error) => return Err(error),
    };
    let metadata = old.metadata()?;
    if metadata.permissions().readonly() {
        return Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "it is write-protected",
        ));
    }
    // The new file is readable only for those who could read the old one.
    let mut file = beside_with(&target, 0o600)?;
    let alike = attributes::links(&metadata) == 1
        && attributes::copy(&old, &metadata, file.as_file()).is_ok();
    file.write_all(content)?;
    file.as_file().sync_all()?;
    if !still() {
        return Ok(false);
    }
    if alike {
        file.persist(&target)?;
        sync_folder(&target);
    } else {
        write_in_place(&target, content)?;
    }
    Ok(true)
}

/// Creates a file; an existing one is an error, also if it appeared at the last moment.
fn new(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = beside(path)?;
    file.write_all(content)?;
    file.as_file().sync_all()?;
    file.persist_noclobber(path)?;
    sync_folder(path);
    Ok(())
}

/// The file that a path leads to.
fn target(path: &Path) -> io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Ok(target) => Ok(target),
        Err(_) if leads_nowhere(path) => Err(io::Error::new(
            io::ErrorKind::NotFound,
            "it is a link to a file that is not there",
        )),
        // A file that does not exist yet has no canonical name.
        Err(_) => Ok(path.to_path_buf()),
    }
}

/// A link to a file that does not exist.
pub(crate) fn leads_nowhere(path: &Path) -> bool {
    let link = fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_symlink());
    link && fs::metadata(path).is_err()
}

/// The last resort: the old content is restored after an error, but a kill in between leaves a partial file.
fn write_in_place(path: &Path, content: &[u8]) -> io::Result<()> {
    let before = fs::read(path)?;
    let mut file = OpenOptions::new().write(true).open(path)?;
    let mut put = |content: &[u8]| {
        file.rewind()?;
        file.write_all(content)?;
        file.set_len(content.len() as u64)?;
        file.sync_all()
    };
    put(content).inspect_err(|_| {
        let _ = put(&before);
    })
}

/// Makes the new name durable. Some systems cannot do this for a folder; the file is in its place nevertheless.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(folder(path)) {
        let _ = folder.sync_all();
    }
}

/// A file in the same folder that is deleted unless it is renamed.
pub(crate) fn beside(path: &Path) -> io::Result<NamedTempFile> {
    // Permissions of a new file, reduced by the umask.
    beside_with(path, 0o666)
}

fn beside_with(path: &Path, mode: u32) -> io::Result<NamedTempFile> {
    let folder = folder(path);
    remove_abandoned(&folder);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(LETTERS);
    attributes::set_mode(&mut builder, mode);
    for _ in 0..TRIES {
        let file = builder.tempfile_in(&folder)?;
        // Another run may have deleted it as abandoned just before it was locked.
        let taken = matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
        if !taken && file.path().exists() {
            return Ok(file);
        }
    }
    Err(io::ErrorKind::ResourceBusy.into())
}

/// Removes temporary files of killed runs from a folder: a running program holds a lock on its file.
fn remove_abandoned(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        if is_temporary(&entry.file_name()) && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            let file = File::open(entry.path());
            if file.is_ok_and(|file| file.try_lock().is_ok()) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

fn is_temporary(name: &OsStr) -> bool {
    let letters = name.to_str().and_then(|name| {
        let name = name.strip_prefix(PREFIX)?;
        name.strip_suffix(SUFFIX)
    });
    letters.is_some_and(|letters| {
        letters.len() == LETTERS && letters.bytes().all(|byte| byte.is_ascii_alphanumeric())
    })
}

/// The folder that contains a path.
pub(crate) fn folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests;
