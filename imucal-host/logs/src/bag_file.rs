//! The container of ROS 1, bags of format 2.0: a line, then records of a head of named fields and a body.
//!
//! A bag that was not closed has no index at its end; its chunks are read all the same. Source: the ROS wiki, Bags/Format/2.0.

use std::{
    collections::{BTreeMap, HashMap},
    path::Path,
};

use crate::{
    compression::{ChunkFault, decompress},
    container::{Connection, Listing, RawMessage, Source, Visitor},
    error::LogError,
    place::Place,
    warning::LogWarning,
};

/// The first line.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Kinds of records.
const MESSAGE: u8 = 2;
const BAG: u8 = 3;
const CHUNK: u8 = 5;
const CHUNK_INFO: u8 = 6;
const CONNECTION: u8 = 7;

/// Looks at all of a file.
pub(crate) fn scan(path: &Path, size: u64, visitor: &mut dyn Visitor) -> Result<(), LogError> {
    let mut source = Source::open(path)?;
    source.skip(MAGIC.len() as u64)?;
    let mut reader = Reader { visitor, chunk: Vec::new() };
    let (mut head, mut body) = (Vec::new(), Vec::new());
    let mut index = None;
    loop {
        let offset = source.at();
        // Behind the chunks is what they have said already.
        if source.left() == 0 || index.is_some_and(|index| index > 0 && offset >= index) {
            return Ok(());
        }
        let Some(length) = record_head(&mut source, size, &mut head)? else {
            reader.visitor.warn(LogWarning::Truncated { offset });
            return Ok(());
        };
        let fields = Fields::of(&head)
            .ok_or_else(|| source.damaged(offset, "a record without named fields", "one of a bag"))?;
        let whole = u64::from(length) <= source.left();
        let mut read = |source: &mut Source<'_>| match whole {
            true => source.record(length.into(), size, &mut body),
            false => source.fill(source.left().min(size), &mut body),
        };
        match fields.kind() {
            Some(BAG) => {
                refuse_encrypted(path, &fields)?;
                let place = fields.u64("index_pos").unwrap_or(0);
                if place == 0 {
                    reader.visitor.warn(LogWarning::NoIndex);
                }
                index = Some(place);
                source.skip(length.into())?;
            }
            Some(CHUNK) => {
                read(&mut source)?;
                reader.chunk(&source, offset, &fields, &body, size, whole)?;
            }
            Some(MESSAGE | CONNECTION) if whole => {
                read(&mut source)?;
                reader.record(&source, offset, &fields, &body)?;
            }
            None => return Err(source.damaged(offset, "a record without its kind", "one of a bag")),
            Some(_) => source.skip(length.into())?,
        }
        if !whole {
            reader.visitor.warn(LogWarning::Truncated { offset });
            return Ok(());
        }
    }
}

fn refuse_encrypted(path: &Path, fields: &Fields<'_>) -> Result<(), LogError> {
    match fields.text("encryptor") {
        None | Some("") => Ok(()),
        Some(found) => Err(LogError::Encrypted { path: path.to_path_buf(), found: found.to_owned() }),
    }
}

/// Reads a record's fields, and the length of its body; `None` where the file ends.
fn record_head(source: &mut Source<'_>, size: u64, head: &mut Vec<u8>) -> Result<Option<u32>, LogError> {
    let mut number = Vec::new();
    let Some(length) = length(source, &mut number)? else { return Ok(None) };
    if u64::from(length) > source.left() {
        return Ok(None);
    }
    source.record(length.into(), size, head)?;
    self::length(source, &mut number)
}

fn length(source: &mut Source<'_>, number: &mut Vec<u8>) -> Result<Option<u32>, LogError> {
    source.fill(4, number)?;
    Ok(number.first_chunk::<4>().map(|bytes| u32::from_le_bytes(*bytes)))
}

/// The named fields of a record's head.
struct Fields<'a>(HashMap<&'a [u8], &'a [u8]>);

impl<'a> Fields<'a> {
    fn of(head: &'a [u8]) -> Option<Self> {
        let (mut rest, mut fields) = (head, HashMap::new());
        while !rest.is_empty() {
            let (field, next) = sized(rest)?;
            let at = field.iter().position(|byte| *byte == b'=')?;
            fields.insert(field.get(..at)?, field.get(at + 1..)?);
            rest = next;
        }
        Some(Self(fields))
    }

    fn get(&self, name: &str) -> Option<&'a [u8]> {
        self.0.get(name.as_bytes()).copied()
    }

    fn kind(&self) -> Option<u8> {
        self.get("op")?.first().copied()
    }

    fn text(&self, name: &str) -> Option<&'a str> {
        std::str::from_utf8(self.get(name)?).ok()
    }

    fn u32(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(*self.get(name)?.first_chunk::<4>()?))
    }

    fn u64(&self, name: &str) -> Option<u64> {
        Some(u64::from_le_bytes(*self.get(name)?.first_chunk::<8>()?))
    }

    /// A time, ns.
    fn time(&self, name: &str) -> Option<i64> {
        let both = self.u64(name)?;
        let (seconds, nanoseconds) = (both & u64::from(u32::MAX), both >> 32);
        Some(seconds as i64 * 1_000_000_000 + nanoseconds as i64)
    }

    fn connection(&self, body: &[u8]) -> Option<Connection> {
        let inner = Fields::of(body)?;
        let text = |name| inner.get(name).map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        Some(Connection {
            id: self.u32("conn")?,
            topic: self.text("topic")?.to_owned(),
            type_name: text("type")?,
            encoding: "ros1".to_owned(),
            language: "ros1msg".to_owned(),
            definition: text("message_definition").unwrap_or_default(),
            md5: text("md5sum"),
        })
    }
}

/// Bytes behind their length, and what follows.
fn sized(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

struct Reader<'a> {
    visitor: &'a mut dyn Visitor,
    chunk: Vec<u8>,
}

impl Reader<'_> {
    /// The records of a chunk; of one that was cut those that are whole.
    fn chunk(
        &mut self,
        source: &Source<'_>,
        offset: u64,
        fields: &Fields<'_>,
        body: &[u8],
        size: u64,
        whole: bool,
    ) -> Result<(), LogError> {
        let (Some(compression), Some(length)) = (fields.text("compression"), fields.u32("size")) else {
            return Err(source.damaged(offset, "a chunk without compression and size", "both"));
        };
        if u64::from(length) > size {
            let (path, found) = (source.path().to_path_buf(), length.into());
            return Err(LogError::TooLarge { path, place: Place::Byte(offset), found, limit: size });
        }
        let mut chunk = std::mem::take(&mut self.chunk);
        match decompress(compression, body, length.into(), &mut chunk) {
            Err(ChunkFault::Method) => {
                let (path, found) = (source.path().to_path_buf(), compression.to_owned());
                return Err(LogError::Compression { path, offset, found });
            }
            Err(ChunkFault::Damaged(found)) if whole => {
                return Err(source.damaged(offset, found, "an intact chunk"));
            }
            _ => {}
        }
        let mut rest = chunk.as_slice();
        while let Some((head, (body, next))) = sized(rest).and_then(|(head, rest)| Some((head, sized(rest)?)))
        {
            let fields = Fields::of(head)
                .ok_or_else(|| source.damaged(offset, "a record without named fields", "one of a bag"))?;
            self.record(source, offset, &fields, body)?;
            rest = next;
        }
        if whole && !rest.is_empty() {
            return Err(source.damaged(offset, "a record that its chunk cuts", "whole records"));
        }
        self.chunk = chunk;
        Ok(())
    }

    fn record(
        &mut self,
        source: &Source<'_>,
        offset: u64,
        fields: &Fields<'_>,
        body: &[u8],
    ) -> Result<(), LogError> {
        match fields.kind() {
            Some(CONNECTION) => {
                let connection = fields.connection(body);
                let bad = || source.damaged(offset, "a connection without its fields", "topic and type");
                self.visitor.connection(connection.ok_or_else(bad)?);
            }
            Some(MESSAGE) => {
                let (Some(connection), Some(log_ns)) = (fields.u32("conn"), fields.time("time")) else {
                    return Err(source.damaged(offset, "a message without its fields", "conn and time"));
                };
                self.visitor.message(RawMessage {
                    connection,
                    log_ns,
                    place: Place::Byte(offset),
                    data: body,
                })?;
            }
            _ => {}
        }
        Ok(())
    }
}

/// What the index at the bag's end says; `None` where it does not say it all.
pub(crate) fn listing(path: &Path, size: u64) -> Result<Option<Listing>, LogError> {
    let mut source = Source::open(path)?;
    source.skip(MAGIC.len() as u64)?;
    let (mut head, mut body) = (Vec::new(), Vec::new());
    let first = record_head(&mut source, size, &mut head)?;
    let fields = first.and_then(|_| Fields::of(&head)).filter(|fields| fields.kind() == Some(BAG));
    let stated = fields.and_then(|fields| {
        Some((fields.u64("index_pos")?, fields.u32("chunk_count")?, fields.u32("conn_count")?))
    });
    let Some((place, chunks, connections)) = stated.filter(|(place, ..)| *place > 0) else {
        return Ok(None);
    };
    source.seek(place)?;
    let mut index = Index::default();
    while source.left() > 0 {
        let Some(length) = record_head(&mut source, size, &mut head)? else { return Ok(None) };
        if u64::from(length) > source.left().min(size) {
            return Ok(None);
        }
        source.fill(length.into(), &mut body)?;
        if Fields::of(&head).and_then(|fields| index.add(&fields, &body)).is_none() {
            return Ok(None);
        }
    }
    let whole = index.chunks == chunks && index.connections.len() as u64 == u64::from(connections);
    Ok(whole.then(|| index.listing()))
}

#[derive(Default)]
struct Index {
    connections: BTreeMap<u32, Connection>,
    counts: HashMap<u32, u64>,
    chunks: u32,
}

impl Index {
    /// Takes a record; `None` if it is none of an index.
    fn add(&mut self, fields: &Fields<'_>, body: &[u8]) -> Option<()> {
        match fields.kind()? {
            CONNECTION => {
                let connection = fields.connection(body)?;
                self.connections.insert(connection.id, connection);
            }
            CHUNK_INFO => {
                self.chunks += 1;
                for pair in body.as_chunks::<8>().0 {
                    let [a, b, c, d, e, f, g, h] = *pair;
                    let count = self.counts.entry(u32::from_le_bytes([a, b, c, d])).or_default();
                    *count += u64::from(u32::from_le_bytes([e, f, g, h]));
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn listing(self) -> Listing {
        let counted = |connection: Connection| {
            let count = self.counts.get(&connection.id).copied().unwrap_or(0);
            (connection, count)
        };
        self.connections.into_values().map(counted).collect()
    }
}
