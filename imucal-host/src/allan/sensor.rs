//! The noise of one sensor, as its samples arrive.

use nalgebra::Vector3;

use super::{
    cascade::Cascade,
    clock::{Before, Gaps, SampleClock},
    coefficients::{Axis, Estimator, Sums},
    remark::Remark,
    rounding::{Hidden, Rounding},
    stillness::{Moved, Stillness},
};
use crate::recording::{SensorKind, Unit};

/// Samples from which the interval and a constant are taken before the first is used.
const HEAD: usize = 1024;
/// A recording shorter than this, s, or of fewer samples, shows no noise.
const SHORTEST: f64 = 10.0;
const FEWEST: u64 = 256;
/// Samples that are bridged at most, of all.
const BRIDGED: f64 = 0.05;
/// Averages are fitted from so many repetitions on.
const REPETITIONS: f64 = 4.0;

/// Why a sensor has no noise to report.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Too few samples, or too short a time.
    #[error(
        "found {samples} samples in {duration:.1} s, expected at least {FEWEST} samples and {SHORTEST:.0} s; record \
         longer: an hour for the bias instability, a minute for the white noise"
    )]
    TooShort {
        /// Samples.
        samples: u64,
        /// Their duration, s.
        duration: f64,
    },
    /// It moved.
    #[error(
        "{} of {} blocks of a second moved: a standard deviation of {:.3e} at {:.1} s where {:.3e} is usual, a step of \
         {:.3e} at {:.1} s where {:.3e} is usual ({unit}); record the sensor untouched, or cut the recording",
        .moved.blocks, .moved.of, .moved.deviation.0, .moved.deviation.1, .moved.usual_deviation,
        .moved.step.0, .moved.step.1, .moved.usual_step
    )]
    NotStill {
        /// What moved.
        moved: Moved,
        /// Unit of the sizes.
        unit: Unit,
    },
    /// The inertial sensors moved, and so did this one.
    #[error("the {by} moved, and this sensor with it")]
    MovedWith {
        /// Which.
        by: SensorKind,
    },
    /// Too many samples are missing.
    #[error(
        "{missing} of {of} samples are missing, expected at most {:.0} %; record without losses", 100.0 * BRIDGED
    )]
    Missing {
        /// Samples that were bridged.
        missing: u64,
        /// All of them.
        of: u64,
    },
}

impl Refusal {
    /// Its name in a report.
    pub fn name(&self) -> &'static str {
        match self {
            Self::TooShort { .. } => "too-short",
            Self::NotStill { .. } => "not-still",
            Self::MovedWith { .. } => "moved-with",
            Self::Missing { .. } => "samples-missing",
        }
    }
}

/// The noise of a still sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorNoise {
    /// Samples.
    pub samples: u64,
    /// From sample to sample, s.
    pub interval: f64,
    /// Time of all stretches, s.
    pub duration: f64,
    /// Of x, y and z; `None` where all samples are one value, or rounding hides the noise.
    pub axes: [Option<Axis>; 3],
}

/// Takes a sensor's samples.
#[derive(Debug)]
pub struct SensorStream {
    kind: SensorKind,
    /// Of the samples: the SI unit, or arbitrary.
    unit: Unit,
    head: Vec<(f64, Vector3<f64>)>,
    running: Option<Running>,
}

#[derive(Debug)]
struct Running {
    clock: SampleClock,
    stillness: Stillness,
    cascade: Cascade,
    /// Taken from all samples, which keeps digits.
    origin: Vector3<f64>,
    last: Vector3<f64>,
    sum: Vector3<f64>,
    samples: u64,
    rounding: Rounding,
    /// What straight lines have added to the squares of the samples' weights.
    by_lines: f64,
}

impl SensorStream {
    /// Before the first sample.
    pub fn new(kind: SensorKind) -> Self {
        Self { kind, unit: Unit::si(kind), head: Vec::new(), running: None }
    }

    /// Its samples have no unit.
    pub fn of_arbitrary_unit(&mut self) {
        self.unit = Unit::Arbitrary;
    }

    /// A sample, SI unit, and its time, s, later than those before.
    pub fn push(&mut self, time: f64, sample: &Vector3<f64>) {
        if let Some(running) = &mut self.running {
            running.push(time, sample);
            return;
        }
        self.head.push((time, *sample));
        if self.head.len() == HEAD {
            self.start();
        }
    }

    fn start(&mut self) {
        let times: Vec<f64> = self.head.iter().map(|(time, _)| *time).collect();
        let Some(clock) = SampleClock::new(&times) else { return };
        let origin = self.head.iter().map(|(_, sample)| sample).sum::<Vector3<f64>>() / times.len() as f64;
        let mut running = Running {
            stillness: Stillness::new(self.unit, clock.nominal()),
            clock,
            cascade: Cascade::default(),
            origin,
            last: Vector3::repeat(f64::NAN),
            sum: Vector3::zeros(),
            samples: 0,
            rounding: Rounding::default(),
            by_lines: 0.0,
        };
        self.head.drain(..).for_each(|(time, sample)| running.push(time, &sample));
        self.running = Some(running);
    }

    /// What moved.
    pub fn moved(&self) -> Option<Moved> {
        self.running.as_ref().and_then(|running| running.stillness.moved())
    }

    /// Ends the stream: what few samples were held back are counted.
    pub fn end(&mut self) {
        if self.running.is_none() {
            self.start();
        }
    }

    /// The noise of all samples, and what is odd about them.
    ///
    /// # Errors
    ///
    /// [`Refusal`], with its figures.
    pub fn noise(&self) -> Result<(SensorNoise, Vec<Remark>), Refusal> {
        let Some(running) = &self.running else {
            return Err(Refusal::TooShort { samples: self.head.len() as u64, duration: 0.0 });
        };
        let moved = running.stillness.moved();
        if let Some(moved) = moved.filter(|moved| moved.spoils) {
            return Err(Refusal::NotStill { moved, unit: self.unit });
        }
        running.noise((self.kind, self.unit), moved)
    }
}

impl Running {
    fn push(&mut self, time: f64, sample: &Vector3<f64>) {
        let sample = sample - self.origin;
        match self.clock.before(time) {
            Before::Nothing if self.samples > 0 => self.rounding.push(&(sample - self.last)),
            Before::Nothing => {}
            Before::Bridge(missing) => {
                self.by_lines += by_a_line(missing as f64);
                for k in 1..=missing {
                    let share = k as f64 / (missing + 1) as f64;
                    self.cascade.push(&(self.last + (sample - self.last) * share));
                }
            }
            Before::Gap => self.cascade.interrupt(),
        }
        self.cascade.push(&sample);
        self.stillness.push(time, &sample);
        self.samples += 1;
        self.sum += sample;
        self.last = sample;
    }

    fn noise(
        &self,
        (kind, unit): (SensorKind, Unit),
        moved: Option<Moved>,
    ) -> Result<(SensorNoise, Vec<Remark>), Refusal> {
        let (interval, gaps) = (self.clock.interval(), self.clock.gaps());
        let samples = self.samples + gaps.bridged;
        let duration = samples as f64 * interval;
        if samples < FEWEST || duration < SHORTEST {
            return Err(Refusal::TooShort { samples, duration });
        }
        if gaps.bridged as f64 > BRIDGED * samples as f64 {
            return Err(Refusal::Missing { missing: gaps.bridged, of: samples });
        }
        let mut remarks = self.remarks(kind, &gaps, moved);
        let mean = self.origin + self.sum / self.samples as f64;
        let points = self.cascade.points();
        // The finest average shows whether an axis moves at all.
        let moves = |axis: usize| points.iter().any(|point| point.variance[axis] > 0.0);
        let moving = std::array::from_fn::<bool, 3, _>(moves);
        let sums = Sums::new(&points, samples);
        let estimator = Estimator::new(&points, &sums, samples, interval);
        let shortest = self.shortest();
        let axes = std::array::from_fn(|axis| {
            if !moving[axis] {
                remarks.push(Remark::Constant { sensor: kind, axis: AXES[axis], value: mean[axis] });
                return None;
            }
            if let Some(Hidden { step, deviation }) = self.rounding.hidden(axis) {
                remarks.push(Remark::Rounded { sensor: kind, axis: AXES[axis], step, deviation, unit });
                return None;
            }
            let found = estimator.axis(axis, mean[axis], shortest);
            remarks.extend(odd(kind, AXES[axis], &found, shortest.max(1.0) * interval));
            Some(found)
        });
        Ok((SensorNoise { samples: self.samples, interval, duration, axes }, remarks))
    }

    /// Samples of the shortest average that is fitted.
    fn shortest(&self) -> f64 {
        self.rounding.readings().map_or(1.0, |times| REPETITIONS * times)
    }

    fn remarks(&self, sensor: SensorKind, gaps: &Gaps, moved: Option<Moved>) -> Vec<Remark> {
        /// Rms of intervals that is worth a word.
        const JITTER: f64 = 0.01;
        let (jitter, interval) = (self.clock.jitter(), self.clock.interval());
        let mut remarks = Vec::new();
        if jitter > JITTER {
            remarks.push(Remark::Jitter { sensor, jitter, interval });
        }
        if let Some(first) = gaps.first {
            let Gaps { bridged, gaps, longest, .. } = *gaps;
            let excess = 0.5 * self.by_lines / (self.samples + bridged) as f64;
            remarks.push(Remark::Gaps { sensor, first, bridged, gaps, longest, excess });
        }
        if let Some(moved) = moved {
            let Moved { blocks, of, deviation: (_, time), .. } = moved;
            remarks.push(Remark::Knocked { sensor, blocks, of, time });
        }
        let shortest = self.shortest();
        if shortest > 1.0 {
            let (times, shortest) = (shortest / REPETITIONS, shortest * interval);
            remarks.push(Remark::Repeated { sensor, times, shortest });
        }
        remarks
    }
}

const AXES: [char; 3] = ['x', 'y', 'z'];

/// What a straight line over so many missing samples adds to the squares of the weights of samples in a mean, and so to N²: each of its
/// ends gets half a weight more for each. Source: ours. Not taken into account: short averages, which the line smooths.
fn by_a_line(missing: f64) -> f64 {
    0.5 * missing * (missing + 2.0)
}

fn odd(sensor: SensorKind, axis: char, found: &Axis, begin: f64) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let misfit = &found.misfit;
    // The next length after the shortest may be half as long again.
    if misfit.from > 2.0 * begin {
        remarks.push(Remark::Filtered { sensor, axis, from: misfit.from });
    }
    if misfit.inflation > 1.0 {
        let (chi_square, freedom) = (misfit.chi_square, misfit.freedom);
        remarks.push(Remark::Misfit { sensor, axis, chi_square, freedom, inflation: misfit.inflation });
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    #[test]
    fn an_axis_whose_rounding_hides_its_noise_has_no_coefficients_and_the_others_have() {
        let mut random = Random::new(7, Purpose::Noise);
        let mut stream = SensorStream::new(SensorKind::Gyr);
        let rounded = |value: f64, step: f64| 1e-3 * (value / step).round() * step;
        for k in 0..20_000 {
            let noise = [random.normal(), random.normal(), random.normal()];
            let sample =
                Vector3::new(rounded(2.7 + noise[0], 6.0), rounded(noise[1], 2.0), rounded(noise[2], 0.1));
            stream.push(0.01 * f64::from(k), &sample);
        }
        stream.end();
        let (noise, remarks) = stream.noise().unwrap();
        assert!(noise.axes[0].is_none() && noise.axes[1].is_some() && noise.axes[2].is_some());
        let [remark @ Remark::Rounded { axis: 'x', step, .. }] = &remarks[..] else { panic!("{remarks:?}") };
        assert!((step / 6e-3 - 1.0).abs() < 1e-9, "{step}");
        let text = remark.to_string();
        assert!(text.contains("gyr, axis x") && text.contains("6.000e-3 rad/s"), "{text}");
    }

    #[test]
    fn a_line_adds_to_the_squared_weights_what_its_samples_give_to_its_ends() {
        for missing in 1..=10 {
            let shares = (1..=missing).map(|k| f64::from(k) / f64::from(missing + 1));
            let end = 1.0 + shares.sum::<f64>();
            let added = 2.0 * end * end - f64::from(missing + 2);
            assert!((by_a_line(f64::from(missing)) - added).abs() < 1e-12, "{missing}");
        }
    }
}
