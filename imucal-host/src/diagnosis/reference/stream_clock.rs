//! How the clock of a simulator's stream stands to that of the sensor, roughly: by the lag at which the size of what both
//! sense agrees best.
//!
//! Sizes do not depend on how the sensor is mounted. The lag is looked for over the whole recording first, then within
//! windows, and a line through the lags of the windows gives the rate. What is left is small enough for the fit, which is
//! linear in it.

use nalgebra::Vector3;

use super::{
    binned::Binned,
    clock_confirmation::confirmed,
    clock_steadiness::{Steadiness, steadiness},
    rate_lags::Rates,
};
use crate::{
    recording::{Recording, SensorKind, Stream, check::integrity::Integrity, median},
    simulator::streamed::StreamClock,
};

/// Step of the first search, s; longer where there would be more than [`MOST`] steps.
const STEP: f64 = 0.1;
const MOST: f64 = 6000.0;
/// The shorter of two streams has at least so many steps.
const FINEST: f64 = 200.0;
/// Step of the search within windows, s.
const FINE: f64 = 0.02;
/// Bins of the samples by which the clock's steadiness is judged, s.
const BIN: f64 = 0.01;
/// Length of a window, s; how far about the line it is searched in each round, s.
const WINDOW: f64 = 12.0;
const ROUNDS: [f64; 3] = [2.0, 0.5, 0.1];
/// Streams that share less than this, s, or less than this share of the shorter one, do not overlap.
const LEAST: f64 = 20.0;
const SHARED: f64 = 0.25;
/// Least correlation of two sizes that belong together, over all and within a window.
const FOLLOWS: f64 = 0.5;
const LOCAL: f64 = 0.8;
/// Fewer windows than this show no rate.
const FEWEST: usize = 5;
/// A clock does not gain by more than this share.
const FASTEST: f64 = 0.02;
/// Times that were written in another unit are off by one of these.
const UNITS: [(f64, &str); 6] = [
    (1e3, "milliseconds"),
    (1e6, "microseconds"),
    (1e9, "nanoseconds"),
    (1e-3, "thousands of seconds"),
    (1e-6, "millions of seconds"),
    (1e-9, "billions of seconds"),
];

/// A stream in its right unit is as long as the recording within this ratio.
const AS_LONG: f64 = 10.0;

/// Times, s, and what is sensed at them, without its direction.
type Sizes = Vec<(f64, f64)>;

/// A size at even times from a first one.
struct Even {
    from: f64,
    values: Vec<f64>,
}

/// The stream's clock against that of the recording, and how evenly it runs.
///
/// # Errors
///
/// Why the two cannot be put side by side, for a reader.
pub fn coarse(recording: &Recording, integrity: &Integrity, stream: &Stream) -> Result<Steadiness, String> {
    let mut best: Option<(f64, SensorKind, f64)> = None;
    for kind in [SensorKind::Gyr, SensorKind::Acc, SensorKind::Mag] {
        let Some((real, ideal)) = sizes(recording, integrity, stream, kind) else { continue };
        let Some((lag, agreement)) = first_lag(&real, &ideal, 1.0) else {
            let unit = other_unit(recording, integrity, stream, kind);
            return Err(unit.unwrap_or_else(|| no_overlap(recording, stream)));
        };
        if best.is_none_or(|(_, _, most)| agreement > most) {
            best = Some((lag, kind, agreement));
        }
        if agreement > LOCAL {
            break;
        }
    }
    let Some((lag, kind, agreement)) = best else {
        return Err(format!(
            "{}: no sensor of the recording has a stream of the simulator; expected sim_acc_*, sim_gyr_* or sim_mag_* of \
             a sensor that was recorded",
            stream.name
        ));
    };
    if agreement < FOLLOWS {
        return Err(other_unit(recording, integrity, stream, kind).unwrap_or_else(|| {
            format!(
                "{}: the simulated {kind} does not follow the recorded one at any lag: the sizes of what they sense \
                 correlate by {agreement:.2} at most, expected {FOLLOWS} or more; give the simulator the movement of \
                 this recording",
                stream.name
            )
        }));
    }
    let clock = refined(recording, integrity, stream, kind, lag);
    let of = |kind| binned(recording, integrity, stream, kind);
    let Some(rates) = of(SensorKind::Gyr) else { return Ok(Steadiness::even(clock)) };
    let others = [SensorKind::Acc, SensorKind::Mag].into_iter().filter_map(of);
    confirmed(steadiness(&rates, &clock), &rates, others, &clock)
        .map_err(|why| format!("{}: {why}", stream.name))
}

/// Means of a sensor's samples and of its stream over short bins; `None` where one of them has none.
fn binned(recording: &Recording, integrity: &Integrity, stream: &Stream, kind: SensorKind) -> Option<Rates> {
    let (values, usable) = (&recording.sensor(kind)?.values, &integrity.sensor(kind)?.usable);
    let rows = recording.time.iter().zip(values).zip(usable);
    let real = rows.filter(|(_, usable)| **usable).map(|((time, value), _)| (*time, *value));
    let ideal = stream.time.iter().copied().zip(stream.values.sensor(kind)?.iter().copied());
    let ideal = ideal.filter(|(_, value)| value.iter().all(|value| value.is_finite()));
    Some(Rates { real: Binned::new(real, BIN), ideal: Binned::new(ideal, BIN) })
}

fn no_overlap(recording: &Recording, stream: &Stream) -> String {
    let span = |time: &[f64]| time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0);
    format!(
        "{}: the stream lasts {:.1} s and the recording {:.1} s: they cannot share the {LEAST:.0} s that are needed; \
         simulate the movement of this recording from its beginning to its end",
        stream.name,
        span(&stream.time),
        span(&recording.time)
    )
}

/// Sizes of what a sensor and its stream sense; `None` where one of them is missing.
fn sizes<'r>(
    recording: &'r Recording,
    integrity: &Integrity,
    stream: &'r Stream,
    kind: SensorKind,
) -> Option<(Sizes, Sizes)> {
    let (values, usable) = (&recording.sensor(kind)?.values, &integrity.sensor(kind)?.usable);
    let size = |(time, value): (&f64, &Vector3<f64>)| {
        let size = value.norm();
        size.is_finite().then_some((*time, size))
    };
    let of = |(at, pair): (usize, (&f64, &Vector3<f64>))| size(pair).filter(|_| usable[at]);
    let real = recording.time.iter().zip(values).enumerate().filter_map(of).collect();
    let ideal: Sizes = stream.time.iter().zip(stream.values.sensor(kind)?).filter_map(size).collect();
    (!ideal.is_empty()).then_some((real, ideal))
}

/// The lag of the stream at which the sizes agree best, s, and their correlation there; the stream's times count
/// `per_second` to the second. `None` where no lag lets them overlap.
fn first_lag(real: &[(f64, f64)], ideal: &[(f64, f64)], per_second: f64) -> Option<(f64, f64)> {
    let ideal: Vec<(f64, f64)> = ideal.iter().map(|(time, size)| (time / per_second, *size)).collect();
    let span = |of: &[(f64, f64)]| Some(of.last()?.0 - of.first()?.0);
    let (long, short) = (span(real)?.max(span(&ideal)?), span(real)?.min(span(&ideal)?));
    let step = STEP.max(long / MOST).min(short / FINEST);
    let shared = LEAST.max(SHARED * short);
    if short < shared {
        return None;
    }
    let (real, ideal) = (Even::of(real, step)?, Even::of(&ideal, step)?);
    let (n, m) = (real.values.len() as isize, ideal.values.len() as isize);
    let least = (shared / step) as isize;
    let agreement = |lag: isize| {
        let from = lag.max(0);
        let to = (n + lag).min(m);
        if to - from < least {
            return None;
        }
        let real = &real.values[(from - lag) as usize..(to - lag) as usize];
        Some((correlation(real, &ideal.values[from as usize..to as usize]), lag))
    };
    let best = (-n..=m).filter_map(agreement).max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((ideal.from - real.from + best.1 as f64 * step, best.0))
}

/// The recording's stream in another unit of time, where its sizes then agree.
fn other_unit(
    recording: &Recording,
    integrity: &Integrity,
    stream: &Stream,
    kind: SensorKind,
) -> Option<String> {
    let (real, ideal) = sizes(recording, integrity, stream, kind)?;
    let agrees = |per_second: f64| {
        first_lag(&real, &ideal, per_second).is_some_and(|(_, agreement)| agreement > LOCAL)
    };
    let length = |of: &Sizes| Some(of.last()?.0 - of.first()?.0);
    let ratio = length(&ideal)? / length(&real)?;
    let is_as_long = |per_second: f64| (ratio / per_second).ln().abs() < AS_LONG.ln();
    let (_, unit) =
        UNITS.into_iter().find(|(per_second, _)| is_as_long(*per_second) && agrees(*per_second))?;
    Some(format!(
        "{}: the times of the stream look like {unit}, expected seconds; give their unit as `t` below [units] in its \
         manifest",
        stream.name
    ))
}

/// Offset and rate by the lags of windows about a first one.
fn refined(
    recording: &Recording,
    integrity: &Integrity,
    stream: &Stream,
    kind: SensorKind,
    lag: f64,
) -> StreamClock {
    let first = StreamClock::even(lag, 0.0);
    let Some((real, ideal)) = sizes(recording, integrity, stream, kind) else { return first };
    let (Some(real), Some(ideal)) = (Even::of(&real, FINE), Even::of(&ideal, FINE)) else { return first };
    let length = (WINDOW / FINE) as usize;
    // The stream's time at a row of t is lag + slope t.
    let (mut at_zero, mut slope) = (lag, 1.0);
    for reach in ROUNDS {
        let reach = (reach / FINE).round() as isize;
        let mut found: Vec<(f64, f64)> = Vec::new();
        for from in (0..real.values.len().saturating_sub(length)).step_by(length) {
            let window = &real.values[from..from + length];
            let middle = real.from + (from as f64 + 0.5 * length as f64) * FINE;
            let start = at_zero + slope * middle - 0.5 * length as f64 * FINE;
            let about = ((start - ideal.from) / FINE).round() as isize;
            if let Some(place) = best_place(window, &ideal, about, reach) {
                let stream_time = ideal.from + (place + 0.5 * length as f64) * FINE;
                found.push((middle, stream_time - middle));
            }
        }
        let Some((lag, drift)) = line(&found) else { continue };
        (at_zero, slope) = (lag, 1.0 + drift);
    }
    StreamClock::even(at_zero / slope, 1.0 / slope - 1.0)
}

/// Where within a stream a window agrees best with it, in steps, near a place; `None` where it does not clearly.
fn best_place(window: &[f64], ideal: &Even, about: isize, reach: isize) -> Option<f64> {
    let agreement = |place: isize| {
        let from = usize::try_from(place).ok()?;
        Some(correlation(window, ideal.values.get(from..from + window.len())?))
    };
    let tried = (about - reach..=about + reach).filter_map(|place| Some((agreement(place)?, place)));
    let (most, place) = tried.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(most, _)| *most > LOCAL)?;
    // Between steps lies the top of the parabola through three of them; at the edge there is no top.
    let (before, after) = (agreement(place - 1)?, agreement(place + 1)?);
    let bend = before - 2.0 * most + after;
    let inside = place.abs_diff(about) < reach.unsigned_abs() && bend < 0.0;
    inside.then(|| place as f64 + (0.5 * (before - after) / bend).clamp(-0.5, 0.5))
}

/// Value at zero and slope of a line through points, by medians; without a slope where the points are few. `None` without
/// a point.
fn line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let level = |slope: f64| median(points.iter().map(|(t, lag)| lag - slope * t).collect());
    if points.len() < FEWEST {
        return Some((level(0.0)?, 0.0));
    }
    let slopes = points.iter().enumerate().flat_map(|(at, (t, lag))| {
        points[..at].iter().map(move |(earlier, before)| (lag - before) / (t - earlier))
    });
    let slope = median(slopes.collect()).filter(|slope| slope.abs() < FASTEST).unwrap_or(0.0);
    Some((level(slope)?, slope))
}

/// Of two sizes; zero where one of them does not vary.
fn correlation(one: &[f64], other: &[f64]) -> f64 {
    let n = one.len() as f64;
    let (mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in one.iter().zip(other) {
        x += a;
        y += b;
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let (vx, vy) = (xx - x * x / n, yy - y * y / n);
    let flat = 1e-12 * (xx + yy);
    if vx > flat && vy > flat { (xy - x * y / n) / (vx * vy).sqrt() } else { 0.0 }
}

impl Even {
    /// Means over steps; a step without a sample repeats the one before it.
    fn of(samples: &[(f64, f64)], step: f64) -> Option<Self> {
        let (from, to) = (samples.first()?.0, samples.last()?.0);
        let count = ((to - from) / step) as usize + 1;
        let mut sums = vec![(0.0, 0.0); count];
        for (time, size) in samples {
            if let Some(sum) = sums.get_mut(((time - from) / step) as usize) {
                sum.0 += size;
                sum.1 += 1.0;
            }
        }
        let mut last = samples.first()?.1;
        let values = sums.into_iter().map(|(sum, n)| {
            if n > 0.0 {
                last = sum / n;
            }
            last
        });
        Some(Self { from: from + 0.5 * step, values: values.collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A size that turns, with its own clock.
    fn size(time: f64) -> f64 {
        2.0 + (0.9 * time).sin() + 0.7 * (0.23 * time * (1.0 + 0.001 * time)).cos() + 0.4 * (2.3 * time).sin()
    }

    fn samples(count: usize, interval: f64, shown: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        (0..count).map(|k| k as f64 * interval).map(|t| (t, size(shown(t)))).collect()
    }

    #[test]
    fn the_lag_is_found_wherever_the_stream_begins() {
        for began in [-30.0, -3.3, 0.0, 41.7] {
            let real = samples(15_000, 0.01, |t| t);
            let ideal = samples(30_000, 0.005, |s| s - began);
            let (lag, agreement) = first_lag(&real, &ideal, 1.0).unwrap();
            assert!((lag - began).abs() < 0.11 && agreement > 0.98, "{began}: {lag} {agreement}");
        }
    }

    #[test]
    fn times_in_another_unit_agree_in_none_but_their_own() {
        let real = samples(15_000, 0.01, |t| t);
        let milliseconds: Vec<(f64, f64)> =
            samples(30_000, 0.005, |s| s).into_iter().map(|(t, size)| (1e3 * t, size)).collect();
        assert!(first_lag(&real, &milliseconds, 1e3).unwrap().1 > 0.98);
        assert!(first_lag(&real, &milliseconds, 1.0).is_none_or(|(_, agreement)| agreement < FOLLOWS));
    }

    #[test]
    fn a_line_is_that_of_most_points() {
        let mut points: Vec<(f64, f64)> =
            (0..20).map(|k| f64::from(k) * 12.0).map(|t| (t, 0.3 + 2e-4 * t)).collect();
        points[3].1 = 1.9;
        points[11].1 = -0.8;
        let (level, slope) = line(&points).unwrap();
        assert!((level - 0.3).abs() < 1e-9 && (slope - 2e-4).abs() < 1e-9);
        assert_eq!(line(&points[..2]).unwrap().1, 0.0);
        assert!(line(&[]).is_none());
    }

    #[test]
    fn a_size_that_does_not_vary_agrees_with_nothing() {
        assert_eq!(correlation(&[1.0; 50], &(0..50).map(f64::from).collect::<Vec<_>>()), 0.0);
    }
}
