//! What stops nothing: remarks about a log, and why some of its topics are not read.

use std::path::Path;

/// Something noticed while reading a log.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum LogWarning {
    /// The file ends before it should.
    #[error(
        "the file is cut at byte {offset}; what is whole before was read; copy it again, or close the recorder before copying"
    )]
    Truncated { offset: u64 },
    /// Something noticed in one of a log's files.
    #[error("{file}: {warning}")]
    InFile { file: String, warning: Box<LogWarning> },
    /// A bag that was not closed.
    #[error("the bag has no index, as one that was not closed; it was read from its beginning")]
    NoIndex,
    /// A log without the definition of a topic's messages.
    #[error(
        "topic `{topic}`: the log carries no definition of its messages; they were read as the usual {type_name}"
    )]
    NoDefinition { topic: String, type_name: String },
    /// No message of a topic has a stamp.
    #[error(
        "topic `{topic}`: no message has a stamp; the times of recording were taken, which jitter; have the driver stamp its messages"
    )]
    NoStamps { topic: String },
    /// Some messages have no stamp.
    #[error("topic `{topic}`: {count} messages without a stamp were left out")]
    StampsMissing { topic: String, count: u64 },
    /// Messages that are not in the order of their stamps.
    #[error("topic `{topic}`: {count} messages came after a later one; they were sorted by their stamps")]
    Reordered { topic: String, count: u64 },
    /// The same message several times.
    #[error("topic `{topic}`: {count} messages that repeat another one were left out")]
    Repeated { topic: String, count: u64 },
    /// The frame changes within a topic.
    #[error(
        "topic `{topic}`: the frame changes from `{first}` to `{other}`; all messages were taken for ones in the first"
    )]
    FrameChanges { topic: String, first: String, other: String },
}

impl LogWarning {
    /// The same of one of several files; what is said of a topic is said once of all of them.
    pub(crate) fn in_file(self, file: &Path) -> Self {
        match self {
            Self::Truncated { .. } | Self::NoIndex => {
                let file = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                Self::InFile { file, warning: Box::new(self) }
            }
            of_topic => of_topic,
        }
    }
}

/// Why the messages of a topic are not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum Refusal {
    /// Another type of message.
    #[error(
        "found messages of the type `{found}`, expected sensor_msgs/Imu, MagneticField or Temperature, geometry_msgs/PoseStamped or PoseWithCovarianceStamped, or nav_msgs/Odometry; choose another topic"
    )]
    Type { found: String },
    /// Another encoding.
    #[error("found the encoding `{found}`, expected cdr or ros1; convert the log, or choose another topic")]
    Encoding { found: String },
    /// A definition in another language.
    #[error(
        "found a definition in `{found}`, expected ros2msg or ros1msg; record it with the package's .msg files installed"
    )]
    Language { found: String },
    /// Another definition under the same name.
    #[error(
        "found another definition of {type_name}: {found} where {expected} is expected; convert the messages to the usual definition"
    )]
    Definition { type_name: String, found: String, expected: String },
    /// Another definition by its sum.
    #[error(
        "found another definition of {type_name}, whose MD5 is {found}, expected {expected}; convert the messages to the usual definition"
    )]
    Sum { type_name: String, found: String, expected: &'static str },
}
