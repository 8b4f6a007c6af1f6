//! File formats of the samples, known by the name's ending; a folder that the recorder of ROS 2 made is a log.

use std::path::Path;

#[cfg(feature = "logs")]
pub(crate) use imucal_logs::is_bag_folder;

/// How the names of files end that hold columns of samples.
pub(crate) const COLUMNS: [&str; 4] = [".csv.gz", ".csv", ".parquet", ".mat"];
/// How the names of robots' logs end: MCAP, ROS 1 bags and ROS 2 bags in SQLite.
pub(crate) const LOGS: [&str; 3] = [".mcap", ".bag", ".db3"];

/// Without logs no folder is one: its files are named.
#[cfg(not(feature = "logs"))]
pub(crate) fn is_bag_folder(_: &Path) -> bool {
    false
}

/// Format of a samples file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Csv,
    CsvGz,
    Parquet,
    /// What MATLAB saves.
    Mat,
    /// A robot's log.
    Log,
}

/// Whether a name is that of an MCAP file.
pub(crate) fn is_mcap(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

impl Format {
    /// Format by the ending, case aside; else the ending found.
    pub(crate) fn of(path: &Path) -> Result<Self, String> {
        if is_bag_folder(path) {
            return Ok(Self::Log);
        }
        let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
        if name.ends_with(".csv.gz") {
            Ok(Self::CsvGz)
        } else if name.ends_with(".csv") {
            Ok(Self::Csv)
        } else if name.ends_with(".parquet") {
            Ok(Self::Parquet)
        } else if name.ends_with(".mat") {
            Ok(Self::Mat)
        } else if LOGS.iter().any(|ending| name.ends_with(ending)) {
            Ok(Self::Log)
        } else {
            Err(name.rfind('.').map_or(String::new(), |at| name[at..].to_owned()))
        }
    }
}
