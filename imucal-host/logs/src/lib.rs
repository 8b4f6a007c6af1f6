//! Inertial sensors' topics of robots' logs: MCAP of ROS 2 or ROS 1, ROS 2 bags in SQLite, and ROS 1 bags (format 2.0). A folder that the
//! recorder of ROS 2 made is one log, of all of its files.
//!
//! ```text
//!  file ──► container ──► chunk ──► connection ──► message ──► order ──► Stream
//!           MCAP, bag     decom-    topic, type,   stamp and   by stamp,
//!           by records,   pressed   definition     numbers     each once
//!           SQLite by rows
//! ```
//!
//! A file is read record by record and a chunk at a time: in memory are one chunk and the numbers of the topics that are
//! asked for. A file that was cut is read as far as it goes, with a warning; of a chunk that was cut the messages that are whole.
//! A damaged one is refused, and so is a database that was cut, whose tables are in all of the file.
//!
//! | message | columns of its [`Stream`] |
//! | --- | --- |
//! | `sensor_msgs/Imu` | specific force, m/s²; rate, rad/s; attitude w, x, y, z, body → world |
//! | `sensor_msgs/MagneticField` | field, T |
//! | `sensor_msgs/Temperature` | temperature, °C |
//! | `geometry_msgs/PoseStamped`, `PoseWithCovarianceStamped`, `nav_msgs/Odometry` | position, m; attitude w, x, y, z, body → world |
//!
//! The definition that the log carries is compared with the one that is read, field by field. Numbers are as the message has
//! them. What a message says it does not know is NaN: an attitude that is no rotation (all zero), and any part whose covariance
//! begins with −1.
//!
//! Messages are decoded here, by one reader for both encodings: ROS 1 and CDR differ in the alignment, the end of a text and
//! the header, and a crate for each would be two ways to say what six messages are. Bags are read here too, since the crate
//! `rosbag` maps the whole file, which a bag that was cut does not survive.
//!
//! [`LogWriter`] writes the same messages, as ROS 2 has them, into MCAP.
//!
//! Not read: messages that IDL defines, and parameter lists and delimited types of XCDR.

#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)
)]

mod place;

mod error;
mod warning;

mod split;

mod container;

mod compression;

mod wire;

mod definition;

mod message;

mod bag_file;
mod mcap_file;
mod sqlite_file;

mod order;

mod log;

mod log_writer;

pub use self::{
    error::LogError,
    log::{Log, Reading, Stream, Topic},
    log_writer::{LogWriteError, LogWriter, TopicId},
    message::Kind,
    place::Place,
    split::{files_of, is_bag_folder},
    warning::{LogWarning, Refusal},
};
