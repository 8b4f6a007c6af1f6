//! Where something stands in a log.

use std::fmt;

/// A place in a log's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Bytes from the beginning; of a message in a chunk that of the chunk.
    Byte(u64),
    /// The `id` of a row in a database's table of messages.
    Row(i64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(at) => write!(f, "byte {at}"),
            Self::Row(id) => write!(f, "message {id} of the database"),
        }
    }
}
