//! The container MCAP (version 0): magic, then records of an opcode, a length and a body.
//!
//! A file that was not closed has no footer, and no summary at its end; its records are read all the same.

use std::{collections::BTreeMap, path::Path};

use mcap::{
    MAGIC, parse_record,
    records::{Channel, Record, Statistics, op},
};

use crate::{
    compression::{ChunkFault, decompress},
    container::{Connection, Listing, RawMessage, Source, Visitor},
    error::LogError,
    place::Place,
    warning::LogWarning,
    wire::{Encoding, Wire},
};

/// Opcode and length.
const HEAD: u64 = 9;
/// Footer and magic at the end.
const FOOTER: u64 = HEAD + 20 + MAGIC.len() as u64;

/// Looks at all of a file.
pub(crate) fn scan(path: &Path, size: u64, visitor: &mut dyn Visitor) -> Result<(), LogError> {
    let mut source = Source::open(path)?;
    source.skip(MAGIC.len() as u64)?;
    let mut reader = Reader { visitor, schemas: BTreeMap::new(), chunk: Vec::new() };
    let mut body = Vec::new();
    loop {
        let offset = source.at();
        let Some((opcode, length)) = head(&mut source)? else {
            reader.visitor.warn(LogWarning::Truncated { offset });
            return Ok(());
        };
        let whole = length <= source.left();
        match opcode {
            op::DATA_END | op::FOOTER => return Ok(()),
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK if whole => {
                source.record(length, size, &mut body)?;
                if opcode == op::CHUNK {
                    reader.chunk(&source, offset, &body, size, true)?;
                } else {
                    reader.record(&source, offset, opcode, &body)?;
                }
            }
            op::CHUNK => {
                source.fill(source.left().min(size), &mut body)?;
                reader.chunk(&source, offset, &body, size, false)?;
            }
            // A file system that lost power leaves zeros at the end.
            0 if length == 0 => {
                reader.visitor.warn(LogWarning::Truncated { offset });
                return Ok(());
            }
            0 => return Err(source.damaged(offset, "a record of the kind 0", "one of MCAP")),
            _ => source.skip(length)?,
        }
        if !whole {
            reader.visitor.warn(LogWarning::Truncated { offset });
            return Ok(());
        }
    }
}

/// A record's opcode and length; `None` where the file ends.
fn head(source: &mut Source<'_>) -> Result<Option<(u8, u64)>, LogError> {
    let mut head = Vec::new();
    source.fill(HEAD, &mut head)?;
    Ok(split_head(&head).map(|(opcode, length, _)| (opcode, length)))
}

/// Opcode, length and what follows.
fn split_head(bytes: &[u8]) -> Option<(u8, u64, &[u8])> {
    let (opcode, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    Some((*opcode, u64::from_le_bytes(*length), rest))
}

struct Reader<'a> {
    visitor: &'a mut dyn Visitor,
    /// Name, language and definition.
    schemas: BTreeMap<u16, Schema>,
    chunk: Vec<u8>,
}

#[derive(Clone, Debug, Default)]
struct Schema {
    name: String,
    language: String,
    definition: String,
}

impl Schema {
    fn connection(self, channel: Channel) -> Connection {
        Connection {
            id: channel.id.into(),
            topic: channel.topic,
            type_name: self.name,
            encoding: channel.message_encoding,
            language: self.language,
            definition: self.definition,
            md5: None,
        }
    }
}

impl Reader<'_> {
    /// The records of a chunk; of one that was cut those that are whole.
    fn chunk(
        &mut self,
        source: &Source<'_>,
        offset: u64,
        body: &[u8],
        size: u64,
        whole: bool,
    ) -> Result<(), LogError> {
        let Some(head) = ChunkHead::of(body) else {
            return if whole {
                Err(source.damaged(offset, "a chunk without a head", "one of MCAP"))
            } else {
                Ok(())
            };
        };
        if head.size > size {
            let (path, found) = (source.path().to_path_buf(), head.size);
            return Err(LogError::TooLarge { path, place: Place::Byte(offset), found, limit: size });
        }
        let mut chunk = std::mem::take(&mut self.chunk);
        match decompress(head.compression, head.records, head.size, &mut chunk) {
            Err(ChunkFault::Method) => {
                let (path, found) = (source.path().to_path_buf(), head.compression.to_owned());
                return Err(LogError::Compression { path, offset, found });
            }
            Err(ChunkFault::Damaged(found)) if whole => {
                return Err(source.damaged(offset, found, "an intact chunk"));
            }
            Ok(()) if head.crc != 0 && crc32fast::hash(&chunk) != head.crc => {
                let found = format!("a chunk whose CRC is {:08x}", crc32fast::hash(&chunk));
                return Err(source.damaged(offset, found, "the CRC that it states"));
            }
            _ => {}
        }
        let mut rest = chunk.as_slice();
        while let Some((opcode, length, body)) = split_head(rest) {
            let Some((body, next)) =
                usize::try_from(length).ok().and_then(|length| body.split_at_checked(length))
            else {
                break;
            };
            self.record(source, offset, opcode, body)?;
            rest = next;
        }
        if whole && !rest.is_empty() {
            return Err(source.damaged(offset, "a record that its chunk cuts", "whole records"));
        }
        self.chunk = chunk;
        Ok(())
    }

    fn record(&mut self, source: &Source<'_>, offset: u64, opcode: u8, body: &[u8]) -> Result<(), LogError> {
        // Others are of no use here.
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        let record = parse_record(opcode, body)
            .map_err(|cause| source.damaged(offset, format!("a bad record ({cause})"), "one of MCAP"))?;
        match record {
            Record::Schema { header, data } => {
                let definition = String::from_utf8_lossy(&data).into_owned();
                let schema = Schema { name: header.name, language: header.encoding, definition };
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                self.visitor.connection(schema.connection(channel));
            }
            Record::Message { header, data } => self.visitor.message(RawMessage {
                connection: header.channel_id.into(),
                log_ns: i64::try_from(header.log_time).unwrap_or(i64::MAX),
                place: Place::Byte(offset),
                data: &data,
            })?,
            _ => {}
        }
        Ok(())
    }
}

/// What a chunk says of its records.
struct ChunkHead<'a> {
    size: u64,
    crc: u32,
    compression: &'a str,
    records: &'a [u8],
}

impl<'a> ChunkHead<'a> {
    /// Also of a chunk that was cut.
    fn of(body: &'a [u8]) -> Option<Self> {
        const TIMES: usize = 16;
        let rest = body.get(TIMES..)?;
        let (size, rest) = rest.split_first_chunk::<8>()?;
        let (crc, rest) = rest.split_first_chunk::<4>()?;
        let compression = Wire::new(rest, Encoding::Ros1).ok()?.text().ok()?;
        let rest = rest.get(4 + compression.len()..)?;
        let (length, records) = rest.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
        Some(Self {
            size: u64::from_le_bytes(*size),
            crc: u32::from_le_bytes(*crc),
            compression,
            records: records.get(..length).unwrap_or(records),
        })
    }
}

/// What the summary at the file's end says; `None` where it does not say it all.
pub(crate) fn listing(path: &Path, size: u64) -> Result<Option<Listing>, LogError> {
    let mut source = Source::open(path)?;
    let Some((start, end)) = summary_place(&mut source)? else { return Ok(None) };
    source.seek(start)?;
    let (mut summary, mut body) = (Summary::default(), Vec::new());
    while source.at() < end {
        let Some((opcode, length)) = head(&mut source)? else { return Ok(None) };
        if length > source.left() || length > size {
            return Ok(None);
        }
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::STATISTICS) {
            source.skip(length)?;
            continue;
        }
        source.fill(length, &mut body)?;
        if summary.add(opcode, &body).is_none() {
            return Ok(None);
        }
    }
    Ok(summary.listing())
}

/// Where the summary begins and ends; `None` where there is no footer or no summary.
fn summary_place(source: &mut Source<'_>) -> Result<Option<(u64, u64)>, LogError> {
    let Some(end) = source.left().checked_sub(FOOTER) else { return Ok(None) };
    source.seek(end)?;
    let mut footer = Vec::new();
    source.fill(FOOTER, &mut footer)?;
    let start = footer
        .strip_suffix(MAGIC)
        .and_then(split_head)
        .filter(|(opcode, ..)| *opcode == op::FOOTER)
        .and_then(|(.., body)| body.first_chunk::<8>())
        .map(|start| u64::from_le_bytes(*start))
        .filter(|start| *start > 0 && *start < end);
    Ok(start.map(|start| (start, end)))
}

#[derive(Default)]
struct Summary {
    schemas: BTreeMap<u16, Schema>,
    channels: Vec<Channel>,
    statistics: Option<Statistics>,
}

impl Summary {
    /// Takes a record; `None` if it is damaged.
    fn add(&mut self, opcode: u8, body: &[u8]) -> Option<()> {
        match parse_record(opcode, body).ok()? {
            Record::Schema { header, data } => {
                let definition = String::from_utf8_lossy(&data).into_owned();
                let schema = Schema { name: header.name, language: header.encoding, definition };
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) => self.channels.push(channel),
            Record::Statistics(found) => self.statistics = Some(found),
            _ => {}
        }
        Some(())
    }

    /// Of all channels; `None` where a schema or a count is missing.
    fn listing(self) -> Option<Listing> {
        let counts = self.statistics.filter(|found| found.channel_count as usize == self.channels.len())?;
        let listed = self.channels.into_iter().map(|channel| {
            let count = counts.channel_message_counts.get(&channel.id).copied().unwrap_or(0);
            let schema = match channel.schema_id {
                0 => Schema::default(),
                id => self.schemas.get(&id)?.clone(),
            };
            Some((schema.connection(channel), count))
        });
        let listed: Listing = listed.collect::<Option<_>>()?;
        let total = listed.iter().fold(0u64, |sum, (_, count)| sum.saturating_add(*count));
        (total == counts.message_count).then_some(listed)
    }
}
