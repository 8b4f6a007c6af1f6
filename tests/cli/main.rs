//! The program's contract, which scripts rely on: exit status, messages, outputs.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use imucal_tests::program::{self, Ended};
use imucal_tests::simulated;
use tempfile::TempDir;

mod applying;
mod batching;
mod capturing;
mod comparing;
mod end_to_end;
mod estimating_noise;
mod exit_status;
mod exporting;
#[cfg(unix)]
mod guides;
mod importing;
#[cfg(unix)]
mod interrupting;
mod json_contract;
mod logs;
mod mapping;
mod matlab;
mod outputs;
mod overwriting;
mod pages;
mod printing;
mod simulating;
mod terminal;
mod trials;
mod watching;

/// Runs the program with these arguments.
fn imucal<A: AsRef<OsStr>>(arguments: &[A]) -> Ended {
    program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &[], arguments)
}

/// Runs it on a day that stands still.
fn imucal_on_a_day<A: AsRef<OsStr>>(arguments: &[A]) -> Ended {
    let day = [("SOURCE_DATE_EPOCH", "1790000000")];
    program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &day, arguments)
}

/// A folder of a test, gone when dropped.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("there is room for a folder"))
    }

    /// With the small recording, `small.csv`.
    fn with_recording() -> Self {
        let folder = Self::new();
        simulated::write_small(folder.0.path());
        folder
    }

    /// With the small recording and its calibration, `cal.toml` and `cal.bin`.
    fn with_calibration() -> Self {
        let folder = Self::with_recording();
        folder.run("calibrate small.csv --out cal.toml --record cal.bin").with(0);
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("the folder takes files");
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("a text file")
    }

    /// Rewrites a text file, which must change by it.
    fn replace(&self, name: &str, from: &str, to: &str) {
        let before = self.text(name);
        assert!(before.contains(from), "{name} holds no {from}: {before}");
        self.write(name, before.replace(from, to));
    }

    /// Arguments between blanks; those with a dot name files of this folder.
    fn arguments(&self, line: &str) -> Vec<PathBuf> {
        let in_folder = |word: &str| if word.contains('.') { self.path(word) } else { word.into() };
        line.split_whitespace().map(in_folder).collect()
    }

    fn run(&self, line: &str) -> Ended {
        imucal(&self.arguments(line))
    }

    /// Names of all files, hidden ones too, in order.
    fn names(&self) -> Vec<String> {
        names(self.0.path())
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
