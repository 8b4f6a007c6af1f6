//! Why a log could not be read.

use std::path::PathBuf;

use crate::{place::Place, warning::Refusal};

/// A failure to read a log; its text names the file, the place, what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum LogError {
    /// The file is not there or not readable.
    #[error("{path}: cannot be read ({found}); expected a readable file; check the path and its permissions")]
    Unreadable { path: PathBuf, found: String },
    /// Neither MCAP nor a bag.
    #[error(
        "{path}: found a file that begins with `{found}`, expected MCAP, a ROS 2 bag in SQLite or a ROS 1 bag of format 2.0; give the log, or convert it to MCAP"
    )]
    Container { path: PathBuf, found: String },
    /// The metadata of a folder that do not say its files.
    #[error(
        "{path}: found metadata that cannot be understood ({found}), expected those of `ros2 bag record` with relative_file_paths; write them again by `ros2 bag reindex`, or give one of the folder's files"
    )]
    Metadata { path: PathBuf, found: String },
    /// A file that is compressed as a whole.
    #[error(
        "{path}: found a file that is compressed as a whole, expected one whose messages or chunks are; decompress it with `zstd -d {path}`, and give that file"
    )]
    Packed { path: PathBuf },
    /// A bag whose chunks are encrypted.
    #[error("{path}: found a bag encrypted by `{found}`, expected a plain one; decrypt it first")]
    Encrypted { path: PathBuf, found: String },
    /// A database that SQLite does not read.
    #[error(
        "{path}: found a database that cannot be read ({found}), expected an intact one; copy it again with the files of its name that end in -wal and -journal, or recover it with `sqlite3 {path} .recover | sqlite3 recovered.db3`"
    )]
    Database { path: PathBuf, found: String },
    /// A database that is no bag.
    #[error(
        "{path}: found a database without the table `{missing}` of a ROS 2 bag, expected one with `topics` and `messages`; give the bag's .db3 file"
    )]
    NotABag { path: PathBuf, missing: &'static str },
    /// Bytes that are not what the format says.
    #[error("{path}, {place}: found {found}, expected {expected}; copy or record the file again")]
    Damaged { path: PathBuf, place: Place, found: String, expected: &'static str },
    /// A chunk by a method that is not known.
    #[error(
        "{path}, byte {offset}: found a chunk compressed by `{found}`, expected none, lz4, zstd (of MCAP) or bz2 (of a bag); compress it so"
    )]
    Compression { path: PathBuf, offset: u64, found: String },
    /// A record or a chunk that takes more memory than allowed.
    #[error(
        "{path}, {place}: found a record of {found} bytes, expected at most {limit}; raise the limit if the file is whole"
    )]
    TooLarge { path: PathBuf, place: Place, found: u64, limit: u64 },
    /// The numbers of the topics take more memory than allowed.
    #[error(
        "{path}, topic `{topic}`: found messages whose numbers take more than {limit} bytes, expected at most that; split the log, or raise the limit"
    )]
    TooMany { path: PathBuf, topic: String, limit: u64 },
    /// A topic that the log has not.
    #[error("{path}: found no topic `{topic}`, expected one of {}; write it exactly so", listed(.there))]
    NoTopic { path: PathBuf, topic: String, there: Vec<String> },
    /// A topic whose messages are not read.
    #[error("{path}, topic `{topic}`: {why}")]
    Topic { path: PathBuf, topic: String, why: Refusal },
    /// A message that is not what its definition says.
    #[error(
        "{path}, topic `{topic}`, its message {number}, {place}: found {found}, expected {expected}; record it again, or leave the topic out"
    )]
    Message { path: PathBuf, topic: String, number: u64, place: Place, found: Box<str>, expected: Box<str> },
    /// Stamps that run back in the order of recording, by more than messages overtake each other.
    #[error(
        "{path}, topic `{topic}`, {place}: found the stamp {found_ns} ns after {before_ns} ns, expected stamps that increase; split the log where the clock was reset"
    )]
    StampOrder { path: PathBuf, topic: String, place: Place, found_ns: i64, before_ns: i64 },
    /// Two messages of one stamp that say different things.
    #[error(
        "{path}, topic `{topic}`, {place}: found the stamp {found_ns} ns twice with different numbers, expected each stamp once; have the driver stamp each sample, or record one publisher alone"
    )]
    StampTwice { path: PathBuf, topic: String, place: Place, found_ns: i64 },
}

fn listed(there: &[String]) -> String {
    match there {
        [] => "those of the log, which has none".to_owned(),
        names => names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
    }
}
