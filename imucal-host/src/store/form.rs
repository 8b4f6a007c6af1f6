//! Which form of a calibration a file holds, by its content and not by its name.

use std::{
    fs::File,
    io::{BufReader, Read},
    path::Path,
};

use imucal_core::record::{self, DecodeError};
use serde::Deserialize;

use crate::file::Limits;

/// What the format of every version begins with.
const FAMILY: &str = "imucal-calibration/";

/// The forms in which `imucal calibrate` writes a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// For people.
    Toml,
    /// For the device.
    Record,
    /// For programs, with everything.
    Json,
}

/// What TOML and JSON of every version hold.
#[derive(Deserialize)]
pub(super) struct Head {
    #[serde(default)]
    pub(super) format: String,
}

impl Form {
    /// The form of the calibration in a file, damaged or of another version as it may be; `None` for anything else.
    #[must_use]
    pub fn of_file(path: &Path) -> Option<Self> {
        let limits = Limits::default();
        // A report has more to say than a manifest, and is read without being kept.
        let report = BufReader::new(File::open(path).ok()?.take(limits.size));
        if serde_json::from_reader::<_, Head>(report).is_ok_and(|head| head.format.starts_with(FAMILY)) {
            return Some(Self::Json);
        }
        let bytes = limits.read_small(path).ok()?;
        let head = std::str::from_utf8(&bytes).ok().and_then(|text| toml::from_str::<Head>(text).ok());
        match head {
            Some(head) => head.format.starts_with(FAMILY).then_some(Self::Toml),
            None => is_record(&bytes).then_some(Self::Record),
        }
    }
}

/// Whether bytes are a record, intact or not; too few of them are nothing.
fn is_record(bytes: &[u8]) -> bool {
    !matches!(record::decode(bytes), Err(DecodeError::BadMagic | DecodeError::Truncated { .. }))
}
