//! Lines of numbers that several cores parse, a piece of a text each.

use memchr::{memchr, memchr3, memrchr};
use rayon::prelude::*;

use super::number;

/// Bytes from which a text is cut into pieces.
const LEAST: usize = 1 << 17;

/// Lines that are nothing but numbers, and how far they reach.
#[derive(Clone, Debug, Default)]
pub(crate) struct Piece {
    /// Numbers of each column.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Line of each row, from that of the first byte, which is 0.
    pub(crate) lines: Vec<u64>,
    /// Bytes, and line ends among them.
    pub(crate) length: usize,
    pub(crate) ends: u64,
    /// A line follows that is anything else.
    pub(crate) stopped: bool,
    values: Vec<f64>,
    field_ends: Vec<usize>,
}

/// What lines of numbers look like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Format {
    /// Between numbers.
    pub(crate) separator: u8,
    /// Numbers of a line.
    pub(crate) columns: usize,
    /// Longest line, bytes.
    pub(crate) longest: usize,
}

impl Format {
    /// The numbers of the line at the beginning of a text and the ends of their fields; its length with the byte that ends it. `None` where
    /// the line is anything but numbers, or is not whole.
    pub(crate) fn line(&self, text: &[u8], values: &mut [f64], ends: &mut [usize]) -> Option<usize> {
        let mut at = 0;
        for (k, (value, end)) in values.iter_mut().zip(ends).enumerate() {
            let is_end = |byte: Option<&u8>| match byte {
                Some(b'\n' | b'\r') => k + 1 == self.columns,
                other => other == Some(&self.separator) && k + 1 < self.columns,
            };
            let rest = &text[at..];
            let whole = number::leading(rest).filter(|(_, length)| is_end(rest.get(*length)));
            let other = || {
                let length =
                    memchr3(self.separator, b'\n', b'\r', rest).filter(|end| is_end(rest.get(*end)))?;
                Some((number::parse(&rest[..length]).ok()?, length))
            };
            let (found, length) = whole.or_else(other)?;
            (*value, *end) = (found, at + length);
            at += length + 1;
        }
        (at <= self.longest).then_some(at)
    }

    /// Reads the lines of a text into `pieces`, whose memory is used again, up to the last that is whole, or to the first that is anything but
    /// numbers. False, and nothing is read, of a text that is too short to be cut.
    pub(crate) fn read(&self, text: &[u8], pieces: &mut Vec<Piece>) -> bool {
        let Some(end) = memrchr(b'\n', text) else { return false };
        let text = &text[..=end];
        if text.len() < LEAST {
            return false;
        }
        let texts = cut(text);
        pieces.resize(texts.len(), Piece::default());
        pieces.par_iter_mut().zip(texts).for_each(|(piece, text)| piece.read(text, self));
        let whole = pieces.iter().position(|piece| piece.stopped).map_or(pieces.len(), |at| at + 1);
        pieces.truncate(whole);
        true
    }
}

impl Piece {
    fn read(&mut self, text: &[u8], format: &Format) {
        let Self { columns, lines, length, ends, stopped, values, field_ends } = self;
        columns.resize(format.columns, Vec::new());
        columns.iter_mut().for_each(Vec::clear);
        lines.clear();
        (*length, *ends, *stopped) = (0, 0, false);
        values.resize(format.columns, 0.0);
        field_ends.resize(format.columns, 0);
        loop {
            let blank = text[*length..].iter().take_while(|byte| matches!(byte, b'\n' | b'\r'));
            let (count, line_ends) =
                blank.fold((0, 0), |(count, ends), byte| (count + 1, ends + u64::from(*byte == b'\n')));
            (*length, *ends) = (*length + count, *ends + line_ends);
            if *length == text.len() {
                return;
            }
            let Some(read) = format.line(&text[*length..], values, field_ends) else {
                *stopped = true;
                return;
            };
            columns.iter_mut().zip(&*values).for_each(|(column, value)| column.push(*value));
            lines.push(*ends);
            *length += read;
            *ends += u64::from(text[*length - 1] == b'\n');
        }
    }
}

/// A piece for each core, each to the end of a line.
fn cut(mut text: &[u8]) -> Vec<&[u8]> {
    let length = text.len().div_ceil(rayon::current_num_threads());
    let mut pieces = Vec::new();
    while let Some(end) = text.get(length..).and_then(|rest| memchr(b'\n', rest)) {
        let (piece, rest) = text.split_at(length + end + 1);
        pieces.push(piece);
        text = rest;
    }
    pieces.push(text);
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMAT: Format = Format { separator: b',', columns: 3, longest: 100 };

    /// So many lines with blank ones among them, ended in either way.
    fn text(lines: usize) -> String {
        let end = |line: usize| ["\n", "\r\n", "\n\n"][line % 3];
        (0..lines)
            .map(|line| {
                format!("{line},{}.5,{}{}", line % 7, if line % 5 == 0 { "" } else { "-1e-3" }, end(line))
            })
            .collect()
    }

    /// Numbers and lines of all pieces together, and their length.
    fn joined(pieces: &[Piece]) -> (Vec<Vec<u64>>, Vec<u64>, usize) {
        let (mut columns, mut lines) = (vec![Vec::new(); FORMAT.columns], Vec::new());
        let (mut length, mut ends) = (0, 0);
        for piece in pieces {
            for (column, values) in columns.iter_mut().zip(&piece.columns) {
                column.extend(values.iter().map(|value| value.to_bits()));
            }
            lines.extend(piece.lines.iter().map(|line| ends + line));
            (length, ends) = (length + piece.length, ends + piece.ends);
        }
        (columns, lines, length)
    }

    #[test]
    fn pieces_are_what_one_core_reads() {
        let text = text(20_000);
        let mut one = Piece::default();
        one.read(text.as_bytes(), &FORMAT);
        // What pieces held before does not matter.
        let mut pieces = vec![one.clone(); 2];
        assert!(FORMAT.read(text.as_bytes(), &mut pieces));
        let all = joined(&pieces);
        assert_eq!(all, joined(&[one]));
        assert_eq!((all.0[2].len(), &all.1[..5], all.2), (20_000, &[0, 1, 2, 4, 5][..], text.len()));
    }

    #[test]
    fn a_line_of_anything_else_ends_the_pieces_before_it() {
        for (at, odd) in [(300, "1,2,\"3\"\n"), (9000, "1,2\n"), (19_000, "1,2,3,4\n"), (500, "1,2,x\n")] {
            let (before, after) = (text(at), text(20_000 - at));
            let mut pieces = Vec::new();
            assert!(FORMAT.read(format!("{before}{odd}{after}").as_bytes(), &mut pieces));
            let (_, lines, length) = joined(&pieces);
            assert_eq!((lines.len(), length), (at, before.len()), "{odd}");
            assert!(pieces.last().unwrap().stopped);
        }
    }

    #[test]
    fn a_line_that_is_not_whole_is_left_and_few_lines_are_not_read() {
        let (text, mut pieces) = (text(20_000), Vec::new());
        assert!(FORMAT.read(&text.as_bytes()[..text.len() - 3], &mut pieces));
        assert_eq!(joined(&pieces).1.len(), 19_999);
        assert!(!FORMAT.read(&text.as_bytes()[..LEAST / 2], &mut pieces));
    }
}
