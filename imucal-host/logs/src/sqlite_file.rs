//! The container of ROS 2 before MCAP: a database of SQLite with the tables `topics` and `messages` and, since Iron,
//! `message_definitions`.
//!
//! A bag whose messages are compressed one by one does not say so in the database. CDR begins with a zero, a stream of zstd
//! does not. Source: ros2/rosbag2, the storage plugin `sqlite3`.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use rusqlite::{Connection as Sqlite, OpenFlags, OptionalExtension, Row, types::ValueRef};

use crate::{
    compression::{decompress_message, is_zstd},
    container::{Connection, Listing, RawMessage, Visitor},
    error::LogError,
    place::Place,
};

/// The first bytes.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";

/// A file of unknown origin: what its schema defines calls no function, and sizes in its pages are checked.
const CAUTION: &str = "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA query_only = ON;";
const TOPICS: &str = "SELECT id, name, type, serialization_format FROM topics ORDER BY id";
/// Number and the first of the messages of each topic.
const COUNTS: &str = "SELECT topic_id, count(*), min(id) FROM messages GROUP BY topic_id";
const DEFINITIONS: &str = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";

/// Looks at the messages that are of interest.
pub(crate) fn scan(path: &Path, size: u64, visitor: &mut dyn Visitor) -> Result<(), LogError> {
    let bag = Bag::open(path)?;
    let mut wanted = HashMap::new();
    for (topic, connection) in bag.connections()? {
        let id = connection.id;
        if visitor.connection(connection) {
            wanted.insert(topic, id);
        }
    }
    bag.messages(&wanted, size, visitor)
}

/// Topics and how many messages each has.
pub(crate) fn listing(path: &Path) -> Result<Option<Listing>, LogError> {
    let bag = Bag::open(path)?;
    let counts = bag.rows(COUNTS, |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    let mut counts: HashMap<i64, (i64, i64)> = counts.into_iter().collect();
    let count = |(topic, connection): (i64, Connection)| {
        let (count, _) = counts.remove(&topic).unwrap_or_default();
        (connection, u64::try_from(count).unwrap_or(0))
    };
    let listed = bag.connections()?.into_iter().map(count).collect();
    match counts.into_iter().min() {
        Some((topic, (_, first))) => {
            let found = format!("a message of topic {topic}");
            Err(bag.damaged(first, found, "one that the table `topics` has"))
        }
        None => Ok(Some(listed)),
    }
}

/// A bag that is open for reading.
struct Bag<'a> {
    path: &'a Path,
    database: Sqlite,
}

/// A row's message, whose content may be missing or of another type.
struct Stored<'r> {
    id: i64,
    topic: i64,
    stamp_ns: i64,
    length: Option<i64>,
    data: ValueRef<'r>,
}

impl<'r> Stored<'r> {
    fn of(row: &'r Row<'_>) -> rusqlite::Result<Self> {
        Ok(Self {
            id: row.get(0)?,
            topic: row.get(1)?,
            stamp_ns: row.get(2)?,
            length: row.get(3)?,
            data: row.get_ref(4)?,
        })
    }
}

impl<'a> Bag<'a> {
    fn open(path: &'a Path) -> Result<Self, LogError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let opened = Sqlite::open_with_flags(path, flags)
            .and_then(|database| database.execute_batch(CAUTION).map(|()| database));
        let bag = Self { path, database: opened.map_err(|cause| unreadable(path, &cause))? };
        for table in ["topics", "messages"] {
            if !bag.has(table)? {
                return Err(LogError::NotABag { path: path.to_path_buf(), missing: table });
            }
        }
        Ok(bag)
    }

    /// Whether there is a table of this name; a view is none.
    fn has(&self, table: &str) -> Result<bool, LogError> {
        let query = "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1";
        let found = self.database.query_row(query, [table], |_| Ok(())).optional();
        found.map(|found| found.is_some()).map_err(|cause| unreadable(self.path, &cause))
    }

    /// All rows of a query that has few.
    fn rows<T>(
        &self,
        query: &str,
        read: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, LogError> {
        let rows = || self.database.prepare(query)?.query_map([], read)?.collect();
        let rows: rusqlite::Result<Vec<T>> = rows();
        rows.map_err(|cause| unreadable(self.path, &cause))
    }

    /// The connection of each topic's id.
    fn connections(&self) -> Result<Vec<(i64, Connection)>, LogError> {
        let texts =
            |row: &Row<'_>| -> rusqlite::Result<[String; 3]> { Ok([row.get(0)?, row.get(1)?, row.get(2)?]) };
        let definitions = match self.has("message_definitions")? {
            true => self.rows(DEFINITIONS, texts)?,
            false => Vec::new(),
        };
        let of_type = |type_name: &str| {
            let found = definitions.iter().find(|[of, _, text]| of == type_name && !text.trim().is_empty());
            found.map(|[_, language, text]| (language.clone(), text.clone())).unwrap_or_default()
        };
        let topics = self.rows(TOPICS, |row| {
            let topic: [String; 3] = [row.get(1)?, row.get(2)?, row.get(3)?];
            Ok((row.get(0)?, topic))
        })?;
        let connection = |(id, (of, [topic, type_name, encoding])): (u32, (i64, [String; 3]))| {
            let (language, definition) = of_type(&type_name);
            (of, Connection { id, topic, type_name, encoding, language, definition, md5: None })
        };
        Ok((0..).zip(topics).map(connection).collect())
    }

    /// Messages of topics, by their ids in the table, in the order of recording. Others may be images: they are not fetched.
    fn messages(
        &self,
        wanted: &HashMap<i64, u32>,
        size: u64,
        visitor: &mut dyn Visitor,
    ) -> Result<(), LogError> {
        let unreadable = |cause: rusqlite::Error| unreadable(self.path, &cause);
        let topics = wanted.keys().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let query = format!(
            "SELECT id, topic_id, timestamp, length(data), CASE WHEN length(data) <= ?1 THEN data END \
             FROM messages WHERE topic_id IN ({topics}) ORDER BY id"
        );
        let limit = i64::try_from(size).unwrap_or(i64::MAX);
        let mut statement = self.database.prepare(&query).map_err(unreadable)?;
        let mut rows = statement.query([limit]).map_err(unreadable)?;
        while let Some(row) = rows.next().map_err(unreadable)? {
            let stored = Stored::of(row).map_err(unreadable)?;
            if let Some(connection) = wanted.get(&stored.topic) {
                self.message(&stored, *connection, size, visitor)?;
            }
        }
        Ok(())
    }

    fn message(
        &self,
        stored: &Stored<'_>,
        connection: u32,
        size: u64,
        visitor: &mut dyn Visitor,
    ) -> Result<(), LogError> {
        let (place, log_ns) = (Place::Row(stored.id), stored.stamp_ns);
        let found = stored.length.and_then(|length| u64::try_from(length).ok()).unwrap_or(0);
        if found > size {
            let path = self.path.to_path_buf();
            return Err(LogError::TooLarge { path, place, found, limit: size });
        }
        let Ok(data) = stored.data.as_blob() else {
            let found = format!("content of the type {:?}", stored.data.data_type());
            return Err(self.damaged(stored.id, found, "bytes"));
        };
        if !is_zstd(data) {
            return visitor.message(RawMessage { connection, log_ns, place, data });
        }
        let intact = decompress_message(data, size);
        let data = intact.map_err(|found| self.damaged(stored.id, found, "an intact message"))?;
        visitor.message(RawMessage { connection, log_ns, place, data: &data })
    }

    fn damaged(&self, row: i64, found: String, expected: &'static str) -> LogError {
        LogError::Damaged { path: self.path.to_path_buf(), place: Place::Row(row), found, expected }
    }
}

fn unreadable(path: &Path, cause: &rusqlite::Error) -> LogError {
    LogError::Database { path: PathBuf::from(path), found: cause.to_string() }
}
