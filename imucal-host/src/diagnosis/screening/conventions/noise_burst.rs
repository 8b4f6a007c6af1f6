//! A stretch of larger noise: `P.noise_burst`, by a scan over all stretches.
//!
//! ```text
//! d_k = y_{k−2} − 4 y_{k−1} + 6 y_k − 4 y_{k+1} + y_{k+2}      variance 70 σ² in white noise
//! ```
//!
//! Fourth differences leave nothing of a movement. Their mean squares over windows of a second, without the largest
//! quarter lest a jump count as noise, each axis by its own median, are compared in logarithms; how much they scatter is
//! estimated from neighbouring windows. Where a movement makes noise of its own, only the windows at rest are asked. Of all stretches of windows the one is taken whose mean stands highest above that of the others,
//! and all stretches are counted in its probability. Its ends are then moved to the rows where the likelihood is
//! greatest.

use crate::recording::order_statistics::{mean_without_largest, std_of_median};
use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{Conventions, Finding, SURE};
use crate::recording::{SensorKind, Triple, check::integrity::SensorIntegrity, median};

const WEIGHTS: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Neighbouring differences are alike: so many of them count as one. 1 + 2 Σ ρ², with ρ = −56, 28, −8 and 1 of 70.
const ALIKE: f64 = 2.6265;
/// Standard deviation of the place of a change, in rows, times a row's information on it (Hinkley 1970: √26 of two means a
/// standard deviation apart, each row telling half a nat).
const CHANGE: f64 = 2.55;
/// Length of a window, s, and the rows it has at least.
const WINDOW: f64 = 1.0;
const ROWS: usize = 20;
/// Fewer windows say nothing.
const WINDOWS: usize = 20;
/// A movement makes no noise of its own where it is no more than this many times that of a rest, as mean squares.
const SAME: f64 = 1.25;
/// A gimbal turns above this rate, rad/s.
const STILL: f64 = 3e-3;

/// One axis' fourth difference squared, at a row.
struct Bend {
    row: usize,
    square: Vector3<f64>,
}

/// A second of a recording.
struct Window {
    bends: Range<usize>,
    moves: bool,
    /// ln of the mean square by its usual value, in standard deviations.
    level: f64,
}

/// A stretch of larger noise.
pub(crate) struct Burst {
    /// By what share the noise is larger, and the standard error of that.
    excess: (f64, f64),
    /// When it begins, s, and when it ends, with standard errors; `None` where it lasts to the recording's end.
    ends: [(Option<f64>, Option<f64>); 2],
    /// All stretches counted.
    p_value: f64,
    /// Its rows.
    pub(crate) rows: Range<usize>,
}

impl Burst {
    /// In one sensor. `moves` is the table's rate at a row, rad/s.
    pub(crate) fn find(
        time: &[f64],
        triple: &Triple,
        sensor: &SensorIntegrity,
        moves: &dyn Fn(usize) -> f64,
    ) -> Option<Self> {
        let fresh = fresh(triple, sensor);
        let interval = interval(time, &fresh)?;
        let bends = bends(time, &triple.values, &fresh, interval);
        let mut windows = windows(time, &bends, interval, moves);
        let usual = [false, true].map(|state| normalise(&bends, &mut windows, state));
        windows.retain(|window| window.level.is_finite());
        if let [Some(rest), Some(motion)] = usual
            && rest.iter().zip(motion.iter()).any(|(rest, motion)| *motion > SAME * rest)
            && windows.iter().filter(|window| !window.moves).count() >= WINDOWS
        {
            windows.retain(|window| !window.moves);
        }
        let stretch = scan(&windows)?;
        let (from, to) = (windows[stretch.from].bends.start, windows[stretch.to - 1].bends.end);
        let burst = Levels::of(&bends, from, to)?;
        // It began after the window before, and ended before the one behind.
        let before = stretch.from.checked_sub(1).map_or(0, |at| windows[at].bends.start);
        let behind = windows.get(stretch.to).map_or(bends.len(), |window| window.bends.end);
        let first = before..windows[stretch.from].bends.end;
        let last = windows[stretch.to - 1].bends.start..behind;
        let (from, to) = burst.ends(&bends, first, last);
        let burst = Levels::of(&bends, from, to)?;
        let excess = burst.ratio.sqrt() - 1.0;
        let material = crate::effect::find(&format!("{}.noise_burst", sensor.sensor))
            .and_then(|effect| effect.parameters.first().map(|p| p.material));
        if stretch.p_value > SURE || material.is_none_or(|material| excess < material) {
            return None;
        }
        let at = |bend: usize| bends.get(bend).and_then(|bend| time.get(bend.row)).copied();
        // A burst that lasts to the end of the recording has not ended.
        let end = if to < bends.len() { at(to) } else { None };
        let instant = Some(interval * (2.0 + CHANGE * ALIKE / burst.information()));
        Some(Self {
            excess: (excess, burst.excess_std()),
            ends: [(at(from), instant), (end, end.and(instant))],
            p_value: stretch.p_value,
            rows: bends.get(from)?.row..bends.get(to.checked_sub(1)?)?.row + 1,
        })
    }

    /// As an effect of the catalogue.
    pub(crate) fn finding(&self, kind: SensorKind) -> Option<Finding> {
        let (excess, std_error) = self.excess;
        let values = [(Some(excess), Some(std_error)), self.ends[0], self.ends[1]];
        Finding::new(&format!("{kind}.noise_burst"), &values, self.p_value)
    }

    /// How many times as large as elsewhere the noise is.
    pub(crate) fn times(&self) -> f64 {
        1.0 + self.excess.0
    }
}

/// Looks at one sensor on a table. `moves` is the table's rate at a row, rad/s.
pub(crate) fn check(
    time: &[f64],
    triple: &Triple,
    sensor: &SensorIntegrity,
    moves: &dyn Fn(usize) -> f64,
    found: &mut Conventions,
) {
    let burst = Burst::find(time, triple, sensor, moves);
    found.findings.extend(burst.and_then(|burst| burst.finding(sensor.sensor)));
}

/// Mean square noise of a sensor in some rows and in all others, by axis, without the largest quarters; `None` where either has too few.
pub(crate) fn inside_and_outside(
    time: &[f64],
    values: &[Vector3<f64>],
    taken: &[usize],
    rows: &Range<usize>,
) -> Option<[Vector3<f64>; 2]> {
    let bends = bends(time, values, taken, interval(time, taken)?);
    let (inside, outside): (Vec<Bend>, Vec<Bend>) =
        bends.into_iter().partition(|bend| rows.contains(&bend.row));
    (inside.len() >= ROWS && outside.len() >= ROWS).then(|| [trimmed(&inside), trimmed(&outside)])
}

/// The median interval of some rows, s.
fn interval(time: &[f64], rows: &[usize]) -> Option<f64> {
    median(rows.windows(2).map(|pair| time[pair[1]] - time[pair[0]]).collect())
}

/// Usable rows that do not repeat the one before them: a slow sensor or a stuck transport shows no noise there.
pub(crate) fn fresh(triple: &Triple, sensor: &SensorIntegrity) -> Vec<usize> {
    let rows = (1..triple.values.len()).filter(|row| triple.values[*row] != triple.values[row - 1]);
    rows.filter(|row| sensor.usable[*row]).collect()
}

fn bends(time: &[f64], values: &[Vector3<f64>], rows: &[usize], interval: f64) -> Vec<Bend> {
    let even = |rows: &&[usize]| (time[rows[4]] - time[rows[0]] - 4.0 * interval).abs() < 0.5 * interval;
    rows.windows(5)
        .filter(even)
        .map(|rows| {
            let bend: Vector3<f64> =
                rows.iter().zip(WEIGHTS).map(|(row, weight)| values[*row] * weight).sum();
            Bend { row: rows[2], square: bend.component_mul(&bend) / 70.0 }
        })
        .collect()
}

fn windows(time: &[f64], bends: &[Bend], interval: f64, moves: &dyn Fn(usize) -> f64) -> Vec<Window> {
    let length = f64::max(WINDOW, ROWS as f64 * interval);
    let mut windows = Vec::new();
    let mut from = 0;
    while from < bends.len() {
        let first = bends[from].row;
        let to = from + bends[from..].partition_point(|bend| time[bend.row] < time[first] + length);
        let (last, middle) = (bends[to - 1].row, bends[(from + to) / 2].row);
        // One with many rows missing would scatter more than the others.
        if (to - from) as f64 * interval >= 0.75 * length {
            let moves = [first, middle, last].into_iter().any(|row| moves(row) > STILL);
            windows.push(Window { bends: from..to, moves, level: f64::NAN });
        }
        from = to;
    }
    windows
}

/// Levels of the windows of one state, by their scatter; gives their usual mean squares, `None` of too few windows.
fn normalise(bends: &[Bend], windows: &mut [Window], moves: bool) -> Option<Vector3<f64>> {
    let mut own: Vec<&mut Window> = windows.iter_mut().filter(|window| window.moves == moves).collect();
    if own.len() < WINDOWS / 4 {
        return None;
    }
    let means: Vec<Vector3<f64>> =
        own.par_iter().map(|window| trimmed(&bends[window.bends.clone()])).collect();
    let usual = [0, 1, 2].map(|axis| median(means.iter().map(|mean| mean[axis]).collect()).unwrap_or(0.0));
    let level = |mean: &Vector3<f64>| {
        let shares = usual
            .iter()
            .zip(mean.iter())
            .filter(|(usual, _)| **usual > 0.0)
            .map(|(usual, mean)| mean / usual);
        let (sum, count) = shares.fold((0.0, 0.0), |(sum, count), share| (sum + share, count + 1.0));
        (sum / count).ln()
    };
    let levels: Vec<f64> = means.iter().map(level).collect();
    let steps: Vec<f64> = levels.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let rows = own.iter().map(|window| window.bends.len()).min().unwrap_or(1) as f64;
    let least = (2.0 * ALIKE / (3.0 * rows)).sqrt();
    let scatter = (std_of_median(steps).unwrap_or(0.0) / 2.0f64.sqrt()).max(least);
    for (window, level) in own.iter_mut().zip(levels) {
        window.level = level / scatter;
    }
    Some(Vector3::from(usual))
}

/// Mean squares without the largest quarter.
fn trimmed(bends: &[Bend]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| mean_without_largest(bends.iter().map(|bend| bend.square[axis]).collect(), 4))
}

/// A stretch of windows.
struct Stretch {
    from: usize,
    to: usize,
    p_value: f64,
}

/// The stretch that stands out most, all stretches counted.
fn scan(windows: &[Window]) -> Option<Stretch> {
    let count = windows.len();
    if count < WINDOWS {
        return None;
    }
    let mut sums = vec![0.0];
    for window in windows {
        sums.push(sums.last().copied().unwrap_or(0.0) + window.level);
    }
    let total = sums[count];
    let mut best = (0.0, 0, 0);
    for from in 0..count {
        for to in from + 1..=count.min(from + count - 1) {
            let inside = (to - from) as f64;
            let outside = count as f64 - inside;
            let sum = sums[to] - sums[from];
            let contrast = (sum / inside - (total - sum) / outside) / (1.0 / inside + 1.0 / outside).sqrt();
            if contrast > best.0 {
                best = (contrast, from, to);
            }
        }
    }
    let normal = Normal::standard();
    let stretches = 0.5 * count as f64 * (count as f64 + 1.0);
    Some(Stretch { from: best.1, to: best.2, p_value: (stretches * normal.sf(best.0)).min(1.0) })
}

/// Noise inside and outside of a stretch of bends.
struct Levels {
    outside: Vector3<f64>,
    ratio: f64,
    rows: [f64; 2],
}

impl Levels {
    fn of(bends: &[Bend], from: usize, to: usize) -> Option<Self> {
        let sum = |part: &[Bend]| part.iter().map(|bend| bend.square).sum::<Vector3<f64>>();
        let inside = sum(bends.get(from..to)?) / (to - from) as f64;
        let rows = (bends.len() - (to - from)) as f64;
        let outside = (sum(&bends[..from]) + sum(&bends[to..])) / rows;
        let axes: Vec<f64> = inside
            .iter()
            .zip(outside.iter())
            .filter(|(_, outside)| **outside > 0.0)
            .map(|(i, o)| i / o)
            .collect();
        let ratio = axes.iter().sum::<f64>() / axes.len() as f64;
        (ratio > 1.0 && ratio.is_finite()).then_some(Self {
            outside,
            ratio,
            rows: [(to - from) as f64, rows],
        })
    }

    fn excess_std(&self) -> f64 {
        let squares: f64 = self.rows.iter().map(|rows| ALIKE / (6.0 * rows)).sum();
        self.ratio.sqrt() * squares.sqrt()
    }

    /// A row's information on which side of an end it is, nats: the lesser of the two divergences.
    fn information(&self) -> f64 {
        let log = self.ratio.ln();
        1.5 * f64::min(self.ratio - 1.0 - log, 1.0 / self.ratio - 1.0 + log)
    }

    /// −2 ln likelihood of a bend inside less that outside, but for a constant.
    fn against(&self, bend: &Bend) -> f64 {
        let axes = bend.square.iter().zip(self.outside.iter()).filter(|(_, outside)| **outside > 0.0);
        axes.map(|(square, outside)| self.ratio.ln() - square / outside * (1.0 - 1.0 / self.ratio)).sum()
    }

    /// Ends at the rows of these ranges where the likelihood is greatest.
    fn ends(&self, bends: &[Bend], first: Range<usize>, last: Range<usize>) -> (usize, usize) {
        let middle = (first.end + last.start) / 2;
        let best = |low: usize, high: usize, sign: f64| {
            let (mut sum, mut least, mut place) = (0.0, 0.0, low);
            for (at, bend) in bends.iter().enumerate().take(high).skip(low) {
                // Each bend left out of the burst at its beginning, or taken into it at its end.
                sum += sign * self.against(bend);
                if sum < least {
                    (least, place) = (sum, at + 1);
                }
            }
            place
        };
        let from = best(first.start, first.end.min(middle), -1.0);
        let to = best(last.start.max(middle), last.end, 1.0);
        (from, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    #[test]
    fn in_even_noise_a_small_probability_is_no_more_frequent_than_it_says() {
        let mut random = Random::new(8, Purpose::Noise);
        let runs = 400;
        let alarms = (0..runs).filter(|_| {
            let level = |_| Window { bends: 0..1, moves: false, level: random.normal() };
            let windows: Vec<Window> = (0..150).map(level).collect();
            scan(&windows).unwrap().p_value < 0.05
        });
        // 20 are expected at most; 30 would be 2.3 standard deviations more.
        let count = alarms.count();
        assert!(count < 30, "{count} of {runs}");
    }
}
