#![allow(clippy::unwrap_used)]

use super::*;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn write(path: &Path, content: &[u8]) -> Result<(), Error> {
    write_if(path, content, || true).map(|_| ())
}

/// Temporary files of killed runs are removed by the next run; files of running programs and of other programs stay.
#[test]
fn what_a_killed_run_has_left_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("m.toml");
    let left = folder.path().join(".ctid-0123456789ab.part");
    let others = [
        ".ctid-notes",
        ".ctid-0123456789a/.part",
        ".ctid-backup.part",
    ];
    let others = others.map(|name| name.replace('/', "-"));
    fs::write(&left, "a part").unwrap();
    for name in &others {
        fs::write(folder.path().join(name), "mine").unwrap();
    }
    let living = beside(&file).unwrap();
    assert!(!left.exists());
    write(&file, b"text").unwrap();
    assert!(living.path().exists());
    drop(living);
    let mut expected = [&others[..], &["m.toml".to_string()]].concat();
    expected.sort();
    assert_eq!(names(folder.path()), expected);
}

#[test]
fn a_file_that_is_there_is_not_created() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("out.json");
    assert!(create(&file, b"first").unwrap());
    assert!(!create(&file, b"second").unwrap());
    assert_eq!(fs::read(&file).unwrap(), b"first");
    assert_eq!(names(folder.path()), ["out.json"]);
    // Also if it appears after all checks.
    let late = new(&file, b"third").unwrap_err();
    assert_eq!(late.kind(), io::ErrorKind::AlreadyExists);
    assert_eq!(fs::read(&file).unwrap(), b"first");
}

#[cfg(unix)]
mod on_unix {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, chown, symlink};

    use super::*;

    #[test]
    fn a_link_that_leads_nowhere_stays() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("link");
        symlink(folder.path().join("gone"), &link).unwrap();
        let refused = write(&link, b"text").unwrap_err().to_string();
        assert!(
            refused.contains("a link to a file that is not there"),
            "{refused}"
        );
        assert!(!create(&link, b"text").unwrap());
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(names(folder.path()), ["link"]);
    }

    #[test]
    fn all_names_of_a_file_lead_to_what_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let [file, other] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&file, "longer than what comes").unwrap();
        fs::hard_link(&file, &other).unwrap();
        write(&file, b"text").unwrap();
        assert_eq!(fs::read(&other).unwrap(), b"text");
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[test]
    fn permissions_stay() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        for mode in [0o600, 0o664] {
            fs::write(&file, "old").unwrap();
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
            write(&file, b"new").unwrap();
            assert_eq!(fs::metadata(&file).unwrap().mode() & 0o777, mode);
        }
    }

    #[test]
    fn the_owner_stays() {
        const OTHER: u32 = 65_534;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        fs::write(&file, "old").unwrap();
        if chown(&file, Some(OTHER), Some(OTHER)).is_err() {
            println!("skipped: only root can give a file away");
            return;
        }
        write(&file, b"new").unwrap();
        let metadata = fs::metadata(&file).unwrap();
        assert_eq!((metadata.uid(), metadata.gid()), (OTHER, OTHER));
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }

    #[cfg(any(target_os = "linux", target_vendor = "apple"))]
    #[test]
    fn extended_attributes_stay() {
        use rustix::fs::{XattrFlags, getxattr, setxattr};
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        fs::write(&file, "old").unwrap();
        if let Err(error) = setxattr(&file, "user.origin", b"rig 2", XattrFlags::empty()) {
            println!("skipped: no extended attributes here: {error}");
            return;
        }
        write(&file, b"new").unwrap();
        let mut value = [0; 16];
        let length = getxattr(&file, "user.origin", value.as_mut_slice()).unwrap();
        assert_eq!(&value[..length], b"rig 2");
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }
}
