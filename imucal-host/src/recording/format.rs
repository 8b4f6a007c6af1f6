//! File formats of the samples, known by the name's ending.

use std::path::Path;

/// Format of a samples file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Csv,
    CsvGz,
    Parquet,
    /// A robot's log: MCAP or a ROS 1 bag.
    Log,
}

impl Format {
    /// Format by the ending, case aside; else the ending found.
    pub(crate) fn of(path: &Path) -> Result<Self, String> {
        let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
        if name.ends_with(".csv.gz") {
            Ok(Self::CsvGz)
        } else if name.ends_with(".csv") {
            Ok(Self::Csv)
        } else if name.ends_with(".parquet") {
            Ok(Self::Parquet)
        } else if name.ends_with(".mcap") || name.ends_with(".bag") {
            Ok(Self::Log)
        } else {
            Err(name.rfind('.').map_or(String::new(), |at| name[at..].to_owned()))
        }
    }
}
