//! The messages of a topic in the order of their stamps, each once.

use std::path::{Path, PathBuf};

use crate::{error::LogError, message::Kind, place::Place, warning::LogWarning};

/// Messages overtake each other by less than this on their way to the recorder, ns; a clock that was reset runs back further.
const OVERTAKES: i64 = 1_000_000_000;
/// Stamps beyond this are of an absolute clock, which is not at its zero, ns.
const FAR: i64 = 1_000_000_000_000_000;

/// The messages of a topic as they stand in the log's files.
#[derive(Clone, Debug)]
pub(crate) struct Unordered {
    pub(crate) kind: Kind,
    /// From which message on they stand in which file.
    pub(crate) files: Vec<(usize, PathBuf)>,
    pub(crate) stamps: Vec<i64>,
    /// When they were recorded, ns.
    pub(crate) logged: Vec<i64>,
    pub(crate) places: Vec<Place>,
    /// Row by row.
    pub(crate) values: Vec<f64>,
}

/// The same in the order of their stamps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ordered {
    pub(crate) stamps: Vec<i64>,
    pub(crate) values: Vec<f64>,
}

impl Unordered {
    pub(crate) fn new(kind: Kind) -> Self {
        let (stamps, logged) = (Vec::new(), Vec::new());
        Self { kind, files: Vec::new(), stamps, logged, places: Vec::new(), values: Vec::new() }
    }

    /// The messages from now on stand in another file.
    pub(crate) fn begin(&mut self, file: &Path) {
        self.files.push((self.stamps.len(), file.to_path_buf()));
    }

    /// Bytes in memory.
    pub(crate) fn size(&self) -> u64 {
        8 * (4 * self.stamps.len() + self.values.len()) as u64
    }

    fn row(&self, row: usize) -> &[f64] {
        let width = self.kind.columns().len();
        self.values.get(row * width..(row + 1) * width).unwrap_or_default()
    }

    fn stamp(&self, row: usize) -> i64 {
        self.stamps.get(row).copied().unwrap_or_default()
    }

    fn place(&self, row: usize) -> Place {
        self.places.get(row).copied().unwrap_or(Place::Byte(0))
    }

    fn file(&self, row: usize) -> PathBuf {
        let last = self.files.iter().rfind(|(first, _)| *first <= row);
        last.map_or_else(PathBuf::new, |(_, file)| file.clone())
    }

    /// Sorts by stamps. Where no message has one, the times of recording are taken.
    pub(crate) fn ordered(
        mut self,
        topic: &str,
        warnings: &mut Vec<LogWarning>,
    ) -> Result<Ordered, LogError> {
        let topic_name = || topic.to_owned();
        let mut rows: Vec<usize> = (0..self.stamps.len()).collect();
        if !rows.is_empty() && self.stamps.iter().all(|stamp| *stamp == 0) {
            self.stamps.clone_from(&self.logged);
            warnings.push(LogWarning::NoStamps { topic: topic_name() });
        }
        if self.stamps.iter().any(|stamp| *stamp > FAR) {
            rows.retain(|row| self.stamp(*row) != 0);
            let count = (self.stamps.len() - rows.len()) as u64;
            if count > 0 {
                warnings.push(LogWarning::StampsMissing { topic: topic_name(), count });
            }
        }
        self.refuse_reset(topic, &rows)?;
        let late = |pair: &&[usize]| matches!(pair, [a, b] if self.stamp(*b) < self.stamp(*a));
        let count = rows.windows(2).filter(late).count() as u64;
        if count > 0 {
            warnings.push(LogWarning::Reordered { topic: topic_name(), count });
        }
        rows.sort_by_key(|row| self.stamp(*row));
        let all = rows.len();
        let mut kept: Vec<usize> = Vec::with_capacity(all);
        for row in rows {
            match kept.last() {
                Some(last) if self.stamp(*last) == self.stamp(row) => {
                    if !is_same(self.row(*last), self.row(row)) {
                        return Err(LogError::StampTwice {
                            path: self.file(row),
                            topic: topic_name(),
                            place: self.place(row),
                            found_ns: self.stamp(row),
                        });
                    }
                }
                _ => kept.push(row),
            }
        }
        let count = (all - kept.len()) as u64;
        if count > 0 {
            warnings.push(LogWarning::Repeated { topic: topic_name(), count });
        }
        Ok(Ordered {
            stamps: kept.iter().map(|row| self.stamp(*row)).collect(),
            values: kept.iter().flat_map(|row| self.row(*row).iter().copied()).collect(),
        })
    }

    /// Stamps that run back in the order of recording. Chunks may stand in any order; times of recording do not.
    fn refuse_reset(&self, topic: &str, rows: &[usize]) -> Result<(), LogError> {
        let mut recorded = rows.to_vec();
        recorded.sort_by_key(|row| self.logged.get(*row).copied().unwrap_or_default());
        let mut before = i64::MIN;
        for row in recorded {
            let found = self.stamp(row);
            if found < before.saturating_sub(OVERTAKES) {
                return Err(LogError::StampOrder {
                    path: self.file(row),
                    topic: topic.to_owned(),
                    place: self.place(row),
                    found_ns: found,
                    before_ns: before,
                });
            }
            before = before.max(found);
        }
        Ok(())
    }
}

/// Bit by bit: what is not known repeats itself too.
fn is_same(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.to_bits() == b.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn ordered(messages: &[(i64, i64, f64)]) -> Result<(Ordered, Vec<String>), String> {
        let mut all = Unordered::new(Kind::Temperature);
        all.begin(Path::new("a.mcap"));
        for (stamp, logged, value) in messages {
            all.stamps.push(*stamp);
            all.logged.push(*logged);
            all.places.push(Place::Byte(0));
            all.values.push(*value);
        }
        let mut warnings = Vec::new();
        let found = all.ordered("/t", &mut warnings);
        let found = found.map_err(|error| error.to_string())?;
        Ok((found, warnings.iter().map(ToString::to_string).collect()))
    }

    #[test]
    fn chunks_out_of_order_are_sorted_and_warned_of() {
        let (found, warnings) =
            ordered(&[(5000 * MS, 5001 * MS, 3.0), (MS, 2 * MS, 1.0), (2 * MS, 3 * MS, 2.0)]).unwrap();
        assert_eq!((found.stamps, found.values), (vec![MS, 2 * MS, 5000 * MS], vec![1.0, 2.0, 3.0]));
        assert!(warnings[0].contains("1 messages came after a later one"), "{warnings:?}");
    }

    #[test]
    fn a_clock_that_was_reset_is_refused() {
        let error = ordered(&[(5000 * MS, MS, 1.0), (2 * MS, 2 * MS, 2.0)]).unwrap_err();
        assert!(error.contains("stamp 2000000 ns after 5000000000 ns") && error.contains("split"), "{error}");
        let overtaken = ordered(&[(20 * MS, MS, 1.0), (10 * MS, 2 * MS, 2.0)]).unwrap();
        assert_eq!(overtaken.0.values, [2.0, 1.0]);
    }

    #[test]
    fn a_message_that_repeats_another_is_left_out_and_one_that_contradicts_it_is_refused() {
        let (found, warnings) =
            ordered(&[(MS, MS, f64::NAN), (MS, 2 * MS, f64::NAN), (2 * MS, 2 * MS, 1.0)]).unwrap();
        assert_eq!(found.stamps, [MS, 2 * MS]);
        assert!(warnings[0].contains("1 messages that repeat"), "{warnings:?}");
        let error = ordered(&[(MS, MS, 1.0), (MS, 2 * MS, 2.0)]).unwrap_err();
        assert!(error.contains("1000000 ns twice with different numbers"), "{error}");
    }

    #[test]
    fn without_stamps_the_times_of_recording_are_taken() {
        let (found, warnings) = ordered(&[(0, 7 * MS, 1.0), (0, 9 * MS, 2.0)]).unwrap();
        assert_eq!(found.stamps, [7 * MS, 9 * MS]);
        assert!(warnings[0].contains("no message has a stamp"), "{warnings:?}");
        let (found, warnings) = ordered(&[(0, 1, 1.0), (2 * FAR, 2, 2.0), (2 * FAR + MS, 3, 3.0)]).unwrap();
        assert_eq!(found.values, [2.0, 3.0]);
        assert!(warnings[0].contains("1 messages without a stamp"), "{warnings:?}");
        // A simulator's clock begins at zero.
        assert_eq!(ordered(&[(0, 1, 1.0), (MS, 2, 2.0)]).unwrap().0.values, [1.0, 2.0]);
    }
}
