//! Limits on the size of a file: an endless device, or a file that is no record, is rejected before it fills the memory.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use crate::{Error, ReadError};

/// The largest record \[bytes\].
pub const LARGEST_RECORD: u64 = 256 * 1024 * 1024;
/// The longest line of a record or a stream, without its end \[bytes\].
pub const LONGEST_LINE: usize = 64 * 1024;
/// The most columns of a record or a stream.
pub const MOST_COLUMNS: usize = 4096;

/// Reads a file or a pipe of at most `largest` bytes.
///
/// # Errors
/// [`ReadError::CannotOpen`], [`ReadError::Folder`], [`ReadError::Device`], [`ReadError::FileTooLarge`].
pub fn read_file(path: &Path, largest: u64) -> Result<Vec<u8>, Error> {
    let file = || path.display().to_string();
    let cannot_open = |source| {
        Error::Read(ReadError::CannotOpen {
            file: file(),
            source,
        })
    };
    let metadata = fs::metadata(path).map_err(cannot_open)?;
    if metadata.is_dir() {
        return Err(Error::Read(ReadError::Folder { file: file() }));
    }
    if is_device(metadata.file_type()) {
        return Err(Error::Read(ReadError::Device { file: file() }));
    }
    let too_large = || {
        Error::Read(ReadError::FileTooLarge {
            file: file(),
            largest,
        })
    };
    if metadata.len() > largest {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|opened| opened.take(largest + 1).read_to_end(&mut bytes))
        .map_err(cannot_open)?;
    if bytes.len() as u64 > largest {
        return Err(too_large());
    }
    Ok(bytes)
}

#[cfg(unix)]
fn is_device(kind: fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: fs::FileType) -> bool {
    false
}
