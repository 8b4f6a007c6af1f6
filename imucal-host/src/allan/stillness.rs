//! Whether a sensor was still, judged in constant memory as samples arrive.
//!
//! Blocks of a second have a variance, and a step of their mean to the next block. Of a still sensor both are alike all
//! the time; a hand, a motor or a passing magnet makes some of them many times as large. Both are counted in classes by
//! size, a quarter of an octave each, so that the usual one is known at the end.

use nalgebra::Vector3;

use crate::recording::Unit;

/// Length of a block, s, and its samples at least.
const BLOCK: f64 = 1.0;
const LEAST: usize = 16;
/// Classes of a factor of two.
const CLASSES: f64 = 4.0;
/// Class of one unit².
const ONE: usize = 400;
/// A block that exceeds the median's square root by this factor has moved: three times the noise, for steps ten.
const NOISIER: f64 = 3.0;
const FURTHER: f64 = 10.0;
/// What moved may add to the sum of the others, in all.
const HARMLESS: f64 = 0.01;

/// Sizes below which nothing has moved, and above which everything has, for the SI unit of a kind of sensor; of arbitrary units there are none.
struct Bounds {
    /// Standard deviation within a block or step of its mean that noise of any such sensor reaches.
    least: f64,
    /// Standard deviation within a block that no noise reaches.
    noise: f64,
    /// Step of the mean that no noise reaches.
    step: f64,
}

impl Bounds {
    fn of(unit: Unit) -> Self {
        match unit {
            Unit::MetrePerSecondSquared => Self { least: 0.02, noise: 1.0, step: 0.1 },
            Unit::RadianPerSecond => Self { least: 0.002, noise: 0.1, step: 0.02 },
            Unit::MicroTesla => Self { least: 0.5, noise: 10.0, step: 5.0 },
            _ => Self { least: 0.0, noise: f64::INFINITY, step: f64::INFINITY },
        }
    }
}

/// Counts and sums of squares by size.
#[derive(Clone, Debug)]
struct Classes {
    counts: Vec<(u64, f64)>,
    largest: (f64, f64),
}

impl Classes {
    fn push(&mut self, square: f64, time: f64) {
        let class = (square.max(f64::MIN_POSITIVE).log2() * CLASSES).floor() + ONE as f64;
        let class = (class.max(0.0) as usize).min(self.counts.len() - 1);
        self.counts[class].0 += 1;
        self.counts[class].1 += square;
        if square > self.largest.0 {
            self.largest = (square, time);
        }
    }

    fn median(&self) -> f64 {
        let total: u64 = self.counts.iter().map(|(count, _)| count).sum();
        let mut left = total / 2;
        for (count, sum) in &self.counts {
            if left < *count {
                return sum / *count as f64;
            }
            left -= count;
        }
        0.0
    }

    /// Number and share of the sum of those whose class is above a size.
    fn above(&self, square: f64) -> (u64, f64) {
        let class = (square.max(f64::MIN_POSITIVE).log2() * CLASSES).floor() + ONE as f64;
        let first = (class.max(0.0) as usize + 1).min(self.counts.len());
        let sum = |of: &[(u64, f64)]| of.iter().fold((0, 0.0), |(n, s), (count, sum)| (n + count, s + sum));
        let ((_, below), (count, above)) = (sum(&self.counts[..first]), sum(&self.counts[first..]));
        (count, if below > 0.0 { above / below } else { above })
    }
}

/// Follows one sensor's blocks.
#[derive(Clone, Debug)]
pub struct Stillness {
    unit: Unit,
    /// Samples of a block.
    length: usize,
    count: usize,
    begin: f64,
    sum: Vector3<f64>,
    squares: f64,
    before: Option<Vector3<f64>>,
    blocks: u64,
    within: Classes,
    steps: Classes,
}

/// What moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Blocks of a second that moved.
    pub blocks: u64,
    /// All of them.
    pub of: u64,
    /// The largest standard deviation within one, and its time, s.
    pub deviation: (f64, f64),
    /// The usual one.
    pub usual_deviation: f64,
    /// The largest step of the mean from one to the next, and its time, s.
    pub step: (f64, f64),
    /// The usual one.
    pub usual_step: f64,
    /// It spoils the variances.
    pub spoils: bool,
}

impl Stillness {
    /// Of a sensor whose samples are in this unit and `interval` s apart.
    pub fn new(unit: Unit, interval: f64) -> Self {
        let classes = Classes { counts: vec![(0, 0.0); 2 * ONE], largest: (0.0, 0.0) };
        Self {
            unit,
            length: ((BLOCK / interval).round() as usize).max(LEAST),
            count: 0,
            begin: 0.0,
            sum: Vector3::zeros(),
            squares: 0.0,
            before: None,
            blocks: 0,
            within: classes.clone(),
            steps: classes,
        }
    }

    /// The next sample, less a constant, and its time, s.
    pub fn push(&mut self, time: f64, sample: &Vector3<f64>) {
        if self.count == 0 {
            self.begin = time;
        }
        self.count += 1;
        self.sum += sample;
        self.squares += sample.norm_squared();
        if self.count < self.length {
            return;
        }
        let mean = self.sum / self.count as f64;
        self.within.push((self.squares / self.count as f64 - mean.norm_squared()).max(0.0), self.begin);
        if let Some(before) = self.before {
            self.steps.push((mean - before).norm_squared(), self.begin);
        }
        self.before = Some(mean);
        self.blocks += 1;
        (self.count, self.sum, self.squares) = (0, Vector3::zeros(), 0.0);
    }

    /// What moved; `None` where nothing did.
    pub fn moved(&self) -> Option<Moved> {
        let bounds = Bounds::of(self.unit);
        let (usual, usual_step) = (self.within.median(), self.steps.median());
        let floor = bounds.least * bounds.least;
        let (noisy, noise) = self.within.above((NOISIER * NOISIER * usual).max(floor));
        let (stepped, steps) = self.steps.above((FURTHER * FURTHER * usual_step).max(floor));
        let always = usual.sqrt() > bounds.noise || usual_step.sqrt() > bounds.step;
        let root = |(square, time): (f64, f64)| (square.sqrt(), time);
        (always || noisy + stepped > 0).then(|| Moved {
            blocks: if always { self.blocks } else { noisy.max(stepped) },
            of: self.blocks,
            deviation: root(self.within.largest),
            usual_deviation: usual.sqrt(),
            step: root(self.steps.largest),
            usual_step: usual_step.sqrt(),
            spoils: always || noise > HARMLESS || steps > HARMLESS,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::SensorKind;
    use crate::simulator::random::{Purpose, Random};

    fn judged(kind: SensorKind, signal: impl Fn(f64) -> Vector3<f64>) -> Option<Moved> {
        let mut random = Random::new(2, Purpose::Noise);
        let mut stillness = Stillness::new(Unit::si(kind), 0.01);
        for row in 0..60_000 {
            let time = f64::from(row) * 0.01;
            stillness.push(time, &(random.normals() * 0.005 + signal(time)));
        }
        stillness.moved()
    }

    #[test]
    fn noise_and_slow_drift_are_still() {
        for kind in [SensorKind::Acc, SensorKind::Gyr] {
            assert_eq!(judged(kind, |time| Vector3::x() * 1e-4 * time), None);
        }
    }

    #[test]
    fn a_turn_and_a_knock_are_seen_with_their_times() {
        let turn = judged(SensorKind::Gyr, |t| {
            if (300.0..303.0).contains(&t) { Vector3::z() } else { Vector3::zeros() }
        });
        let turn = turn.unwrap();
        assert!(turn.spoils && [300.0, 303.0].contains(&turn.step.1) && turn.step.0 > 0.9, "{turn:?}");
        let knock = judged(SensorKind::Acc, |t| {
            if (99.5..99.52).contains(&t) { Vector3::x() * 0.3 } else { Vector3::zeros() }
        });
        let knock = knock.unwrap();
        assert!(knock.blocks == 1 && (98.9..99.6).contains(&knock.deviation.1), "{knock:?}");
    }

    #[test]
    fn what_moves_all_the_time_is_not_still() {
        let shaken = judged(SensorKind::Acc, |t| Vector3::x() * 3.0 * (20.0 * t).sin());
        assert!(shaken.is_some_and(|moved| moved.spoils && moved.blocks == moved.of));
    }

    #[test]
    fn in_arbitrary_units_a_sensor_is_judged_by_what_is_usual_for_it() {
        let mut random = Random::new(5, Purpose::Noise);
        let (mut still, mut knocked) =
            (Stillness::new(Unit::Arbitrary, 0.01), Stillness::new(Unit::Arbitrary, 0.01));
        for k in 0..12_000 {
            let sample = random.normals() * 2000.0;
            still.push(0.01 * f64::from(k), &sample);
            let by = if k == 6000 { 1e6 } else { 0.0 };
            knocked.push(0.01 * f64::from(k), &(sample + Vector3::x() * by));
        }
        assert_eq!(still.moved(), None);
        assert!(knocked.moved().is_some());
    }
}
