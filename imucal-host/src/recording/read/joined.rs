//! Series of different clocks' stamps, joined to rows by time.
//!
//! The rows are the samples of the first series. A sample of another one goes into the row nearest to it, at that row's time: as it
//! is where the stamps are equal, else on the straight line to the next sample, so that no sensor seems late. A row takes one
//! sample of a series at most, and a series that is slower leaves rows empty: nothing is counted more often than it was measured.
//! A mean of two samples has less noise than one: down to a half of its variance in the middle between them.

use std::path::Path;

use super::{
    clock::Clock,
    columns::{Layout, NAMES, POSITION, REFERENCE, TIME, Table},
};
use crate::{
    file::{Limits, limits::Size},
    recording::{place::Places, read_error::ReadError, unit::TimeUnit, warning::Warning},
};

/// Samples further apart than so many of their usual intervals have a gap between them.
const GAP: i64 = 3;

/// Samples of one source.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    /// For messages.
    pub(crate) name: String,
    /// Strictly increasing, ns.
    pub(crate) stamps_ns: Vec<i64>,
    /// Slots of [`NAMES`], of which each has a column.
    pub(crate) slots: Vec<usize>,
    /// Column by column.
    pub(crate) columns: Vec<Vec<f64>>,
    /// The usual step of its stamps, ns.
    interval: i64,
}

impl Series {
    pub(crate) fn new(name: String, stamps_ns: Vec<i64>) -> Self {
        let interval = interval(&stamps_ns);
        Self { name, stamps_ns, slots: Vec::new(), columns: Vec::new(), interval }
    }

    /// Adds a group of columns, unless none of its rows knows anything.
    pub(crate) fn add(&mut self, first: usize, columns: Vec<Vec<f64>>) {
        if columns.iter().flatten().any(|value| !value.is_nan()) {
            self.slots.extend(first..first + columns.len());
            self.columns.extend(columns);
        }
    }

    fn at(&self, column: usize, row: usize) -> f64 {
        self.columns.get(column).and_then(|column| column.get(row)).copied().unwrap_or(f64::NAN)
    }

    /// The values at a time, of which the sample at or before it is known.
    fn between(&self, before: usize, time: i64) -> Option<Vec<f64>> {
        let [from, to] = [before, before + 1].map(|at| self.stamps_ns.get(at).copied());
        let from = from?;
        let all = |row: usize| (0..self.columns.len()).map(|column| self.at(column, row)).collect();
        if from == time {
            return Some(all(before));
        }
        let to = to.filter(|to| to - from <= GAP.saturating_mul(self.interval))?;
        let share = (time - from) as f64 / (to - from) as f64;
        let (one, mut other): (Vec<f64>, Vec<f64>) = (all(before), all(before + 1));
        let attitude = self.attitude();
        if let Some(at) = attitude.clone()
            && dot(one.get(at.clone())?, other.get(at.clone())?) < 0.0
        {
            other.get_mut(at)?.iter_mut().for_each(|part| *part = -*part);
        }
        let mut values: Vec<f64> = one.iter().zip(&other).map(|(a, b)| a + share * (b - a)).collect();
        if let Some(part) = attitude.and_then(|at| values.get_mut(at)) {
            let length = dot(part, part).sqrt();
            part.iter_mut().for_each(|part| *part /= length);
        }
        Some(values)
    }

    /// Where an attitude's four columns are.
    fn attitude(&self) -> Option<std::ops::Range<usize>> {
        let at = self.slots.iter().position(|slot| *slot == REFERENCE)?;
        Some(at..at + POSITION - REFERENCE)
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

fn interval(stamps: &[i64]) -> i64 {
    let mut steps: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied().unwrap_or(0)
}

/// One table of all series, with the stamps of the first as its rows.
pub(crate) fn join(path: &Path, mut series: Vec<Series>, limits: &Limits) -> Result<Table, ReadError> {
    let Some((first, others)) = series.split_first_mut() else {
        return Err(ReadError::NoRows { path: path.to_path_buf() });
    };
    let names: Vec<&str> = std::iter::once(TIME)
        .chain(first.slots.iter().copied())
        .chain(others.iter().flat_map(|each| each.slots.iter().copied()))
        .map(|slot| NAMES[slot])
        .collect();
    let layout = Layout::new(&names, path, None)?;
    let rows = first.stamps_ns.len();
    if (rows as u64).saturating_mul(layout.row_size() as u64) > limits.size {
        return Err(ReadError::TooManySamples { path: path.to_path_buf(), limit: Size(limits.size) });
    }
    let mut table = layout.table(rows, Places::WHOLE, Clock::new(TimeUnit::Nanosecond));
    for stamp in &first.stamps_ns {
        let time = table.clock.take_integer(*stamp);
        table.columns[TIME].push(time);
    }
    for (slot, column) in first.slots.iter().zip(std::mem::take(&mut first.columns)) {
        table.columns[*slot] = column;
    }
    for other in others {
        let placed = place(&first.stamps_ns, first.interval, other, &mut table);
        table.warnings.extend(placed.warning(path, other));
    }
    table.refuse_infinite(path)?;
    Ok(table)
}

/// What became of the samples of a series.
#[derive(Default)]
struct Placed {
    as_it_is: usize,
    between: usize,
    /// The longest way to a row, ns.
    farthest: i64,
}

impl Placed {
    fn warning(&self, path: &Path, series: &Series) -> Option<Warning> {
        let left_out = series.stamps_ns.len().saturating_sub(self.as_it_is + self.between);
        (self.between + left_out > 0).then(|| Warning::Joined {
            path: path.to_path_buf(),
            series: series.name.clone(),
            between: self.between,
            left_out,
            of: series.stamps_ns.len(),
            farthest: self.farthest as f64 / 1e9,
        })
    }
}

fn place(rows: &[i64], longest: i64, series: &Series, table: &mut Table) -> Placed {
    for slot in &series.slots {
        table.columns[*slot] = vec![f64::NAN; rows.len()];
    }
    let mut placed = Placed::default();
    let mut last = None;
    for stamp in &series.stamps_ns {
        let next = rows.partition_point(|row| row < stamp);
        let distance = |row: &usize| rows.get(*row).map_or(i64::MAX, |at| (at - stamp).abs());
        let Some(row) = [next.saturating_sub(1), next].into_iter().min_by_key(distance) else { continue };
        let far = distance(&row);
        if far > longest || last == Some(row) {
            continue;
        }
        let Some(time) = rows.get(row) else { continue };
        let Some(before) = series.stamps_ns.partition_point(|at| at <= time).checked_sub(1) else { continue };
        let Some(values) = series.between(before, *time) else { continue };
        last = Some(row);
        let exact = series.stamps_ns.get(before) == Some(time);
        *(if exact { &mut placed.as_it_is } else { &mut placed.between }) += 1;
        placed.farthest = placed.farthest.max(if exact { 0 } else { far });
        for (slot, value) in series.slots.iter().zip(values) {
            table.columns[*slot][row] = value;
        }
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::read::columns::{TEMPERATURE, slot_of};
    use crate::recording::sensor_kind::SensorKind;

    const MS: i64 = 1_000_000;

    fn series(name: &str, first: usize, samples: &[(i64, f64)], width: usize) -> Series {
        let mut made = Series::new(name.to_owned(), samples.iter().map(|(at, _)| *at).collect());
        let column: Vec<f64> = samples.iter().map(|(_, value)| *value).collect();
        made.add(first, vec![column; width]);
        made
    }

    fn imu(rows: i64) -> Series {
        let samples: Vec<(i64, f64)> =
            (0..rows).map(|k| (1_700_000_000_000 * MS + 10 * k * MS + 789, 9.8)).collect();
        series("/imu", slot_of(SensorKind::Acc), &samples, 3)
    }

    fn joined<const N: usize>(all: [Series; N]) -> Table {
        join(Path::new("run.bag"), all.into(), &Limits::default()).unwrap()
    }

    #[test]
    fn equal_stamps_share_a_row_and_a_slower_series_leaves_rows_empty() {
        let rows = imu(5);
        let warm = series("/warm", TEMPERATURE, &[(rows.stamps_ns[1], 20.0), (rows.stamps_ns[4], 23.0)], 1);
        let table = joined([rows, warm]);
        assert_eq!(table.columns[TIME], [0.0, 0.01, 0.02, 0.03, 0.04]);
        assert_eq!(table.clock.epoch.unwrap().picoseconds(), 1_700_000_000_000_000_789_000);
        let warm = &table.columns[TEMPERATURE];
        assert!(warm[0].is_nan() && warm[2].is_nan() && (warm[1], warm[4]) == (20.0, 23.0), "{warm:?}");
        assert!(table.warnings.is_empty());
    }

    #[test]
    fn a_sample_between_two_rows_is_taken_to_the_time_of_the_nearer_one() {
        let rows = imu(5);
        // 3 ms late: at each row the line between the sample before and the one after.
        let samples: Vec<(i64, f64)> =
            rows.stamps_ns.iter().enumerate().map(|(k, at)| (at + 3 * MS, k as f64)).collect();
        let late = series("/mag", slot_of(SensorKind::Mag), &samples, 3);
        let table = joined([rows, late]);
        let column = &table.columns[slot_of(SensorKind::Mag)];
        assert!(column[0].is_nan());
        for (row, value) in column.iter().enumerate().skip(1) {
            assert!((value - (row as f64 - 0.3)).abs() < 1e-12, "{column:?}");
        }
        let text = table.warnings[0].to_string();
        assert!(text.contains("`/mag`: 4 of 5 samples") && text.contains("0.003"), "{text}");
    }

    #[test]
    fn nothing_is_placed_far_from_a_row_or_across_a_gap() {
        let mut rows = imu(6);
        let begin = rows.stamps_ns[0];
        // A second without rows, in which a sample falls.
        rows.stamps_ns[3..].iter_mut().for_each(|at| *at += 1000 * MS);
        let samples =
            [0, 10, 20, 500, 1035, 1045].map(|ms| (begin + ms * MS, if ms == 500 { 99.0 } else { 1.0 }));
        let table = joined([rows, series("/warm", TEMPERATURE, &samples, 1)]);
        let warm = &table.columns[TEMPERATURE];
        assert_eq!(&warm[..3], [1.0; 3]);
        assert!(warm[3..].iter().all(|value| value.is_nan() || *value == 1.0), "{warm:?}");
    }

    #[test]
    fn an_attitude_stays_one_between_two_samples_of_opposite_sign() {
        let rows = imu(3);
        let mut pose = Series::new("/pose".to_owned(), rows.stamps_ns.iter().map(|at| at - 5 * MS).collect());
        // A turn about z of 0.2 rad a sample, the second with the other sign.
        let turn = |k: f64, sign: f64| [sign * (0.1 * k).cos(), 0.0, 0.0, sign * (0.1 * k).sin()];
        let attitudes = [turn(0.0, 1.0), turn(1.0, -1.0), turn(2.0, 1.0)];
        pose.add(REFERENCE, (0..4).map(|part| attitudes.iter().map(|q| q[part]).collect()).collect());
        let table = joined([rows, pose]);
        for row in [0usize, 1] {
            let part = |at: usize| table.columns[REFERENCE + at][row];
            let angle = 2.0 * (part(3) / part(0)).atan();
            assert!((angle - 0.2 * (row as f64 + 0.5)).abs() < 1e-6, "{row}: {angle}");
            assert!(((0..4).map(|at| part(at).powi(2)).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn more_rows_than_the_limit_are_refused() {
        let limits = Limits { size: 100, ..Limits::default() };
        let error = join(Path::new("run.bag"), vec![imu(10)], &limits).unwrap_err().to_string();
        assert!(error.contains("run.bag") && error.contains("--max-size"), "{error}");
    }
}
