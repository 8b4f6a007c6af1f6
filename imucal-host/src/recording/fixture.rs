//! Recordings in a temporary directory, for the tests of this module.

use std::{fs, path::PathBuf};

use tempfile::TempDir;

use super::{Recording, Warning};

/// A manifest with nothing but its format.
pub(crate) const BARE: &str = "format = \"imucal-recording/1\"\n";

/// A directory with the recording `run`, gone when dropped.
pub(crate) struct Fixture {
    pub(crate) folder: TempDir,
    pub(crate) path: PathBuf,
}

impl Fixture {
    /// Writes `run.toml` with the format and `sections`, and the samples under the given name.
    pub(crate) fn new(name: &str, sections: &str, samples: impl AsRef<[u8]>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(folder.path().join("run.toml"), format!("{BARE}{sections}")).unwrap();
        fs::write(&path, samples).unwrap();
        Self { folder, path }
    }

    pub(crate) fn read(&self) -> Recording {
        Recording::read(&self.path).unwrap()
    }

    /// The text of the error that reading ends in.
    pub(crate) fn error(&self) -> String {
        Recording::read(&self.path).unwrap_err().to_string()
    }

    /// The texts of the warnings of a reading, but for the units that most of these recordings leave out.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let stated = |warning: &&Warning| !matches!(warning, Warning::UnitsAssumed { .. });
        self.read().warnings.iter().filter(stated).map(ToString::to_string).collect()
    }
}

/// Reads plain CSV without manifest sections.
pub(crate) fn csv(samples: impl AsRef<[u8]>) -> Fixture {
    Fixture::new("run.csv", "", samples)
}

/// Asserts that a message holds all of the parts.
pub(crate) fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}
