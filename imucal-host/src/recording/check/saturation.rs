//! Stretches in which an axis is at its limit.

use std::{cell::OnceCell, ops::Range};

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::recording::{order_statistics::median, triple::Triple, unit::Unit};

/// Consecutive rows of one axis at a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Saturation {
    /// Axis, 0 to 2 for x to z.
    pub axis: usize,
    /// Rows.
    pub rows: Range<usize>,
    /// The value of the first of them, m/s², rad/s or µT.
    pub value: f64,
    /// Whether it is the manifest's full scale; else the limit was estimated from the samples or the
    /// converter's width.
    pub declared: bool,
}

/// How near to the full scale counts as being there.
const NEAR: f64 = 1e-3;
/// An axis at its extreme for so many rows while another one moves …
const LONG: usize = 10;
/// … and so many times longer than it ever stays at another value is clipped.
const LONGER: usize = 3;
/// A run that is entered and left in steps of so many usual ones is clipped too, if it has this length.
const STEEP: f64 = 8.0;
const SHORT: usize = 3;
/// Least number of rows at the extreme.
const PILE: usize = 5;
/// A pile at the extreme is a clip if noise would make it less often than this.
const UNLIKELY: f64 = 1e-9;
/// Least number of stretches at other values; an axis with fewer says nothing about itself.
const WITNESSES: usize = 10;

/// Saturated stretches of all axes, in order of axis and row.
pub(crate) fn find(triple: &Triple) -> Vec<Saturation> {
    (0..3).into_par_iter().flat_map_iter(|axis| AxisSamples::new(triple, axis).saturated()).collect()
}

/// One axis in SI units.
struct AxisSamples<'a> {
    triple: &'a Triple,
    axis: usize,
    values: Vec<f64>,
    /// Found when they are first asked for: of noise an extreme is seldom seen often enough.
    runs: OnceCell<Vec<Range<usize>>>,
}

impl<'a> AxisSamples<'a> {
    fn new(triple: &'a Triple, axis: usize) -> Self {
        let values: Vec<f64> = triple.values.iter().map(|value| value[axis]).collect();
        Self { triple, axis, values, runs: OnceCell::new() }
    }

    fn runs(&self) -> &[Range<usize>] {
        self.runs.get_or_init(|| runs(&self.values))
    }

    fn saturated(&self) -> Vec<Saturation> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in self.values.iter().copied().filter(|value| value.is_finite()) {
            (low, high) = (if value < low { value } else { low }, if value > high { value } else { high });
        }
        if low >= high {
            return Vec::new();
        }
        // Counted first: most extremes are those of noise.
        let piles = |extreme: f64| self.values.iter().filter(|value| **value == extreme).count() >= PILE;
        let clipped = |extreme| {
            self.is_limit(extreme)
                || (piles(extreme) && (self.is_clipped(extreme, [low, high]) || self.is_piled(extreme)))
        };
        let (clipped_low, clipped_high) = (clipped(low), clipped(high));
        let full_scale = self.triple.full_scale_si().map(|scale| scale * (1.0 - NEAR));
        let declared = |value: f64| full_scale.is_some_and(|scale| value.abs() >= scale);
        if !(clipped_low || clipped_high || declared(low) || declared(high)) {
            return Vec::new();
        }
        let at_limit =
            |value: f64| declared(value) || (clipped_low && value == low) || (clipped_high && value == high);
        let stretches = stretches(&self.values, at_limit);
        stretches
            .into_iter()
            .map(|rows| {
                let value = self.values[rows.start];
                Saturation { axis: self.axis, rows, value, declared: declared(value) }
            })
            .collect()
    }

    /// Whether a value is the end of a sixteen-bit converter's range.
    fn is_limit(&self, si: f64) -> bool {
        if self.triple.unit != Unit::Counts {
            return false;
        }
        let raw = self.triple.nominal.to_raw(si).round();
        let signed = self.triple.nominal.offset.abs() < 16384.0;
        if signed { raw == -32768.0 || raw == 32767.0 } else { raw == 65535.0 }
    }

    /// Whether an extreme is a clip and not where a quantised rest happens to lie.
    fn is_clipped(&self, extreme: f64, extremes: [f64; 2]) -> bool {
        let at = |run: &&Range<usize>| self.values[run.start] == extreme;
        let inner =
            || self.runs().iter().filter(|run| !extremes.contains(&self.values[run.start])).map(Range::len);
        if inner().count() < WITNESSES {
            return false;
        }
        let longest_inner = inner().max().unwrap_or(1);
        let usual = median(inner().map(|length| length as f64).collect()).unwrap_or(1.0) as usize;
        let step = self.usual_step();
        self.runs().iter().filter(at).any(|run| {
            let stays = run.len() >= LONG.max(LONGER * longest_inner) && self.others_move(run);
            let steep = run.len() >= SHORT * usual.max(1) && run.len() >= SHORT && self.is_steep(run, step);
            stays || steep
        })
    }

    /// Whether more rows are at an extreme than its neighbours would let fall there, while other axes move.
    fn is_piled(&self, extreme: f64) -> bool {
        let others_move = |row: usize| {
            let here = &self.triple.values[row];
            let differs =
                |near: &Vector3<f64>| (0..3).any(|axis| axis != self.axis && near[axis] != here[axis]);
            let neighbours = [row.checked_sub(1), Some(row + 1)].into_iter().flatten();
            neighbours.filter_map(|row| self.triple.values.get(row)).any(differs)
        };
        let at = || (0..self.values.len()).filter(|row| self.values[*row] == extreme);
        let moving = at().filter(|row| others_move(*row)).count();
        2 * moving > at().count() && pile_chance(&self.values, extreme) < UNLIKELY
    }

    /// Median size of the steps this axis makes.
    fn usual_step(&self) -> f64 {
        let steps = self.values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        median(steps.filter(|step| *step > 0.0).collect()).unwrap_or(f64::INFINITY)
    }

    fn is_steep(&self, run: &Range<usize>, step: f64) -> bool {
        let extreme = self.values[run.start];
        let side = |row: Option<usize>| {
            let value = row.and_then(|row| self.values.get(row));
            value.is_some_and(|value| (value - extreme).abs() > STEEP * step)
        };
        side(run.start.checked_sub(1)) && side(Some(run.end))
    }

    /// Whether another axis changes in these rows; if none does, the sensor is stuck, not clipped.
    fn others_move(&self, run: &Range<usize>) -> bool {
        let rows = &self.triple.values[run.clone()];
        (0..3).filter(|axis| *axis != self.axis).any(|axis| {
            rows.windows(2).filter(|pair| pair[0][axis] != pair[1][axis]).count() >= run.len() / 4
        })
    }
}

/// Probability that as many values are equal to an extreme as are, by how near as many others come to it and the smallest
/// step between any two.
pub(crate) fn pile_chance(values: &[f64], extreme: f64) -> f64 {
    // Counted before anything is sorted: most extremes are those of noise.
    if values.iter().filter(|value| **value == extreme).count() < PILE {
        return 1.0;
    }
    let mut off: Vec<f64> =
        values.iter().map(|value| (value - extreme).abs()).filter(|o| o.is_finite()).collect();
    off.sort_unstable_by(f64::total_cmp);
    let piled = off.partition_point(|off| *off == 0.0);
    if off.len() < 2 * piled {
        return 1.0;
    }
    let steps = off.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0);
    let expected = piled as f64 * steps.fold(f64::INFINITY, f64::min) / off[2 * piled - 1];
    // Of a Poisson distribution's upper tail the first term, which is more than the tail where less than one is expected.
    (1..=piled).fold(1.0, |chance, k| chance * expected / k as f64).min(1.0)
}

/// Maximal stretches of one value.
fn runs(values: &[f64]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (row, value) in values.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if run.end == row && values[run.start] == *value => run.end += 1,
            _ if value.is_finite() => runs.push(row..row + 1),
            _ => {}
        }
    }
    runs
}

/// Maximal stretches of values for which something holds.
fn stretches(values: &[f64], holds: impl Fn(f64) -> bool) -> Vec<Range<usize>> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for (row, value) in values.iter().enumerate() {
        if holds(*value) {
            match stretches.last_mut() {
                Some(stretch) if stretch.end == row => stretch.end += 1,
                _ => stretches.push(row..row + 1),
            }
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::triple::Nominal;

    fn triple(values: Vec<Vector3<f64>>) -> Triple {
        Triple {
            values,
            unit: Unit::RadianPerSecond,
            nominal: Nominal::IDENTITY,
            full_scale: None,
            single: false,
        }
    }

    /// Integers −2 to 2, much alike at each call.
    fn noise(row: usize) -> f64 {
        ((row * 2_654_435_761) >> 7) as f64 % 5.0 - 2.0
    }

    /// A turn of the given height about x, with noise, clipped at `limit`.
    fn turning(limit: f64) -> Triple {
        let x = |row: usize| ((row as f64 * 0.02).sin() * 1000.0 + noise(row)).clamp(-limit, limit);
        triple((0..2000).map(|row| Vector3::new(x(row), noise(row + 7), noise(row + 13))).collect())
    }

    #[test]
    fn a_slow_signal_flat_at_its_extreme_is_clipped() {
        let found = find(&turning(800.0));
        assert!(found.len() > 10 && found.iter().all(|each| each.axis == 0 && each.value.abs() == 800.0));
        assert!(found.iter().all(|each| !each.declared && each.rows.len() > 20), "{found:?}");
        assert!(find(&turning(2000.0)).is_empty());
    }

    #[test]
    fn a_spike_cut_flat_is_clipped_although_it_is_short() {
        let mut values: Vec<_> = (0..500).map(|row| Vector3::new(noise(row), noise(row + 3), 0.0)).collect();
        values[200..206].fill(Vector3::new(500.0, 3.0, 1.0));
        let found = find(&triple(values));
        assert_eq!((found[0].axis, found[0].rows.clone()), (0, 200..206));
    }

    #[test]
    fn peaks_that_are_cut_at_single_samples_pile_up() {
        let x = |row: usize| ((row as f64).sin() * 1000.0 + noise(row)).round();
        let cut = |limit: f64| -> Triple {
            let row = |row: usize| Vector3::new(x(row).clamp(-limit, limit), noise(row + 7), noise(row + 13));
            triple((0..500).map(row).collect())
        };
        let found = find(&cut(970.0));
        assert!(found.iter().all(|each| each.axis == 0 && each.rows.len() < 3), "{found:?}");
        assert!(found.len() > 20, "{found:?}");
        assert!(find(&cut(2000.0)).is_empty());
        let mut last_moves = cut(970.0);
        last_moves.values.iter_mut().for_each(|value| value.y = 0.0);
        assert_eq!(find(&last_moves).iter().filter(|each| each.axis == 0).count(), found.len());
        // Nothing else moves: the same attitude, held again and again.
        let still = |row: usize| {
            Vector3::new(if row.is_multiple_of(9) { 1000.0 } else { x(row).min(900.0) }, 1.0, 2.0)
        };
        assert!(find(&triple((0..500).map(still).collect())).is_empty());
    }

    #[test]
    fn a_quantised_rest_on_the_extreme_is_not_clipped() {
        let coarse = |row: usize| if noise(row / 9) > 1.0 { 1.0 } else { 0.0 };
        let values = (0..3000).map(|row| Vector3::new(coarse(row), noise(row), noise(row + 1))).collect();
        assert!(find(&triple(values)).is_empty());
        assert!(find(&triple(vec![Vector3::new(1.0, 2.0, 3.0); 100])).is_empty());
    }

    #[test]
    fn the_declared_full_scale_counts_within_a_thousandth() {
        let mut clipped = turning(2000.0);
        clipped.full_scale = Some(1000.0);
        let found = find(&clipped);
        assert!(!found.is_empty() && found.iter().all(|each| each.declared && each.value.abs() >= 999.0));
    }

    #[test]
    fn the_ends_of_a_sixteen_bit_converter_are_limits() {
        let mut values: Vec<_> = (0..100).map(|row| Vector3::repeat(noise(row))).collect();
        values[50].x = 32767.0;
        values[60].y = -32767.0;
        let mut counts = triple(values);
        counts.unit = Unit::Counts;
        let found = find(&counts);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].axis, found[0].rows.clone()), (0, 50..51));
    }
}
