//! Impacts that samples do not resolve: between two samples of a stream nothing is known of them.
//!
//! ```text
//! e_k = x_k − (4 (x_{k−1} + x_{k+1}) − (x_{k−2} + x_{k+2})) / 6
//! ```
//!
//! e is what a cubic through a sample's neighbours does not foretell, of the recording's samples and of the stream's. A foot
//! that strikes or a wheel on an edge stands far out of the samples about it; vibration, a movement along which all samples
//! are as hard to foretell, does not. Impacts that one side has and the other lacks, several in a row, are a movement that
//! the simulator does not have: a contact. Not recognised: impacts so dense that there is nothing between them, and a single
//! one that one side lacks.

use std::ops::Range;

use nalgebra::Vector3;

use crate::{
    recording::{Recording, SensorKind, Stream, median, order_statistics::std_of_median},
    simulator::StreamClock,
};

/// An impact stands out by this factor over the median of |e| about it,
const STANDS_OUT: f64 = 6.0;
/// and in the stream over this share of the recording's own median as well.
const SEEN: f64 = 1.0;
/// Length of the stretches over which medians are taken, s, and so many of them to each side.
const STRETCH: f64 = 0.5;
const ABOUT: usize = 2;
/// So many intervals of the slower clock to each side are left out with an impact.
const MARGIN: f64 = 1.5;
/// Neighbours further apart than so many intervals foretell nothing.
const APART: f64 = 1.6;
/// Where more than this share of the rows would be left out, the movement itself is that rough.
const MOST: f64 = 0.4;

/// Impacts no further apart than this, s, are one.
const ONE: f64 = 0.06;
/// Of fewer impacts in all it is not known what is usual; so many in a row are looked at together, without a pause longer than
/// this, s.
const FEWEST: usize = 20;
const IN_ROW: [usize; 6] = [4, 6, 8, 12, 16, 24];
const PAUSE: f64 = 3.0;
/// ln of a ratio of sizes scatters by this at least.
const LEAST_SCATTER: f64 = 0.3;
/// One impact counts no more than so many standard deviations, and the mean of several in a row is unusual from so many on.
const LARGEST: f64 = 4.0;
const UNUSUAL: f64 = 8.5;

/// The impacts of a recording and of the stream that it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Impacts {
    /// Whether no impact is near, row by row.
    pub resolved: Vec<bool>,
    /// Stretches with impacts that one side has and the other lacks.
    pub unmatched: Vec<Unmatched>,
}

/// Impacts in a row that are weaker or stronger in the recording than in the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Unmatched {
    /// When, s of the recording's clock.
    pub time: Range<f64>,
    /// Root mean square of how far the largest |e| of the two sides are apart, m/s².
    pub force: f64,
    /// How far their sizes are from the usual: the square in standard deviations.
    pub energy: f64,
}

/// The impacts of a recording and of a stream on this clock.
pub fn impacts(recording: &Recording, stream: &Stream, clock: StreamClock) -> Impacts {
    // Where a row shows the stream of s: the clock's inverse.
    let row = |time: f64| time * (1.0 + clock.error) - clock.offset;
    let rows: Vec<f64> = stream.time.iter().map(|time| row(*time)).collect();
    let (mut times, mut unmatched) = (Vec::new(), Vec::new());
    for kind in SensorKind::ALL {
        let Some(real) = recording.sensor(kind) else { continue };
        let own = Unforeseen::of(&recording.time, &real.values);
        let mut of_sensor = own.impacts(0.0);
        if let Some(values) = stream.values.sensor(kind) {
            let given = Unforeseen::of(&rows, values);
            of_sensor.extend(given.impacts(SEEN * own.usual()));
            if kind == SensorKind::Acc {
                // A short pulse looks smaller to the finer clock: both are seen by the slower one.
                let slower = own.interval.max(given.interval);
                let [own, given] = [(&recording.time[..], &real.values[..]), (&rows[..], values)]
                    .map(|(time, values)| Unforeseen::at_interval(time, values, slower));
                unmatched = Strikes::of(&own, &given, &of_sensor).unmatched();
            }
        }
        times.extend(of_sensor);
    }
    times.sort_by(f64::total_cmp);
    let margin = MARGIN * interval(&recording.time).max(interval(&rows));
    let is_clear = |time: &f64| {
        let next = times.partition_point(|impact| *impact < time - margin);
        times.get(next).is_none_or(|impact| *impact > time + margin)
    };
    let mut resolved: Vec<bool> = recording.time.iter().map(is_clear).collect();
    let left_out = resolved.iter().filter(|resolved| !**resolved).count();
    if left_out as f64 > MOST * resolved.len() as f64 {
        resolved.fill(true);
    }
    Impacts { resolved, unmatched }
}

/// Median interval, s.
fn interval(time: &[f64]) -> f64 {
    median(time.windows(2).map(|pair| pair[1] - pair[0]).collect()).unwrap_or(0.0)
}

/// Impacts one after the other, on both sides.
struct Strikes {
    strikes: Vec<Strike>,
}

/// One impact.
struct Strike {
    time: f64,
    /// ln of its power in the recording over that in the stream.
    ratio: f64,
    /// Largest |e| in the recording less that in the stream.
    excess: f64,
}

impl Strikes {
    /// From what is unforeseen in the recording and in the stream, both on the recording's clock, and the times of impacts.
    fn of(own: &Unforeseen, given: &Unforeseen, impacts: &[f64]) -> Self {
        let mut times = impacts.to_vec();
        times.sort_by(f64::total_cmp);
        let floor = (STANDS_OUT * own.usual()).powi(2).max(f64::MIN_POSITIVE);
        let margin = MARGIN * own.interval.max(given.interval);
        let strike = |times: &[f64]| {
            let span = times[0] - margin..times[times.len() - 1] + margin;
            let [own, given] = [own, given].map(|side| side.within(&span));
            Strike {
                time: 0.5 * (span.start + span.end),
                ratio: ((own.power + floor * margin) / (given.power + floor * margin)).ln(),
                excess: own.largest - given.largest,
            }
        };
        Self { strikes: times.chunk_by(|a, b| b - a < ONE).map(strike).collect() }
    }

    /// Stretches in which the ratios are all on one side of the usual, the clearest first.
    fn unmatched(&self) -> Vec<Unmatched> {
        let usual = median(self.strikes.iter().map(|strike| strike.ratio).collect()).unwrap_or(0.0);
        let sizes = self.strikes.iter().map(|strike| (strike.ratio - usual).abs()).collect();
        let scatter = std_of_median(sizes).unwrap_or(0.0).max(LEAST_SCATTER);
        let off: Vec<f64> = self
            .strikes
            .iter()
            .map(|strike| ((strike.ratio - usual) / scatter).clamp(-LARGEST, LARGEST))
            .collect();
        let mut found: Vec<(Range<usize>, f64)> = Vec::new();
        if self.strikes.len() < FEWEST {
            return Vec::new();
        }
        for count in IN_ROW.into_iter().filter(|count| *count <= off.len()) {
            let is_row = |from: &usize| {
                self.strikes[*from..from + count].windows(2).all(|pair| pair[1].time - pair[0].time < PAUSE)
            };
            let mean = |from: usize| off[from..from + count].iter().sum::<f64>() / count as f64;
            let rows: Vec<(usize, f64)> =
                (0..=off.len() - count).filter(is_row).map(|from| (from, mean(from))).collect();
            // Impacts in step with the samples are alike in a row: their mean scatters more than that of so many others.
            let sizes = rows.iter().map(|(_, mean)| mean.abs()).collect();
            let scatter = std_of_median(sizes).unwrap_or(0.0).max(1.0 / (count as f64).sqrt());
            let unusual = rows.into_iter().map(|(from, mean)| (from..from + count, mean.abs() / scatter));
            found.extend(unusual.filter(|(_, size)| *size > UNUSUAL));
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut kept: Vec<(Range<usize>, f64)> = Vec::new();
        for (strikes, z) in found {
            let meets =
                |(other, _): &(Range<usize>, f64)| strikes.start < other.end && other.start < strikes.end;
            if !kept.iter().any(meets) {
                kept.push((strikes, z));
            }
        }
        kept.into_iter().map(|(strikes, z)| self.stretch(strikes, z)).collect()
    }

    fn stretch(&self, strikes: Range<usize>, z: f64) -> Unmatched {
        let own = &self.strikes[strikes];
        let squares: f64 = own.iter().map(|strike| strike.excess * strike.excess).sum();
        Unmatched {
            time: own[0].time - ONE..own[own.len() - 1].time + ONE,
            force: (squares / own.len() as f64).sqrt(),
            energy: z * z,
        }
    }
}

/// What is unforeseen within a span.
struct Within {
    /// Integral of e², by time.
    power: f64,
    /// Largest |e|.
    largest: f64,
}

/// |e| of samples that have four neighbours, by time, s.
struct Unforeseen {
    samples: Vec<(f64, f64)>,
    /// Median interval, s.
    interval: f64,
}

impl Unforeseen {
    fn of(time: &[f64], values: &[Vector3<f64>]) -> Self {
        let interval = interval(time);
        let of = |(t, x): (&[f64], &[Vector3<f64>])| {
            let even = t.windows(2).all(|pair| pair[1] - pair[0] < APART * interval);
            let foretold = ((x[1] + x[3]) * 4.0 - (x[0] + x[4])) / 6.0;
            let size = (x[2] - foretold).norm();
            (even && size.is_finite()).then_some((t[2], size))
        };
        Self { samples: time.windows(5).zip(values.windows(5)).filter_map(of).collect(), interval }
    }

    /// Of one in so many samples that these are about so far apart, s.
    fn at_interval(time: &[f64], values: &[Vector3<f64>], apart: f64) -> Self {
        let stride = (apart / interval(time).max(f64::MIN_POSITIVE)).round().max(1.0) as usize;
        let times: Vec<f64> = time.iter().step_by(stride).copied().collect();
        let values: Vec<Vector3<f64>> = values.iter().step_by(stride).copied().collect();
        Self::of(&times, &values)
    }

    fn within(&self, span: &Range<f64>) -> Within {
        let from = self.samples.partition_point(|(time, _)| *time < span.start);
        let to = self.samples.partition_point(|(time, _)| *time <= span.end);
        let sizes = || self.samples[from..to.max(from)].iter().map(|(_, size)| *size);
        Within {
            power: sizes().map(|size| size * size).sum::<f64>() * self.interval,
            largest: sizes().fold(0.0, f64::max),
        }
    }

    /// The median of all.
    fn usual(&self) -> f64 {
        median(self.samples.iter().map(|(_, size)| *size).collect()).unwrap_or(0.0)
    }

    /// Times at which one stands out of those about it, and over `floor`.
    fn impacts(&self, floor: f64) -> Vec<f64> {
        let begins = self.samples.first().map_or(0.0, |(time, _)| *time);
        let stretch = |time: f64| ((time - begins) / STRETCH) as usize;
        let mut sizes: Vec<Vec<f64>> = Vec::new();
        for (time, size) in &self.samples {
            let at = stretch(*time);
            if sizes.len() <= at {
                sizes.resize(at + 1, Vec::new());
            }
            sizes[at].push(*size);
        }
        let medians: Vec<Option<f64>> = sizes.into_iter().map(median).collect();
        let about = |at: usize| {
            let near = medians[at.saturating_sub(ABOUT)..(at + ABOUT + 1).min(medians.len())].iter();
            median(near.flatten().copied().collect()).unwrap_or(0.0)
        };
        let limits: Vec<f64> = (0..medians.len()).map(|at| (STANDS_OUT * about(at)).max(floor)).collect();
        let stands_out = |(time, size): &&(f64, f64)| *size > limits[stretch(*time)];
        self.samples.iter().filter(stands_out).map(|(time, _)| *time).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::find,
        simulator::{
            Dose,
            robot::{MismatchKind, RobotKind, RobotScene},
        },
    };

    fn left_out(scene: &RobotScene) -> f64 {
        let pair = scene.record("pair").unwrap();
        let stream = Stream::of(&pair.simulated).unwrap();
        let rows = impacts(&pair.real, &stream, StreamClock::default()).resolved;
        rows.iter().filter(|resolved| !**resolved).count() as f64 / rows.len() as f64
    }

    #[test]
    fn feet_that_strike_are_left_out_and_vibration_is_not() {
        let of = |kind| RobotScene { kind, duration: 60.0, seed: 4, ..RobotScene::default() };
        let legged = left_out(&of(RobotKind::Legged));
        assert!((0.01..0.3).contains(&legged), "{legged}");
        for kind in [RobotKind::Wheeled, RobotKind::Flying] {
            let scene = RobotScene { vibration: 3.0, ..of(kind) };
            let share = left_out(&scene);
            assert!(share < 0.05, "{kind:?} {share}");
        }
    }

    #[test]
    fn feet_that_strike_harder_than_the_simulator_says_are_a_stretch_and_others_are_none() {
        let scene = RobotScene {
            kind: RobotKind::Legged,
            duration: 240.0,
            real_rate: 500.0,
            sim_rate: 500.0,
            seed: 4,
            ..RobotScene::default()
        };
        let unmatched = |scene: &RobotScene| {
            let pair = scene.record("pair").unwrap();
            impacts(&pair.real, &Stream::of(&pair.simulated).unwrap(), StreamClock::default()).unmatched
        };
        assert_eq!(unmatched(&scene), []);
        let harder = RobotScene { mismatch: Some((MismatchKind::Contact, 6.0)), ..scene };
        let stretches = harder.moved().unwrap().mismatch.stretches;
        let found = unmatched(&harder);
        assert!(!found.is_empty());
        for found in found {
            let (start, end) = (found.time.start + 1.0, found.time.end - 1.0);
            let is_true =
                stretches.iter().any(|stretch| start > stretch.span.0 - 1.0 && end < stretch.span.1 + 1.0);
            assert!(is_true && found.force > 1.0, "{found:?} {stretches:?}");
        }
    }

    #[test]
    fn a_sensor_s_own_faults_are_no_impacts() {
        let scene = |id: &str, size: f64| {
            let doses = vec![Dose::sized(find(id).unwrap(), size, 5, 60.0)];
            RobotScene { kind: RobotKind::Wheeled, duration: 60.0, doses, ..RobotScene::default() }
        };
        let healthy = left_out(&RobotScene { doses: Vec::new(), ..scene("acc.scale_cubic", 1.0) });
        for (id, size) in [("acc.scale_cubic", 10.0), ("mag.field_gradient", 10.0), ("gyr.noise_burst", 3.0)]
        {
            let share = left_out(&scene(id, size));
            assert!((share - healthy).abs() < 0.01, "{id} {share} {healthy}");
        }
    }
}
