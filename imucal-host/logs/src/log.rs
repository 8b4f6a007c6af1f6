//! A log: its topics, and the numbers of some.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use crate::{
    container::{Connection, Container, RawMessage, Visitor},
    definition::{MessageType, check, check_sum},
    error::LogError,
    message::{Kind, decode},
    order::Unordered,
    split::files_of,
    warning::{LogWarning, Refusal},
    wire::Encoding,
};

/// A log whose topics are known: a file, or a folder that the recorder of ROS 2 made.
#[derive(Clone, Debug)]
pub struct Log {
    path: PathBuf,
    /// In the order of recording.
    files: Vec<(PathBuf, Container)>,
    size: u64,
    topics: Vec<Topic>,
}

/// A topic of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The type of its messages, as the log has it.
    pub type_name: String,
    /// How many there are.
    pub count: u64,
    /// What they say, or why they are not read.
    pub kind: Result<Kind, Refusal>,
}

/// The numbers of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The topic.
    pub topic: String,
    /// What the columns are.
    pub kind: Kind,
    /// `frame_id` of the header: the sensor, or the frame in which a pose is.
    pub frame: String,
    /// `child_frame_id` of odometry: the body.
    pub child_frame: Option<String>,
    /// Stamp of each message, ns; strictly increasing.
    pub stamps_ns: Vec<i64>,
    /// Message by message, each as many as [`Kind::columns`] has; NaN where not known.
    pub values: Vec<f64>,
}

impl Stream {
    /// The numbers of a message; none beyond the last.
    #[must_use]
    pub fn row(&self, at: usize) -> &[f64] {
        let width = self.kind.columns().len();
        self.values.get(at * width..(at + 1) * width).unwrap_or_default()
    }
}

/// What came of reading some topics.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// In the order in which they were asked for.
    pub streams: Vec<Stream>,
    /// What was odd and harmless.
    pub warnings: Vec<LogWarning>,
}

impl Log {
    /// Opens a log and finds its topics, by the index of each file if it has one. Neither a chunk nor the numbers of the topics that will be
    /// read may take more than `size` bytes.
    ///
    /// # Errors
    ///
    /// [`LogError`].
    pub fn open(path: &Path, size: u64) -> Result<Self, LogError> {
        let mut files = Vec::new();
        let mut listed = Vec::new();
        for file in files_of(path)? {
            let container = Container::of(&file)?;
            match container.listing(&file, size)? {
                Some(of_file) => listed.extend(of_file),
                None => {
                    let mut counter = Counter::default();
                    container.scan(&file, size, &mut counter)?;
                    listed.extend(counter.listed);
                }
            }
            files.push((file, container));
        }
        let mut topics: Vec<Topic> = Vec::new();
        for (connection, count) in listed {
            let found = Topic {
                kind: readable(&connection).map(|(known, _)| known.kind()),
                name: connection.topic,
                type_name: connection.type_name,
                count,
            };
            let same = |topic: &&mut Topic| {
                topic.name == found.name && topic.type_name == found.type_name && topic.kind == found.kind
            };
            match topics.iter_mut().find(same) {
                Some(topic) => topic.count += count,
                None => topics.push(found),
            }
        }
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self { path: path.to_path_buf(), files, size, topics })
    }

    /// Its topics by their names. One that carries several types is there once for each.
    #[must_use]
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Reads topics by their names, in the order of stamps.
    ///
    /// # Errors
    ///
    /// [`LogError`], also of a topic that is not there or whose messages are not read.
    pub fn read(&self, names: &[&str]) -> Result<Reading, LogError> {
        let topics: Result<Vec<OfTopic>, LogError> =
            names.iter().map(|name| Ok(OfTopic::new(name, self.kind_of(name)?))).collect();
        let (mut topics, mut warnings) = (topics?, Vec::new());
        for (file, container) in &self.files {
            topics.iter_mut().for_each(|topic| topic.messages.begin(file));
            let mut reader = Reader {
                path: file,
                size: self.size,
                topics: &mut topics,
                of_connection: HashMap::new(),
                warnings: Vec::new(),
            };
            container.scan(file, self.size, &mut reader)?;
            for warning in reader.warnings {
                let warning = if self.files.len() > 1 { warning.in_file(file) } else { warning };
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        }
        let mut streams = Vec::new();
        for topic in topics {
            streams.push(topic.stream(&mut warnings)?);
        }
        Ok(Reading { streams, warnings })
    }

    fn kind_of(&self, name: &str) -> Result<Kind, LogError> {
        let mut found = self.topics.iter().filter(|topic| topic.name == name);
        let Some(first) = found.next() else {
            let there = self.topics.iter().map(|topic| topic.name.clone()).collect();
            return Err(LogError::NoTopic { path: self.path.clone(), topic: name.to_owned(), there });
        };
        let refused = |why| LogError::Topic { path: self.path.clone(), topic: name.to_owned(), why };
        let kind = first.kind.clone().map_err(refused)?;
        for other in found {
            if other.kind.clone().map_err(refused)? != kind {
                let both = format!("{}, {}", first.type_name, other.type_name);
                return Err(refused(Refusal::Type { found: both }));
            }
        }
        Ok(kind)
    }
}

/// Whether the messages of a connection are read, and how.
fn readable(connection: &Connection) -> Result<(MessageType, Encoding), Refusal> {
    let known = MessageType::of(&connection.type_name)
        .ok_or_else(|| Refusal::Type { found: connection.type_name.clone() })?;
    let encoding = match connection.encoding.as_str() {
        "cdr" => Encoding::Cdr,
        "ros1" => Encoding::Ros1,
        other => return Err(Refusal::Encoding { found: other.to_owned() }),
    };
    if !matches!(connection.language.as_str(), "ros1msg" | "ros2msg" | "") {
        return Err(Refusal::Language { found: connection.language.clone() });
    }
    if !connection.definition.trim().is_empty() {
        check(known, encoding, &connection.definition)?;
    } else if let Some(md5) = &connection.md5 {
        check_sum(known, md5)?;
    }
    Ok((known, encoding))
}

/// Counts the messages of each connection.
#[derive(Default)]
struct Counter {
    listed: Vec<(Connection, u64)>,
    at: HashMap<u32, usize>,
}

impl Visitor for Counter {
    fn connection(&mut self, connection: Connection) -> bool {
        if !self.at.contains_key(&connection.id) {
            self.at.insert(connection.id, self.listed.len());
            self.listed.push((connection, 0));
        }
        true
    }

    fn message(&mut self, message: RawMessage<'_>) -> Result<(), LogError> {
        let at = self.at.get(&message.connection);
        if let Some((_, count)) = at.and_then(|at| self.listed.get_mut(*at)) {
            *count += 1;
        }
        Ok(())
    }

    // Reading says it again.
    fn warn(&mut self, _: LogWarning) {}
}

/// Keeps the numbers of some topics in one of the files.
struct Reader<'a> {
    path: &'a Path,
    size: u64,
    topics: &'a mut [OfTopic],
    /// Topic, type and encoding of the connections that are read.
    of_connection: HashMap<u32, (usize, MessageType, Encoding)>,
    warnings: Vec<LogWarning>,
}

struct OfTopic {
    name: String,
    frame: Option<String>,
    child_frame: Option<String>,
    other_frame: Option<String>,
    count: u64,
    messages: Unordered,
}

impl OfTopic {
    fn new(name: &str, kind: Kind) -> Self {
        Self {
            name: name.to_owned(),
            frame: None,
            child_frame: None,
            other_frame: None,
            count: 0,
            messages: Unordered::new(kind),
        }
    }

    fn stream(self, warnings: &mut Vec<LogWarning>) -> Result<Stream, LogError> {
        let (kind, frame) = (self.messages.kind, self.frame.unwrap_or_default());
        if let Some(other) = self.other_frame {
            let (topic, first) = (self.name.clone(), frame.clone());
            warnings.push(LogWarning::FrameChanges { topic, first, other });
        }
        let ordered = self.messages.ordered(&self.name, warnings)?;
        Ok(Stream {
            topic: self.name,
            kind,
            frame,
            child_frame: self.child_frame,
            stamps_ns: ordered.stamps,
            values: ordered.values,
        })
    }
}

impl Visitor for Reader<'_> {
    fn connection(&mut self, connection: Connection) -> bool {
        let Some(at) = self.topics.iter().position(|topic| topic.name == connection.topic) else {
            return false;
        };
        if self.of_connection.contains_key(&connection.id) {
            return true;
        }
        let Ok((known, encoding)) = readable(&connection) else { return false };
        if connection.definition.trim().is_empty() && connection.md5.is_none() {
            self.warnings
                .push(LogWarning::NoDefinition { topic: connection.topic, type_name: connection.type_name });
        }
        self.of_connection.insert(connection.id, (at, known, encoding));
        true
    }

    fn message(&mut self, message: RawMessage<'_>) -> Result<(), LogError> {
        let Some((at, known, encoding)) = self.of_connection.get(&message.connection) else {
            return Ok(());
        };
        let Some(topic) = self.topics.get_mut(*at) else { return Ok(()) };
        topic.count += 1;
        let found = decode(*known, *encoding, message.data).map_err(|fault| LogError::Message {
            path: self.path.to_path_buf(),
            topic: topic.name.clone(),
            number: topic.count,
            place: message.place,
            found: fault.found.into(),
            expected: fault.expected.into(),
        })?;
        let frame = topic.frame.get_or_insert_with(|| found.frame.to_owned());
        if frame != found.frame && topic.other_frame.is_none() {
            topic.other_frame = Some(found.frame.to_owned());
        }
        if topic.child_frame.is_none() {
            topic.child_frame = found.child.map(str::to_owned);
        }
        topic.messages.stamps.push(found.stamp_ns);
        topic.messages.logged.push(message.log_ns);
        topic.messages.places.push(message.place);
        topic.messages.values.extend(found.values);
        let name = topic.name.clone();
        if self.topics.iter().map(|topic| topic.messages.size()).sum::<u64>() > self.size {
            return Err(LogError::TooMany { path: self.path.to_path_buf(), topic: name, limit: self.size });
        }
        Ok(())
    }

    fn warn(&mut self, warning: LogWarning) {
        self.warnings.push(warning);
    }
}
