//! Writes a file whole or not at all: beside it under another name first, then renamed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::Error;

/// A lock is held for some milliseconds: so often and after such a pause it is asked for again.
const TRIES: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// Puts `content` where `path` says; an existing file keeps its permissions, a link stays a link.
pub(crate) fn write(path: &Path, content: &[u8]) -> Result<(), Error> {
    write_if(path, content, || true).map(|_| ())
}

/// The same, but only where `still` holds at the last moment before; whether it did.
pub(crate) fn write_if(
    path: &Path,
    content: &[u8],
    still: impl FnOnce() -> bool,
) -> Result<bool, Error> {
    replace(path, content, still).map_err(|error| {
        Error::file(
            path,
            format!(
                "cannot be written: {error}; nothing was changed; check the folder's permissions and the free space"
            ),
        )
    })
}

/// Keeps other `ctid` programs from changing files of the folder in which `path` lies, until it is dropped. Where the system
/// cannot lock a folder, or somebody holds the lock for long, there is none.
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
    // A file that is not there yet has no canonical name, and no link to keep.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let mut file = beside(&target)?;
    file.write_all(content)?;
    if let Ok(metadata) = fs::metadata(&target) {
        if metadata.permissions().readonly() {
            return Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                "it is write-protected",
            ));
        }
        fs::set_permissions(file.path(), metadata.permissions())?;
    }
    file.as_file().sync_all()?;
    if !still() {
        return Ok(false);
    }
    file.persist(&target)?;
    Ok(true)
}

/// A file in the same folder that vanishes unless it is renamed.
pub(crate) fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".ctid-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file: the umask takes its part away.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder(path))
}

/// The folder that holds a path.
pub(crate) fn folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}
