//! Writing a log: MCAP of ROS 2, message by message in constant memory.

use std::{collections::BTreeMap, io};

use mcap::{Compression, WriteOptions, Writer, records::MessageHeader, write::NoSeek};

use crate::{
    definition::{MessageType, text},
    message::{Kind, encode},
};

/// A log under way. Its definitions are in it, so that nobody needs ROS to read it.
pub struct LogWriter<W: io::Write> {
    writer: Writer<NoSeek<W>>,
    topics: Vec<Written>,
}

/// A topic of a log under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicId(usize);

struct Written {
    kind: Kind,
    frame: String,
    channel: u16,
    messages: u32,
}

/// Why a message was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogWriteError {
    /// The system refuses.
    #[error(transparent)]
    System(#[from] io::Error),
    /// A stamp that no message of ROS 2 has, which counts whole seconds by 31 bits.
    #[error("found a stamp of {stamp_ns} ns, expected 0 to 2^31 s")]
    Stamp {
        /// The stamp, ns.
        stamp_ns: i64,
    },
    /// Other numbers than the topic's messages have.
    #[error("found {found} numbers for a message, expected {expected} of a topic of the log")]
    Numbers {
        /// How many there are.
        found: usize,
        /// How many a message has; none of a topic of another log.
        expected: usize,
    },
}

impl<W: io::Write> LogWriter<W> {
    /// Starts a log.
    ///
    /// # Errors
    ///
    /// [`LogWriteError::System`].
    pub fn new(out: W) -> Result<Self, LogWriteError> {
        // One thread, so that the bytes are the same on every machine.
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("imucal ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .disable_seeking(true);
        let writer = options.create(NoSeek::new(out)).map_err(io::Error::other)?;
        Ok(Self { writer, topics: Vec::new() })
    }

    /// Adds a topic of a kind's messages (of poses `geometry_msgs/PoseStamped`), with the `frame_id` of their headers.
    ///
    /// # Errors
    ///
    /// [`LogWriteError::System`].
    pub fn add(&mut self, topic: &str, kind: Kind, frame: &str) -> Result<TopicId, LogWriteError> {
        let known = MessageType::written(kind);
        let definition = text(known);
        let channel = self
            .writer
            .add_schema(&known.name_in_ros2(), "ros2msg", definition.as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new()))
            .map_err(io::Error::other)?;
        self.topics.push(Written { kind, frame: frame.to_owned(), channel, messages: 0 });
        Ok(TopicId(self.topics.len() - 1))
    }

    /// Writes a message of numbers as [`Kind::columns`] has them. Its parts that are NaN as a whole are marked as unknown. The
    /// stamp, ns, is that of its record too.
    ///
    /// # Errors
    ///
    /// [`LogWriteError`].
    pub fn write(&mut self, topic: TopicId, stamp_ns: i64, values: &[f64]) -> Result<(), LogWriteError> {
        let numbers = |expected| LogWriteError::Numbers { found: values.len(), expected };
        let topic = self.topics.get_mut(topic.0).ok_or(numbers(0))?;
        let expected = topic.kind.columns().len();
        if values.len() != expected {
            return Err(numbers(expected));
        }
        let stamp = || LogWriteError::Stamp { stamp_ns };
        let log_time = u64::try_from(stamp_ns).map_err(|_| stamp())?;
        let message = encode(topic.kind, stamp_ns, &topic.frame, values).ok_or_else(stamp)?;
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.messages,
            log_time,
            publish_time: log_time,
        };
        topic.messages = topic.messages.wrapping_add(1);
        Ok(self.writer.write_to_known_channel(&header, &message).map_err(io::Error::other)?)
    }

    /// Ends the log; without it the file has no index.
    ///
    /// # Errors
    ///
    /// [`LogWriteError::System`].
    pub fn finish(mut self) -> Result<(), LogWriteError> {
        self.writer.finish().map(|_| ()).map_err(|cause| io::Error::other(cause).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Log;

    #[test]
    fn a_log_that_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let mut log = LogWriter::new(std::fs::File::create(&path).unwrap()).unwrap();
        let imu = log.add("/imu/data_raw", Kind::Imu, "imu_link").unwrap();
        let pose = log.add("/pose", Kind::Pose, "world_ned").unwrap();
        let quiet = f64::NAN;
        let force = |k: i64| [k as f64, 0.1, 9.8, 0.0, 0.25, k as f64 / 3.0, quiet, quiet, quiet, quiet];
        // More than a chunk.
        for k in 0..5000 {
            log.write(imu, 1_700_000_000_123_456_789 + k * 1_000_001, &force(k)).unwrap();
        }
        log.write(pose, 1_700_000_000_123_456_789, &[1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5]).unwrap();
        assert!(matches!(log.write(imu, -1, &force(0)), Err(LogWriteError::Stamp { stamp_ns: -1 })));
        assert!(matches!(log.write(imu, 0, &[1.0]), Err(LogWriteError::Numbers { found: 1, expected: 10 })));
        assert!(matches!(log.write(TopicId(2), 0, &[]), Err(LogWriteError::Numbers { expected: 0, .. })));
        log.finish().unwrap();
        let log = Log::open(&path, 1 << 30).unwrap();
        let listed: Vec<_> = log
            .topics()
            .iter()
            .map(|topic| (topic.name.as_str(), topic.type_name.as_str(), topic.count))
            .collect();
        assert_eq!(
            listed,
            [("/imu/data_raw", "sensor_msgs/msg/Imu", 5000), ("/pose", "geometry_msgs/msg/PoseStamped", 1)]
        );
        let reading = log.read(&["/imu/data_raw", "/pose"]).unwrap();
        assert!(reading.warnings.is_empty(), "{:?}", reading.warnings);
        let [found, poses] = &reading.streams[..] else { panic!("two streams") };
        assert_eq!((found.stamps_ns[4999], found.stamps_ns.len()), (1_700_000_005_122_461_788, 5000));
        assert_eq!((found.row(7)[..6].to_vec(), found.frame.as_str()), (force(7)[..6].to_vec(), "imu_link"));
        assert_eq!(
            (poses.row(0), poses.frame.as_str()),
            (&[1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5][..], "world_ned")
        );
    }
}
