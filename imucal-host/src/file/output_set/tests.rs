use std::ffi::OsString;
#[cfg(unix)]
use std::os::unix::fs::{PermissionsExt, symlink};

use super::*;

fn names(folder: &Path) -> Vec<OsString> {
    let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    names
}

/// A folder with `a` and `b`, and a set that is to write `new` to both.
fn two_under_way() -> (tempfile::TempDir, OutputSet) {
    let folder = tempfile::tempdir().unwrap();
    let mut set = OutputSet::default();
    for name in ["a", "b"] {
        fs::write(folder.path().join(name), format!("old {name}")).unwrap();
        set.add(&folder.path().join(name), b"new").unwrap();
    }
    (folder, set)
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_committed_set_replaces_its_targets_and_leaves_nothing_else() {
    let (folder, set) = two_under_way();
    set.commit().unwrap();
    assert_eq!((text(folder.path(), "a"), text(folder.path(), "b")), ("new".into(), "new".into()));
    assert_eq!(names(folder.path()), ["a", "b"]);
}

#[test]
fn an_abandoned_set_leaves_its_targets_as_they_were() {
    let (folder, set) = two_under_way();
    assert_eq!(names(folder.path()).len(), 4);
    drop(set);
    assert_eq!(text(folder.path(), "a"), "old a");
    assert_eq!(names(folder.path()), ["a", "b"]);
}

#[test]
fn a_rename_that_fails_takes_the_earlier_ones_back() {
    let (folder, mut set) = two_under_way();
    set.add(&folder.path().join("new"), b"new").unwrap();
    set.add(&folder.path().join("last"), b"new").unwrap();
    fs::create_dir(folder.path().join("last")).unwrap();
    let message = set.commit().unwrap_err().to_string();
    assert!(
        message.contains("last: cannot be written") && message.contains("nothing was changed"),
        "{message}"
    );
    assert_eq!((text(folder.path(), "a"), text(folder.path(), "b")), ("old a".into(), "old b".into()));
    assert_eq!(names(folder.path()), ["a", "b", "last"]);
}

#[test]
fn a_stream_that_fails_leaves_the_files_of_its_set_alone() {
    let (folder, mut set) = two_under_way();
    if !Path::new("/dev/full").exists() {
        return;
    }
    set.add(Path::new("/dev/full"), b"new").unwrap();
    let message = set.commit().unwrap_err().to_string();
    assert!(message.contains("/dev/full") && message.contains("no file was changed"), "{message}");
    assert_eq!(text(folder.path(), "a"), "old a");
}

#[test]
fn a_file_that_came_meanwhile_is_spared_and_an_empty_one_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a");
    for (there, done) in [("another's", false), ("", true)] {
        let mut set = OutputSet::sparing_all_but(Vec::new());
        set.add(&target, b"new").unwrap();
        fs::write(&target, there).unwrap();
        assert_eq!(set.commit().is_ok(), done);
        assert_eq!(text(folder.path(), "a"), if done { "new" } else { there });
    }
}

#[test]
fn missing_folders_and_nameless_paths_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("none/a"), PathBuf::from("/"), folder.path().join(".."), PathBuf::new()] {
        assert!(OutputSet::default().create(&path).is_err(), "{path:?}");
    }
}

#[cfg(unix)]
#[test]
fn links_stay_and_what_they_lead_to_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("inner")).unwrap();
    fs::write(at("inner/a"), "old").unwrap();
    symlink("inner/a", at("to-file")).unwrap();
    symlink(at("to-file"), at("to-link")).unwrap();
    symlink("inner/none", at("to-nothing")).unwrap();
    symlink("circle", at("circle")).unwrap();
    for (link, real) in [("to-file", "inner/a"), ("to-link", "inner/a"), ("to-nothing", "inner/none")] {
        let mut set = OutputSet::default();
        set.add(&at(link), link.as_bytes()).unwrap();
        set.commit().unwrap();
        assert!(at(link).is_symlink() && !at(real).is_symlink());
        assert_eq!(text(folder.path(), real), link);
    }
    assert!(OutputSet::default().create(&at("circle")).is_err());
}

#[cfg(unix)]
#[test]
fn modes_are_kept_and_read_only_files_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a");
    fs::write(&target, "old").unwrap();
    for mode in [0o600, 0o664, 0o755] {
        fs::set_permissions(&target, fs::Permissions::from_mode(mode)).unwrap();
        let mut set = OutputSet::default();
        set.add(&target, b"new").unwrap();
        set.commit().unwrap();
        assert_eq!(fs::metadata(&target).unwrap().permissions().mode() & 0o777, mode);
    }
    fs::set_permissions(&target, fs::Permissions::from_mode(0o444)).unwrap();
    let message = OutputSet::default().create(&target).unwrap_err().to_string();
    assert!(message.contains("read-only") && message.contains("make it writable"), "{message}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_is_written_through_and_stays() {
    use std::os::unix::fs::FileTypeExt;
    let mut set = OutputSet::default();
    set.add(Path::new("/dev/null"), b"new").unwrap();
    set.commit().unwrap();
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}
