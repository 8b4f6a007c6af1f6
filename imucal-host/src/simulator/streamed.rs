//! A simulator's stream: what it says ideal sensors would have read, as a source of truth.
//!
//! Between two samples each component is a cubic ([`Cubic`]); the angular acceleration is the slope of the rate. A row of the
//! recording shows the stream at
//!
//! ```text
//! s = (t + offset + correction(t)) / (1 + error)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | t | time of the row on the sensor's clock, s |
//! | s | time of the stream on the simulator's clock, s |
//! | offset, error | [`StreamClock`], as `clk.time_offset` and `clk.rate_error` count them |
//! | correction | of a clock that jumps or wanders, s; zero of one that runs evenly |
//!
//! The attitude is the integral of the rate in a level base (`attitude`), and its heading is that of the first row. Not
//! modelled: noise of the stream.

use std::ops::Range;

use imucal_core::rotation::exp;
use nalgebra::{Matrix3, Vector3};

use super::{
    cubic::{Cubic, sample_before},
    place::Place,
    recent::{Recent, nearest},
    replay::readings_noise,
    truth::{Motion, Recorded, in_the_open},
};
use crate::{
    effect::{Machine, Truth},
    recording::{
        SensorKind, Stream,
        manifest::{Rig, RigKind},
    },
};

/// It moves where, within this time to each side of a row, s,
const WINDOW: f64 = 0.1;
/// it turns faster than this, rad/s,
const TURNS: f64 = 0.02;
/// or its specific force changes by more than this, m/s².
const SWAYS: f64 = 0.1;

/// What trembles by less than so many times the noise of a stream that is not ideal does not move.
const NOISES: f64 = 5.0;
/// Samples within which noise is estimated.
const STRETCH: usize = 100;

/// How the clock of a stream stands to that of the sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamClock {
    /// The row of t shows the stream of t + offset, s.
    pub offset: f64,
    /// The sensor's clock gains on the stream's by this share.
    pub error: f64,
    /// What is added to the offset at times of the sensor's clock, s each: between two on the line through them, beyond the ends
    /// as at the nearest. Two at one time are a jump. Times never decrease; empty for a clock that runs evenly.
    pub corrections: Vec<(f64, f64)>,
    /// Where on the sensor's clock it may have jumped already or not yet, s.
    pub unknown: Vec<Range<f64>>,
}

impl StreamClock {
    /// One that runs evenly.
    pub fn even(offset: f64, error: f64) -> Self {
        Self { offset, error, ..Self::default() }
    }

    /// Time of the stream that a row of `time` shows, s.
    pub fn stream_time(&self, time: f64) -> f64 {
        (time + self.offset + self.correction(time)) / (1.0 + self.error)
    }

    /// Time of the row that shows this time of the stream, s.
    pub fn row_time(&self, stream_time: f64) -> f64 {
        let even = stream_time * (1.0 + self.error) - self.offset;
        // Corrections change by much less than time does.
        even - self.correction(even - self.correction(even))
    }

    fn correction(&self, time: f64) -> f64 {
        let after = self.corrections.partition_point(|(at, _)| *at <= time);
        let before = after.checked_sub(1).and_then(|at| self.corrections.get(at));
        match (before, self.corrections.get(after)) {
            (Some((from, one)), Some((to, other))) => one + (other - one) * (time - from) / (to - from),
            (Some((_, only)), None) | (None, Some((_, only))) => *only,
            (None, None) => 0.0,
        }
    }

    fn is_known(&self, time: f64) -> bool {
        !self.unknown.iter().any(|unknown| unknown.contains(&time))
    }
}

/// The movement of a simulator's stream, at the rows of a recording.
#[derive(Clone, Debug)]
pub struct Streamed {
    time: Vec<f64>,
    channels: [Option<Cubic>; 3],
    attitudes: Vec<Matrix3<f64>>,
    clock: StreamClock,
    duration: f64,
    rows: Vec<f64>,
    temperature: Vec<f64>,
    moving: Vec<bool>,
    known: Vec<bool>,
    speeds: Option<Vec<f64>>,
    place: Place,
}

impl Streamed {
    /// The movement of a stream for rows of these times, s, and temperatures, °C. `None` where the stream has fewer than
    /// two samples.
    pub fn new(
        stream: &Stream,
        clock: StreamClock,
        rows: &[f64],
        temperature: Vec<f64>,
        place: Place,
    ) -> Option<Self> {
        if stream.time.len() < 2 {
            return None;
        }
        let time = stream.time.clone();
        let sampled = |kind: SensorKind| stream.values.sensor(kind);
        let channels = SensorKind::ALL.map(|kind| Some(Cubic::new(&time, sampled(kind)?)));
        let attitudes = attitude::attitudes(&time, &channels);
        let mut streamed = Self {
            channels,
            attitudes,
            clock,
            duration: rows.last().copied().unwrap_or(0.0),
            rows: rows.to_vec(),
            temperature,
            moving: Vec::new(),
            known: Vec::new(),
            speeds: None,
            place,
            time,
        };
        let measured = measured(stream);
        streamed.known = rows.iter().map(|row| streamed.is_covered(*row, &measured)).collect();
        streamed.moving = streamed.movement();
        streamed.speeds = streamed.travelled();
        Some(streamed)
    }

    /// Known at no row but these, and such as it was known at.
    #[must_use]
    pub fn known_where(mut self, rows: &[bool]) -> Self {
        self.known.iter_mut().zip(rows).for_each(|(known, row)| *known &= row);
        self
    }

    /// The clock that rows are read by.
    pub fn clock(&self) -> &StreamClock {
        &self.clock
    }

    /// The samples on both sides of a row's time were given.
    fn is_covered(&self, row: f64, measured: &[bool]) -> bool {
        let s = self.clock.stream_time(row);
        let after = self.time.partition_point(|t| *t < s);
        let (Some(before), true) = (after.checked_sub(2), after + 1 < self.time.len()) else { return false };
        measured[before..=after + 1].iter().all(|measured| *measured) && self.clock.is_known(row)
    }

    /// Speed at each row, by the specific force less its mean: what a machine gains on the whole it loses until it comes to
    /// rest again. `None` without an accelerometer.
    fn travelled(&self) -> Option<Vec<f64>> {
        let acc = self.channels[SensorKind::Acc as usize].as_ref()?;
        let forces: Vec<Vector3<f64>> = self.attitudes.iter().zip(&acc.values).map(|(c, f)| c * f).collect();
        let steps = || self.time.windows(2).zip(forces.windows(2));
        let gained =
            |(time, force): (&[f64], &[Vector3<f64>])| (force[0] + force[1]) * (0.5 * (time[1] - time[0]));
        let length = self.time.last()? - self.time.first()?;
        let gravity = steps().map(gained).sum::<Vector3<f64>>() / length;
        let mut speed = Vector3::zeros();
        let mut speeds = vec![0.0];
        for step in steps() {
            speed += gained(step) - gravity * (step.0[1] - step.0[0]);
            speeds.push(speed.norm());
        }
        let at = |row: &f64| {
            let sample = nearest(&self.time, self.clock.stream_time(*row));
            speeds.get(sample).copied().unwrap_or(0.0)
        };
        Some(self.rows.iter().map(at).collect())
    }

    /// Whether it turns or sways at each row.
    fn movement(&self) -> Vec<bool> {
        let [acc, gyr, _] = &self.channels;
        let trembles = |own: fn(&Cubic) -> &[Vector3<f64>], channel: &Option<Cubic>| {
            channel.as_ref().map_or(0.0, |channel| NOISES * own_noise(own(channel)))
        };
        let (turning, swaying) = (trembles(|c| &c.values, gyr), trembles(|c| &c.slopes, acc) * WINDOW);
        let samples: Vec<bool> = (0..self.time.len())
            .map(|k| {
                let turns = |c: &Cubic| c.values[k].norm() > TURNS + turning;
                let sways = |c: &Cubic| c.slopes[k].norm() * WINDOW > SWAYS + swaying;
                gyr.as_ref().is_some_and(turns) || acc.as_ref().is_some_and(sways)
            })
            .collect();
        let mut sums = vec![0usize; samples.len() + 1];
        for (k, moves) in samples.iter().enumerate() {
            sums[k + 1] = sums[k] + usize::from(*moves);
        }
        let moves = |row: &f64| {
            let s = self.clock.stream_time(*row);
            let from = self.time.partition_point(|t| *t < s - WINDOW);
            let to = self.time.partition_point(|t| *t <= s + WINDOW);
            sums[to] > sums[from]
        };
        self.rows.iter().map(moves).collect()
    }
}

impl Motion for Streamed {
    fn duration(&self) -> f64 {
        self.duration
    }

    /// No rig acts: the stream is in the sensor's own axes.
    fn truth_among(&self, time: f64, _: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let s = self.clock.stream_time(time);
        let k = sample_before(&self.time, s);
        let of = |kind: SensorKind| self.channels[kind as usize].as_ref().map(|c| c.at(&self.time, k, s));
        let still = (Vector3::zeros(), Vector3::zeros());
        let (w, dw) = of(SensorKind::Gyr).unwrap_or(still);
        let since = (s - self.time[k]).clamp(0.0, self.time[k + 1] - self.time[k]);
        let from = self.channels[SensorKind::Gyr as usize].as_ref().map_or(w, |c| c.values[k]);
        let c_t_n = self.attitudes[k] * exp(&((w + from) * (0.5 * since)));
        let mut truth = in_the_open(time, &c_t_n, w, dw, &self.place, recent);
        truth.w_ie_t = Vector3::zeros();
        (truth.w_it_t, truth.dw_it_t) = (w, dw);
        truth.f_t = of(SensorKind::Acc).unwrap_or(still).0;
        truth.b_t = of(SensorKind::Mag).unwrap_or(still).0;
        let row = recent.nearest(&self.rows, time);
        truth.temperature = self.temperature.get(row).copied().unwrap_or(truth.temperature);
        truth
    }

    fn gives(&self, kind: SensorKind) -> bool {
        self.channels[kind as usize].is_some()
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::Hand, axes: None }
    }

    fn place(&self) -> Place {
        self.place
    }
}

impl Recorded for Streamed {
    fn moving(&self) -> &[bool] {
        &self.moving
    }

    fn known(&self) -> &[bool] {
        &self.known
    }

    fn speeds(&self) -> Option<&[f64]> {
        self.speeds.as_deref()
    }

    fn mounted(&self, c_t_q: &Matrix3<f64>) -> Option<Box<dyn Recorded>> {
        let channels = self.channels.clone().map(|channel| channel.map(|channel| channel.turned(c_t_q)));
        let attitudes = self.attitudes.iter().map(|c_t_n| c_t_n * c_t_q.transpose()).collect();
        Some(Box::new(Self { channels, attitudes, ..self.clone() }))
    }

    fn steady(&self) -> &dyn Motion {
        self
    }
}

/// Noise of a sample in the stillest tenth of a stream, the largest of the axes'; none of an ideal stream: noise is there
/// all the time, a movement that is too fast for the samples is not.
pub fn own_noise(values: &[Vector3<f64>]) -> f64 {
    let mut noises: Vec<f64> = values.chunks(STRETCH).map(readings_noise).collect();
    noises.sort_by(f64::total_cmp);
    noises.get(noises.len() / 10).copied().unwrap_or(0.0)
}

/// Samples at which every sensor of the stream has a value, and no gap lies before.
fn measured(stream: &Stream) -> Vec<bool> {
    let interval = crate::recording::median(stream.time.windows(2).map(|t| t[1] - t[0]).collect());
    let longest = GAP * interval.unwrap_or(f64::INFINITY);
    (0..stream.time.len())
        .map(|k| {
            let given = |kind: &SensorKind| {
                stream.values.sensor(*kind).is_none_or(|values| values[k].iter().all(|v| v.is_finite()))
            };
            let near = k == 0 || stream.time[k] - stream.time[k - 1] <= longest;
            near && SensorKind::ALL.iter().all(given)
        })
        .collect()
}

/// Samples further apart than so many intervals have a gap between them.
const GAP: f64 = 3.5;

mod attitude;
#[cfg(test)]
mod tests;
