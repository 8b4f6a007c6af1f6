//! Overlapping Allan variances of a triad as samples arrive, in memory that does not grow with their number.
//!
//! ```text
//! σ²(m) = 1 / (2 m² M) · Σ_n (x_{n+2m} − 2 x_{n+m} + x_n)²        x_n: sum of the first n samples, M: number of terms
//! ```
//!
//! The definition: W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), eq. (11). Up to
//! [`LONGEST`] samples n goes by one, and the estimate is that equation. For longer averages n goes by a stride of
//! m / [`LONGEST`] at the most, so that a ring of sums of twice that length suffices: each stage of the cascade takes every
//! second sum of the one below. The sums are exact; only some of the overlapping terms are left out, which add nothing
//! that their neighbours, 1/8192 of m away, do not say.
//!
//! Averages are 1, 2, 3, 4, 6, 8, 12 … samples long, two in an octave.

use nalgebra::Vector3;

/// Longest average of which every overlapping term is taken, samples.
pub const LONGEST: u64 = 1 << 13;
/// Stages beyond the first: averages of up to 2³⁵ samples.
const STAGES: u32 = 22;

/// Sums of one stride.
#[derive(Clone, Debug)]
struct Stage {
    /// Samples from one sum to the next.
    stride: u64,
    /// The last sums, 2 · [`LONGEST`] at the most.
    ring: Vec<Vector3<f64>>,
    /// Sums of the stretch so far.
    pushed: usize,
    tallies: Vec<Tally>,
}

/// Squared second differences of one length.
#[derive(Clone, Debug)]
struct Tally {
    /// Strides of an average.
    factor: usize,
    sum: Vector3<f64>,
    terms: u64,
}

/// The overlapping Allan variance at one length of averages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllanPoint {
    /// m: samples of an average.
    pub samples: u64,
    /// σ² of each axis, unit².
    pub variance: Vector3<f64>,
    /// M: terms of the sum.
    pub terms: u64,
    /// Samples that the terms' beginnings span: terms times their stride.
    pub span: f64,
}

/// Takes the samples of one triad in order.
#[derive(Clone, Debug)]
pub struct Cascade {
    stages: Vec<Stage>,
    sum: Vector3<f64>,
    /// Samples of the stretch so far.
    count: u64,
}

impl Default for Cascade {
    fn default() -> Self {
        let longest = LONGEST as usize;
        let mut factors: Vec<usize> = (0..).map(|k| 1 << k).take_while(|factor| *factor <= longest).collect();
        factors.extend((1..).map(|k| 3 << (k - 1)).take_while(|factor| *factor <= longest));
        factors.sort_unstable();
        let mut stages = vec![Stage::new(1, factors)];
        stages.extend((1..=STAGES).map(|k| Stage::new(1 << k, vec![3 * longest / 4, longest])));
        let mut cascade = Self { stages, sum: Vector3::zeros(), count: 0 };
        cascade.interrupt();
        cascade
    }
}

impl Cascade {
    /// The next sample. A constant taken from all of them changes nothing and keeps digits.
    pub fn push(&mut self, sample: &Vector3<f64>) {
        self.sum += sample;
        self.count += 1;
        for stage in &mut self.stages {
            if !self.count.is_multiple_of(stage.stride) {
                break;
            }
            stage.push(self.sum);
        }
    }

    /// Samples are missing here: no average goes across.
    pub fn interrupt(&mut self) {
        self.sum = Vector3::zeros();
        self.count = 0;
        for stage in &mut self.stages {
            stage.pushed = 0;
            stage.push(self.sum);
        }
    }

    /// Variances at all lengths that there are terms of, the shortest first.
    pub fn points(&self) -> Vec<AllanPoint> {
        let of_stage = |stage: &Stage| {
            let stride = stage.stride;
            let point = |tally: &Tally| {
                let samples = stride * tally.factor as u64;
                let scale = 2.0 * (samples as f64).powi(2) * tally.terms as f64;
                let span = (tally.terms * stride) as f64;
                AllanPoint { samples, variance: tally.sum / scale, terms: tally.terms, span }
            };
            stage.tallies.iter().filter(|tally| tally.terms > 0).map(point).collect::<Vec<_>>()
        };
        self.stages.iter().flat_map(of_stage).collect()
    }
}

impl Stage {
    fn new(stride: u64, factors: Vec<usize>) -> Self {
        let tally = |factor| Tally { factor, sum: Vector3::zeros(), terms: 0 };
        Self { stride, ring: Vec::new(), pushed: 0, tallies: factors.into_iter().map(tally).collect() }
    }

    fn push(&mut self, sum: Vector3<f64>) {
        const RING: usize = 2 * LONGEST as usize;
        let now = self.pushed;
        for tally in &mut self.tallies {
            if 2 * tally.factor > now {
                break;
            }
            let middle = self.ring[(now - tally.factor) % RING];
            let first = self.ring[(now - 2 * tally.factor) % RING];
            let difference = sum - middle * 2.0 + first;
            tally.sum += difference.component_mul(&difference);
            tally.terms += 1;
        }
        // The oldest sum makes room once it has been used.
        match self.ring.get_mut(now % RING) {
            Some(oldest) => *oldest = sum,
            None => self.ring.push(sum),
        }
        self.pushed += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    fn samples(count: usize) -> Vec<Vector3<f64>> {
        let mut random = Random::new(3, Purpose::Noise);
        (0..count).map(|_| random.normals()).collect()
    }

    /// The equation as it stands.
    fn defined(samples: &[Vector3<f64>], m: usize, stride: usize) -> Vector3<f64> {
        let mut sums = vec![Vector3::zeros()];
        samples.iter().for_each(|sample| sums.push(sums[sums.len() - 1] + sample));
        let starts: Vec<usize> = (0..sums.len() - 2 * m).step_by(stride).collect();
        let squares = starts.iter().map(|n| {
            let difference = sums[n + 2 * m] - sums[n + m] * 2.0 + sums[*n];
            difference.component_mul(&difference)
        });
        squares.sum::<Vector3<f64>>() / (2.0 * (m * m) as f64 * starts.len() as f64)
    }

    #[test]
    fn each_variance_is_that_of_its_definition() {
        let samples = samples(40_000);
        let mut cascade = Cascade::default();
        samples.iter().for_each(|sample| cascade.push(sample));
        let points = cascade.points();
        assert_eq!(
            points.iter().map(|point| point.samples).take(8).collect::<Vec<_>>(),
            [1, 2, 3, 4, 6, 8, 12, 16]
        );
        assert_eq!(points.last().map(|point| point.samples), Some(16_384));
        for point in points {
            let stride = point.samples.div_ceil(LONGEST) as usize;
            let expected = defined(&samples, point.samples as usize, stride);
            assert!((point.variance - expected).norm() < 1e-11 * expected.norm(), "{point:?} {expected}");
            assert_eq!(point.span, (point.terms * stride as u64) as f64);
        }
    }

    #[test]
    fn no_average_goes_across_an_interruption() {
        let samples = samples(600);
        let mut cascade = Cascade::default();
        for (row, sample) in samples.iter().enumerate() {
            if row == 250 {
                cascade.interrupt();
            }
            cascade.push(sample);
        }
        for point in cascade.points() {
            let m = point.samples as usize;
            let parts = [&samples[..250], &samples[250..]].into_iter().filter(|part| part.len() >= 2 * m);
            let weighted = parts.map(|part| {
                let terms = (part.len() + 1 - 2 * m) as f64;
                (defined(part, m, 1) * terms, terms)
            });
            let (sum, terms) =
                weighted.fold((Vector3::zeros(), 0.0), |(a, b), (sum, terms)| (a + sum, b + terms));
            assert_eq!(point.terms as f64, terms);
            assert!((point.variance - sum / terms).norm() < 1e-12, "{m}");
        }
    }

    #[test]
    fn memory_does_not_grow_with_the_recording() {
        let mut cascade = Cascade::default();
        (0..1_000_000).for_each(|k| cascade.push(&Vector3::repeat(f64::from(k % 7))));
        for stage in &cascade.stages {
            assert!(stage.ring.capacity() <= 2 * LONGEST as usize, "{}", stage.ring.capacity());
        }
    }
}
