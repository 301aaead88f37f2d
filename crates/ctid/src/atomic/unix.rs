//! Metadata of a file: owner, group, permissions, extended attributes, hard links.

use std::fs::{File, Metadata, Permissions};
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};

/// Names of the file.
pub(super) fn links(metadata: &Metadata) -> u64 {
    metadata.nlink()
}

/// Copies the metadata of a file to another file.
///
/// # Errors
/// Where the user may not, as with the owner of a file of somebody else.
pub(super) fn copy(old: &File, metadata: &Metadata, new: &File) -> io::Result<()> {
    let made = new.metadata()?;
    if (made.uid(), made.gid()) != (metadata.uid(), metadata.gid()) {
        fchown(new, Some(metadata.uid()), Some(metadata.gid()))?;
    }
    // Set the permissions after the owner, because a change of owner clears some of them, and before the attributes, which may contain an
    // access control list.
    new.set_permissions(metadata.permissions())?;
    copy_extended(old, new)
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn copy_extended(old: &File, new: &File) -> io::Result<()> {
    use rustix::fs::{XattrFlags, fgetxattr, flistxattr, fsetxattr};
    use rustix::io::Errno;

    /// Limit of Linux for all attribute names, and for one value \[bytes\].
    const LARGEST: usize = 1 << 16;

    let mut names = vec![0; LARGEST];
    let length = match flistxattr(old, names.as_mut_slice()) {
        // The file system has no extended attributes.
        Err(Errno::NOTSUP) => return Ok(()),
        length => length?,
    };
    let mut value = vec![0; LARGEST];
    let names = names[..length].split(|&byte| byte == 0);
    for name in names.filter(|name| !name.is_empty()) {
        let length = fgetxattr(old, name, value.as_mut_slice())?;
        fsetxattr(new, name, &value[..length], XattrFlags::empty())?;
    }
    Ok(())
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn copy_extended(_: &File, _: &File) -> io::Result<()> {
    Ok(())
}

/// Sets the permissions of the new file, which the umask reduces.
pub(super) fn set_mode(builder: &mut tempfile::Builder<'_, '_>, mode: u32) {
    builder.permissions(Permissions::from_mode(mode));
}
