//! Rest detection: stretches in which the accelerometer shows its own noise and nothing else.
//!
//! A window's variance (sum over axes) is compared with a multiple of that of the initial rest; the multiple is
//! swept, since no single one suits every hand and table. A rest is a run of window centres below the threshold,
//! so it ends about half a window before the motion begins and holds none of it. Where the recording itself begins or
//! ends, windows are cut short: half a window is left out there if its mean is not that of the rest, since a motion
//! has begun in it or not yet ended. Source: Tedaldi, Pretto & Menegatti 2014 (ICRA), section IV; the gyroscope's part,
//! the recording's ends and the fallback without an initial rest are ours.

use std::ops::Range;

use imucal_core::{
    observation::{Moments, Rest},
    observer::rest::{NOISIEST, SWINGING},
};
use nalgebra::Vector3;

use super::windowed::{USABLE_SHARE, Window, density, windows};
use crate::recording::{Series, median, order_statistics::MEDIAN_SIZE};

/// Window of the variance, s: long against vibration, short against a rest.
pub const WINDOW: f64 = 1.0;
/// The initial rest is looked for in this much of the recording, s.
const INITIAL: f64 = 3.0;
/// A rest lasts at least this long, s.
pub const SHORTEST: f64 = 1.0;
/// A mean rate this many robust standard deviations of the rests' from their median is a slow turn, or creep.
const TURNING: f64 = 6.0;
/// The rate allowed at rest is never below nor above these, rad/s (0.9 to 3°/s): hands tremble, biases wander.
const TURNING_LIMITS: (f64, f64) = (0.015, 0.052);
/// The initial stretch counts as a rest unless it is this many times noisier than the quietest tenth.
const INITIAL_EXCESS: f64 = 8.0;
/// A gyroscope whose usual variance at rest, so many times, is above that of a swing is noisy.
const NOISY: f64 = 4.0;
/// Rows further apart than this are single shots, each a rest of its own, s.
const SHOT_INTERVAL: f64 = 0.2;
/// At an end of the recording a motion shows where the mean of some last rows is this many of its standard deviations
/// from that of the rest: one row in 10⁵ of white noise.
const MOVES: f64 = 3.0;

/// What rest detection looks at; all of equal length, with one time.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// Accelerometer, nominal m/s².
    pub acc: Series<'a>,
    /// Gyroscope, nominal rad/s.
    pub gyr: Option<Series<'a>>,
    /// Temperature, °C.
    pub temperature: Option<&'a [f64]>,
}

/// Windowed variances of a recording and the noise of its initial rest: made once, cut at any threshold.
#[derive(Clone, Debug)]
pub struct RestDetector<'a> {
    samples: Samples<'a>,
    /// Variance of the window around each row, (m/s²)²; infinite where too little of it is usable.
    variance: Vec<f64>,
    /// Rates of the window around each row, rad/s.
    rate: Option<Vec<Window>>,
    /// Variance of the reference rest, (m/s²)².
    noise: f64,
    /// The reference is the initial rest, not the quietest stretch.
    from_initial: bool,
    interval: f64,
    /// Rows to each side of a window's centre.
    half: usize,
}

/// Rests found at one threshold, as half-open row ranges in time order.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation {
    /// Multiple of the reference variance.
    pub multiplier: f64,
    /// The threshold, (m/s²)².
    pub threshold: f64,
    /// Rows of each rest.
    pub rests: Vec<Range<usize>>,
}

impl<'a> RestDetector<'a> {
    /// Looks at a recording with the given usual interval, s.
    pub fn new(samples: Samples<'a>, interval: f64) -> Self {
        let half = ((WINDOW / 2.0 / interval).round() as usize).max(1);
        let rates = |gyr: Series<'_>| {
            // What is clipped turns, and what is stuck shows no turn: both say so.
            let usable: Vec<bool> =
                gyr.values.iter().map(|rate| rate.iter().all(|x| x.is_finite())).collect();
            windows(Series { usable: &usable, ..gyr }, half, interval, |window| window)
        };
        let (variance, rate) = rayon::join(
            || windows(samples.acc, half, interval, |window| window.variance),
            || samples.gyr.map(rates),
        );
        let (noise, from_initial) = reference_noise(&variance, (INITIAL / interval).round() as usize, half);
        Self { samples, variance, rate, noise, from_initial, interval, half }
    }

    /// Rows are single shots, seconds apart, each taken at rest.
    pub fn is_shots(&self) -> bool {
        self.interval > SHOT_INTERVAL
    }

    /// Variance of the reference rest, (m/s²)²; whether it is the initial rest rather than the quietest stretch.
    pub fn noise(&self) -> (f64, bool) {
        (self.noise, self.from_initial)
    }

    /// The rests at a multiple of the reference variance.
    pub fn cut(&self, multiplier: f64) -> Segmentation {
        let threshold = (multiplier * self.noise).min(NOISIEST);
        let rests = if self.is_shots() { self.shots() } else { self.of_both(self.runs(threshold)) };
        Segmentation { multiplier, threshold, rests }
    }

    fn shots(&self) -> Vec<Range<usize>> {
        let Samples { acc, gyr, .. } = self.samples;
        let usable = |k: &usize| acc.usable[*k] && gyr.is_none_or(|gyr| gyr.usable[*k]);
        (0..acc.time.len()).filter(usable).map(|k| k..k + 1).collect()
    }

    /// Those in which the gyroscope is usable; all where it is in none.
    fn of_both(&self, rests: Vec<Range<usize>>) -> Vec<Range<usize>> {
        let Some(gyr) = self.samples.gyr else { return rests };
        let least = USABLE_SHARE * density(gyr, self.interval);
        let measured = |rest: &&Range<usize>| {
            let usable = gyr.usable[(*rest).clone()].iter().filter(|usable| **usable).count();
            usable as f64 >= least * rest.len() as f64
        };
        let both: Vec<_> = rests.iter().filter(measured).cloned().collect();
        if both.is_empty() { rests } else { both }
    }

    fn runs(&self, threshold: f64) -> Vec<Range<usize>> {
        let mut quiet: Vec<bool> = self.variance.iter().map(|v| *v <= threshold).collect();
        if let Some(rate) = &self.rate {
            quiet.iter_mut().zip(rate).for_each(|(still, window)| *still &= window.variance.is_finite());
            quiet = without_turning(without_swings(quiet, rate, self.half), rate);
        }
        let mut rests = Vec::new();
        let mut begin = None;
        for k in 0..=quiet.len() {
            let still = quiet.get(k).copied().unwrap_or(false);
            match (still, begin) {
                (true, None) => begin = Some(k),
                (false, Some(first)) => {
                    begin = None;
                    let rest = self.without_cut_motion(first..k);
                    if self.time(rest.end - 1) - self.time(rest.start) >= SHORTEST {
                        rests.push(rest);
                    }
                }
                _ => {}
            }
        }
        rests
    }

    /// A rest without the half window at an end of the recording in which a motion begins or ends: the windows there are
    /// cut short, and too few rows of it are in them to show.
    fn without_cut_motion(&self, rest: Range<usize>) -> Range<usize> {
        let Range { mut start, mut end } = rest;
        if end == self.samples.acc.time.len() && end - start > 2 * self.half {
            let (inside, last) = (start..end - self.half, (end - self.half..end).rev());
            if self.departs(inside.clone(), last) {
                end = inside.end;
            }
        }
        if start == 0 && end > 2 * self.half {
            let (inside, first) = (self.half..end, 0..self.half);
            if self.departs(inside.clone(), first) {
                start = inside.start;
            }
        }
        start..end
    }

    /// The mean of the outermost of some rows, however many, is not that of the rows `inside`; `from_end` are those rows
    /// from the outermost inwards.
    fn departs(&self, inside: Range<usize>, from_end: impl Iterator<Item = usize> + Clone) -> bool {
        [Some(self.samples.acc), self.samples.gyr].into_iter().flatten().any(
            |Series { values, usable, .. }| {
                let usable = |row: &usize| usable[*row];
                let mut still = Moments::default();
                inside.clone().filter(usable).for_each(|row| still.push(&values[row]));
                let (mean, variance, rows) = (still.mean(), still.variance().sum(), f64::from(still.count()));
                let (mut sum, mut count) = (Vector3::zeros(), 0.0);
                from_end.clone().filter(usable).any(|row| {
                    (sum, count) = (sum + (values[row] - mean), count + 1.0);
                    (sum / count).norm_squared() > MOVES * MOVES * variance * (1.0 / count + 1.0 / rows)
                })
            },
        )
    }

    /// Moments of a rest.
    pub fn rest(&self, rows: &Range<usize>) -> Rest<f64> {
        let mut rest = Rest {
            time: 0.5 * (self.time(rows.start) + self.time(rows.end - 1)),
            temperature: self.samples.temperature.map_or(f64::NAN, |t| mean_of_measured(&t[rows.clone()])),
            ..Rest::default()
        };
        let of = |Series { values, usable, .. }: Series<'_>, moments: &mut Moments<f64>| {
            rows.clone().filter(|k| usable[*k]).for_each(|k| moments.push(&values[k]));
        };
        of(self.samples.acc, &mut rest.acc);
        if let Some(gyr) = self.samples.gyr {
            of(gyr, &mut rest.gyr);
        }
        rest
    }

    fn time(&self, row: usize) -> f64 {
        self.samples.acc.time[row]
    }
}

fn mean_of_measured(values: &[f64]) -> f64 {
    let (sum, count) =
        values.iter().filter(|v| v.is_finite()).fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
    sum / f64::from(count)
}

/// Cuts out what swings about the vertical and comes back within a window. Less than a window of it is where a motion begins or ends.
/// A gyroscope may be so noisy that it always seems to swing.
fn without_swings(mut quiet: Vec<bool>, rate: &[Window], half: usize) -> Vec<bool> {
    let at_rest = quiet.iter().zip(rate).filter(|(still, _)| **still);
    let usual = median(at_rest.map(|(_, window)| window.variance).step_by(10).collect());
    let limit = (SWINGING * SWINGING).max(NOISY * usual.unwrap_or(0.0));
    let swings: Vec<bool> =
        quiet.iter().zip(rate).map(|(still, window)| *still && window.variance > limit).collect();
    let mut row = 0;
    for alike in swings.chunk_by(|a, b| a == b) {
        let rows = row..row + alike.len();
        row = rows.end;
        if alike[0] && rows.len() > 2 * half {
            quiet[rows].fill(false);
        }
    }
    quiet
}

/// Cuts out what turns so smoothly that the accelerometer does not notice: about the vertical, or creeping.
fn without_turning(quiet: Vec<bool>, rate: &[Window]) -> Vec<bool> {
    // Windows overlap, so every tenth says as much as all.
    let chosen: Vec<&Vector3<f64>> =
        quiet.iter().zip(rate).filter(|(still, _)| **still).map(|(_, w)| &w.mean).step_by(10).collect();
    let of_axis = |value: &dyn Fn(&Vector3<f64>) -> f64| median(chosen.iter().map(|w| value(w)).collect());
    let bias = Vector3::from_fn(|axis, _| of_axis(&|w| w[axis]).unwrap_or(0.0));
    let spread = of_axis(&|w| (w - bias).norm()).unwrap_or(0.0) / MEDIAN_SIZE;
    let limit = (TURNING * spread).clamp(TURNING_LIMITS.0, TURNING_LIMITS.1);
    let limit = limit * limit;
    quiet.iter().zip(rate).map(|(still, w)| *still && (w.mean - bias).norm_squared() <= limit).collect()
}

/// Variance of the initial rest, or of the quietest tenth where the recording does not begin at rest.
fn reference_noise(variance: &[f64], initial_rows: usize, half: usize) -> (f64, bool) {
    let finite: Vec<f64> = variance.iter().copied().filter(|v| v.is_finite()).collect();
    if finite.is_empty() {
        return (0.0, false);
    }
    let initial = variance.get(half..initial_rows.max(half + 1).min(variance.len())).unwrap_or(&finite);
    let initial = median(initial.to_vec()).unwrap_or(f64::INFINITY);
    let mut sorted = finite;
    let tenth = sorted.len() / 10;
    let quietest = *sorted.select_nth_unstable_by(tenth, f64::total_cmp).1;
    if initial <= INITIAL_EXCESS * quietest { (initial, true) } else { (quietest, false) }
}

/// Spread of a rest's mean that its own samples explain, per axis.
pub fn mean_std(moments: &Moments<f64>) -> Vector3<f64> {
    moments.variance().map(|v| (v / f64::from(moments.count().max(1))).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.01;

    fn samples<'a>(
        time: &'a [f64],
        acc: &'a [Vector3<f64>],
        gyr: Option<&'a [Vector3<f64>]>,
        usable: &'a [bool],
    ) -> Samples<'a> {
        let series = |values| Series { time, values, usable, interval: DT };
        Samples { acc: series(acc), gyr: gyr.map(series), temperature: None }
    }

    /// 4 s at rest, 2 s of shaking, 4 s at rest.
    fn shaken() -> (Vec<f64>, Vec<Vector3<f64>>) {
        (0..1000)
            .map(|k| {
                let noise = if k % 2 == 0 { 0.01 } else { -0.01 };
                let shake = if (400..600).contains(&k) { (k as f64 * 0.3).sin() } else { 0.0 };
                (k as f64 * DT, Vector3::new(noise + shake, noise, 9.8 - noise))
            })
            .unzip()
    }

    #[test]
    fn two_rests_around_a_motion_are_found_and_hold_none_of_it() {
        let (time, acc) = shaken();
        let usable = vec![true; time.len()];
        let samples = samples(&time, &acc, None, &usable);
        let cut = RestDetector::new(samples, DT).cut(4.0);
        assert_eq!(cut.rests.len(), 2, "{cut:?}");
        assert!(cut.rests[0].end <= 400 && cut.rests[1].start >= 600);
        assert!(cut.rests[0].len() > 300 && cut.rests[1].len() > 300);
    }

    #[test]
    fn a_rest_holds_none_of_a_motion_that_an_end_of_the_recording_cuts() {
        // A turn that speeds up from 0 rad/s: 0.06 rad/s where the recording ends, 0.1 s into it.
        let turning = |t: f64| 6.0 * t * t.max(0.0);
        let noise = |k: usize| 1e-3 * (0.7 * (k * k) as f64).sin();
        let acc: Vec<_> =
            (0..600).map(|k| Vector3::new(noise(k), noise(k + 3), 9.8 + noise(k + 9))).collect();
        let still: Vec<_> =
            (0..600).map(|k| Vector3::new(noise(k + 1), noise(k + 5), noise(k + 7))).collect();
        let time: Vec<f64> = (0..600).map(|k| k as f64 * DT).collect();
        let usable = vec![true; 600];
        let rests = |gyr: &[Vector3<f64>]| {
            let samples = samples(&time, &acc, Some(gyr), &usable);
            RestDetector::new(samples, DT).cut(4.0).rests
        };
        assert_eq!(rests(&still), std::slice::from_ref(&(0..600)));
        let moved = |since: &dyn Fn(usize) -> f64| -> Vec<_> {
            (0..600).map(|k| still[k] + Vector3::y() * turning(since(k))).collect()
        };
        assert_eq!(rests(&moved(&|k| DT * (k as f64 - 590.0))), std::slice::from_ref(&(0..550)));
        assert_eq!(rests(&moved(&|k| DT * (10.0 - k as f64))), std::slice::from_ref(&(50..600)));
    }

    #[test]
    fn a_smooth_turn_about_the_vertical_is_no_rest() {
        let (time, mut acc) = shaken();
        acc.iter_mut()
            .enumerate()
            .for_each(|(k, a)| *a = Vector3::new(0.01 * f64::from(k as u8 % 2), 0.0, 9.8));
        let gyr: Vec<_> = (0..1000)
            .map(|k| {
                if (400..600).contains(&k) {
                    Vector3::new(0.1, 0.1, 1.0)
                } else {
                    Vector3::new(0.1, 0.1, 0.1)
                }
            })
            .collect();
        let usable = vec![true; time.len()];
        let samples = samples(&time, &acc, Some(&gyr), &usable);
        let cut = RestDetector::new(samples, DT).cut(4.0);
        assert_eq!(cut.rests.len(), 2, "{cut:?}");
    }

    #[test]
    fn a_swing_about_the_vertical_is_no_rest_and_a_noisy_gyroscope_has_rests() {
        let time: Vec<f64> = (0..1200).map(|k| k as f64 * DT).collect();
        let noise = |k: usize| (0.7 * (k * k) as f64).sin();
        let acc: Vec<_> = (0..1200)
            .map(|k| Vector3::new(noise(k), noise(k + 3), noise(k + 9)) * 1e-3 + Vector3::z() * 9.8)
            .collect();
        let usable = vec![true; 1200];
        let rests = |rate: &dyn Fn(usize) -> f64| {
            let gyr: Vec<_> = (0..1200).map(|k| Vector3::new(0.1, 0.1, 0.1 + rate(k))).collect();
            let samples = samples(&time, &acc, Some(&gyr), &usable);
            RestDetector::new(samples, DT).cut(4.0).rests
        };
        // Once a second: its mean over a window is that of a rest.
        let swing = |k: usize| {
            if (400..800).contains(&k) { (k as f64 * DT * std::f64::consts::TAU).sin() } else { 0.0 }
        };
        let found = rests(&swing);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].end <= 400 && found[1].start >= 800, "{found:?}");
        let noisy = |k: usize| if k.is_multiple_of(2) { 0.3 } else { -0.3 };
        assert_eq!(rests(&noisy), std::slice::from_ref(&(0..1200)));
    }

    #[test]
    fn a_gap_or_a_clipped_stretch_ends_a_rest_and_dropouts_do_not() {
        let (mut time, mut acc) = shaken();
        time.iter_mut().skip(200).for_each(|t| *t += 1.0);
        let mut usable = vec![true; time.len()];
        usable[780..820].fill(false);
        for k in (10..700).step_by(40) {
            usable[k] = false;
            acc[k] = Vector3::repeat(f64::NAN);
        }
        let samples = samples(&time, &acc, None, &usable);
        let cut = RestDetector::new(samples, DT).cut(4.0);
        assert!(cut.rests.iter().any(|rows| [10, 50, 90].iter().all(|k| rows.contains(k))), "{cut:?}");
        assert!(cut.rests.iter().all(|rows| !rows.contains(&800)));
        assert!(cut.rests.iter().all(|rows| !rows.contains(&199) || !rows.contains(&200)));
    }
}
