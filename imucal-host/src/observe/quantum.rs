//! The step of a converter, from the samples.

use std::sync::{LazyLock, OnceLock};

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::recording::{Recording, SensorKind, check::integrity::Integrity};

/// The steps of a recording's converters, each found where it is first asked for.
#[derive(Debug)]
pub struct ConverterSteps<'a> {
    recording: &'a Recording,
    integrity: &'a Integrity,
    found: [OnceLock<Vector3<f64>>; 3],
}

impl<'a> ConverterSteps<'a> {
    /// Of what is usable in a recording.
    pub fn new(recording: &'a Recording, integrity: &'a Integrity) -> Self {
        Self { recording, integrity, found: Default::default() }
    }

    /// Step of each axis of a sensor, as [`quantum`] finds it; zero without the sensor.
    pub fn of(&self, kind: SensorKind) -> Vector3<f64> {
        *self.found[kind as usize].get_or_init(|| {
            let there = self.recording.sensor(kind).zip(self.integrity.sensor(kind));
            there.map_or_else(Vector3::zeros, |(triple, found)| quantum(&triple.values, &found.usable))
        })
    }
}

/// Smallest difference between two values that an axis shows; zero for an axis that shows but one.
///
/// Of samples that are not quantised it is far below their noise, so that nothing follows from it.
pub fn quantum(values: &[Vector3<f64>], usable: &[bool]) -> Vector3<f64> {
    let of_axis = |axis: usize| {
        let finite = values.iter().zip(usable).filter(|(v, usable)| **usable && v[axis].is_finite());
        let sorted = distinct(finite.map(|(v, _)| v[axis]));
        let extent = sorted.first().zip(sorted.last()).map_or(0.0, |(low, high)| high - low);
        // Values of one code that went through another unit may differ by rounding.
        let least = 1e-9 * extent;
        let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > least);
        let step = steps.fold(f64::INFINITY, f64::min);
        if step.is_finite() { step } else { 0.0 }
    };
    let mut steps = Vector3::zeros();
    steps.as_mut_slice().par_iter_mut().enumerate().for_each(|(axis, step)| *step = of_axis(axis));
    steps
}

/// Each value once, ascending: a converter puts out few of them, so that they are found before they are sorted.
fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut seen = Seen::with_places(PLACES_AT_FIRST);
    values.for_each(|value| seen.insert(value.to_bits()));
    let mut ranks: Vec<i64> = seen.all().map(rank).collect();
    ranks.sort_unstable();
    ranks.into_iter().map(|rank| f64::from_bits(self::rank(rank as u64) as u64)).collect()
}

/// A number's bits as an integer in the order of [`f64::total_cmp`], which sorts faster; of that, the bits.
fn rank(bits: u64) -> i64 {
    let sign = (bits as i64) >> 63;
    bits as i64 ^ (sign as u64 >> 1) as i64
}

/// Binary logarithm of the places at first: a recording of some minutes has fewer than half as many distinct values.
const PLACES_AT_FIRST: u32 = 14;
/// The bits of no finite number.
const NOTHING: u64 = u64::MAX;
/// See [`Seen::place`].
const MIX: u64 = 0x9e37_79b9_7f4a_7c15;

/// The bits of numbers, each once: a table with open addresses, at most half of which are taken (Knuth, *The Art of Computer
/// Programming* 3, 6.4, algorithm L). Most numbers are in it already, and need one look.
struct Seen {
    places: Vec<u64>,
    taken: usize,
}

impl Seen {
    fn with_places(logarithm: u32) -> Self {
        Self { places: vec![NOTHING; 1 << logarithm], taken: 0 }
    }

    fn insert(&mut self, bits: u64) {
        let place = self.place(bits);
        if self.places[place] == bits {
            return;
        }
        self.places[place] = bits;
        self.taken += 1;
        if 2 * self.taken > self.places.len() {
            let mut larger = Self::with_places(self.places.len().ilog2() + 1);
            self.all().for_each(|bits| larger.insert(bits));
            *self = larger;
        }
    }

    /// Where a number is, or would be: from the upper bits of a product on (the same, multiplicative hashing).
    fn place(&self, bits: u64) -> usize {
        let last = self.places.len() - 1;
        let mut place = (bits.wrapping_mul(MIX) >> (64 - self.places.len().ilog2())) as usize;
        while self.places[place] != bits && self.places[place] != NOTHING {
            place = (place + 1) & last;
        }
        place
    }

    fn all(&self) -> impl Iterator<Item = u64> {
        self.places.iter().copied().filter(|bits| *bits != NOTHING)
    }
}

/// Mean squared errors that a converter's steps leave in the means of samples, whatever their number; each rest is of one
/// value, and all have the same noise.
///
/// A value that moves by much less than a step is put out as one code, and lies within half a step of it: q²/12. Of
/// two codes or more, noise of a size σ ≪ q has the value near the edge between them, and noise of σ ≳ q/2 makes the
/// mean exact (dither; Widrow & Kollár 2008, 5). Which it is follows from the codes' counts, those of all rests together: this is
/// the mean over values and σ, log-uniform, weighed by the counts' likelihood, of the squared difference between the mean
/// of the codes and the value. Some samples may be of a rest's end that moves. Not modelled: noise that is not normal.
pub fn variances_of_means<I: Iterator<Item = f64>>(step: f64, rests: impl Iterator<Item = I>) -> Vec<f64> {
    let rests: Vec<Option<Codes>> = rests.map(|samples| Codes::of(step, samples)).collect();
    if rests.iter().all(Option::is_none) {
        return vec![0.0; rests.len()];
    }
    let given = |table: &Vec<f64>| rests.iter().map(|codes| Some(codes.as_ref()?.given(table))).collect();
    let by_sigma: Vec<Vec<Option<(f64, f64)>>> = TABLES.iter().map(given).collect();
    let logs: Vec<f64> =
        by_sigma.iter().map(|rests| rests.iter().flatten().map(|(log, _)| log).sum()).collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weight: f64 = logs.iter().map(|log| (log - most).exp()).sum();
    // Values between those of the grid are as good.
    let between = f64::from(VALUES).recip().powi(2) / 12.0;
    let variance = |rest: usize| {
        let shares = logs.iter().map(|log| (log - most).exp() / weight);
        let of_sigma = shares.zip(&by_sigma).map(|(share, rests)| Some(share * rests[rest]?.1));
        of_sigma.sum::<Option<f64>>().map_or(0.0, |variance| step * step * (variance + between))
    };
    (0..rests.len()).map(variance).collect()
}

/// Share of samples that may be of a rest's end that moves.
const MOVING: f64 = 0.003;
/// Steps between the outermost codes from which noise makes the mean exact.
const DITHER: u64 = 5;
/// Codes between the outermost of samples that are counted each in its place.
const PLACES: u64 = 1 << 12;
/// Values a step.
const VALUES: i32 = 40;
/// Least σ, how many, and how many times the one before each is, in steps: to one step.
const SIGMAS: (f64, i32, f64) = (0.001, 31, 1.26);

/// Codes of the samples of a rest, less the most frequent one.
struct Codes {
    mean: f64,
    counts: Vec<(i32, f64)>,
}

impl Codes {
    /// `None` where steps leave no error: none are known, or noise goes over many of them.
    fn of(step: f64, samples: impl Iterator<Item = f64>) -> Option<Self> {
        if step <= 0.0 {
            return None;
        }
        let codes: Vec<i64> = samples.map(|x| code(step, x)).collect();
        let ends = [*codes.iter().min()?, *codes.iter().max()?];
        let total = codes.len() as f64;
        // Of few samples every code counts, so that two of them tell how far the noise goes.
        if MOVING * total < 1.0 && ends[1].abs_diff(ends[0]) > DITHER {
            return None;
        }
        let mut counts = counted(codes, ends);
        let most = counts.iter().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        counts.retain(|(code, count)| code.abs_diff(most) < 2 || *count > MOVING * total);
        let extent = counts.last()?.0.abs_diff(counts.first()?.0);
        if extent > DITHER {
            return None;
        }
        let counts: Vec<(i32, f64)> =
            counts.iter().map(|(code, count)| ((code - most) as i32, *count)).collect();
        let kept: f64 = counts.iter().map(|(_, count)| count).sum();
        let mean = counts.iter().map(|(code, count)| f64::from(*code) * count).sum::<f64>() / kept;
        Some(Self { mean, counts })
    }

    /// Logarithm of the likelihood of a σ, values of all sizes alike, and the mean's squared error, steps².
    fn given(&self, table: &[f64]) -> (f64, f64) {
        let (low, high) = (-VALUES, VALUES);
        let middle = (self.mean * f64::from(VALUES)).round() as i32;
        let value = |k: i32| f64::from(k) / f64::from(VALUES);
        let log = |k: i32| {
            let of_code =
                |(code, count): &(i32, f64)| count * table[(code * VALUES - k).unsigned_abs() as usize];
            self.counts.iter().map(of_code).sum::<f64>()
        };
        let logs: Vec<(f64, f64)> =
            (middle + low..=middle + high).map(|k| (log(k), self.mean - value(k))).collect();
        let most = logs.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
        let (weight, sum) = logs.iter().fold((0.0, 0.0), |(weight, sum), (log, error)| {
            let share = (log - most).exp();
            (weight + share, sum + share * error * error)
        });
        (most + f64::ln(weight), sum / weight)
    }
}

/// The nearest multiple of the step. `f64::round` is a call on x86-64, this is not.
fn code(step: f64, x: f64) -> i64 {
    (x / step + 0.5_f64.copysign(x)) as i64
}

/// Each code between two ends and its count, ascending.
fn counted(mut codes: Vec<i64>, [low, high]: [i64; 2]) -> Vec<(i64, f64)> {
    // Noise goes over few codes, most of the time.
    if high.abs_diff(low) < PLACES {
        let mut counts = vec![0u32; high.abs_diff(low) as usize + 1];
        codes.iter().for_each(|code| counts[code.abs_diff(low) as usize] += 1);
        let there = (0..).zip(counts).filter(|(_, count)| *count > 0);
        return there.map(|(place, count)| (low + place, f64::from(count))).collect();
    }
    codes.sort_unstable();
    codes.chunk_by(|a, b| a == b).map(|alike| (alike[0], alike.len() as f64)).collect()
}

/// Of each σ.
static TABLES: LazyLock<Vec<Vec<f64>>> =
    LazyLock::new(|| (0..SIGMAS.1).map(|k| table(SIGMAS.0 * SIGMAS.2.powi(k))).collect());

/// Logarithm of the probability of a code, by its distance from the value in grid steps.
fn table(sigma: f64) -> Vec<f64> {
    let farthest = 2 * (DITHER as i32 + 2) * VALUES;
    let share = |k: i32| (1.0 - MOVING) * probability(f64::from(k) / f64::from(VALUES), sigma) + MOVING / 3.0;
    (0..=farthest).map(|k| share(k).ln()).collect()
}

/// Of a code so far from the value, noise of `sigma`, in steps.
fn probability(away: f64, sigma: f64) -> f64 {
    let below = |edge: f64| 0.5 * libm::erfc(-edge / (sigma * std::f64::consts::SQRT_2));
    // By the smaller tail, so that it keeps its digits.
    below(0.5 - away) - below(-0.5 - away)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    #[test]
    fn the_step_of_counts_is_found_and_a_dropout_is_none() {
        let value = |k: u32| f64::from(k * k % 11) * 0.25;
        let mut values: Vec<_> = (0..60).map(|k| Vector3::new(value(k), 2.0 * value(k), 3.0)).collect();
        values[7] = Vector3::repeat(f64::NAN);
        assert_eq!(quantum(&values, &[true; 60]), Vector3::new(0.25, 0.5, 0.0));
    }

    /// Error of the mean of 2000 samples over its stated one, root mean square over 300 values.
    fn score(sigma: f64) -> (f64, f64) {
        let step = 0.02;
        let mut random = Random::new(3, Purpose::Noise);
        let (mut square, mut stated) = (0.0, 0.0);
        for _ in 0..300 {
            let value = random.between(-0.5, 0.5);
            let samples: Vec<f64> =
                (0..2000).map(|_| ((value + random.normal() * sigma * step) / step).round() * step).collect();
            let white = (sigma * step).powi(2) / 2000.0;
            let variance = variances_of_means(step, std::iter::once(samples.iter().copied()))[0] + white;
            let error = samples.iter().sum::<f64>() / 2000.0 - value;
            square += error * error / variance / 300.0;
            stated += variance.sqrt() / step / 300.0;
        }
        (square.sqrt(), stated)
    }

    #[test]
    fn codes_are_counted_whether_they_are_near_each_other_or_far() {
        let expected = [(-3, 2.0), (0, 1.0), (7, 3.0)];
        assert_eq!(counted(vec![7, -3, 7, 0, -3, 7], [-3, 7]), expected);
        let far = i64::MAX;
        let of_all = counted(vec![7, far, -3, 7, 0, -3, 7], [-3, far]);
        assert_eq!((&of_all[..3], of_all[3]), (&expected[..], (far, 1.0)));
        assert_eq!(counted(vec![far, far], [far, far]), [(far, 2.0)]);
    }

    #[test]
    fn each_of_very_many_values_is_kept_once() {
        let value = |k: u32| f64::from(k % 30_000) * -0.1;
        let found = distinct((0..60_000).map(value));
        let expected: Vec<f64> = (0..30_000).rev().map(value).collect();
        assert_eq!(found, expected);
        assert!(distinct(std::iter::empty()).is_empty());
    }

    #[test]
    fn ranks_are_in_the_order_of_the_numbers_and_give_them_back() {
        let numbers = [-f64::MAX, -1.5, -1.0, -f64::MIN_POSITIVE, -0.0, 0.0, 5e-324, 0.3, 7.0, f64::MAX];
        assert!(numbers.is_sorted_by_key(|x| rank(x.to_bits())));
        assert!(numbers.iter().all(|x| rank(rank(x.to_bits()) as u64) as u64 == x.to_bits()));
    }

    #[test]
    fn samples_that_move_at_a_rest_s_end_are_no_dither() {
        let moving = (0..8).map(f64::from);
        let variance = |moved: usize| {
            let samples = std::iter::repeat_n(0.0, 2000).chain(moving.clone().take(moved));
            variances_of_means(1.0, std::iter::once(samples))[0]
        };
        assert!(variance(1) * 12.0 > 0.5, "{}", variance(1));
        assert!(variance(8) > 0.5 * variance(1), "{} {}", variance(8), variance(1));
    }

    #[test]
    fn noise_that_other_rests_show_has_a_lone_code_s_value_far_from_its_edges() {
        let alone = std::iter::repeat_n(0.0, 200).collect::<Vec<f64>>();
        let mut random = Random::new(6, Purpose::Noise);
        let mut all = vec![alone];
        for value in [0.1, 0.15, 0.2, 0.3, 0.4, 0.45] {
            all.push((0..200).map(|_| f64::round(value + 0.2 * random.normal())).collect());
        }
        let of_first =
            |all: &[Vec<f64>]| variances_of_means(1.0, all.iter().map(|rest| rest.iter().copied()))[0];
        let (lone, among) = (of_first(&all[..1]), of_first(&all));
        assert!(among < 0.3 * lone, "{among} {lone}");
    }

    #[test]
    fn a_mean_errs_by_its_steps_as_much_as_their_codes_say() {
        // Errors within a step are spread evenly, not normally; noise of a half step is left with next to none.
        for (sigma, least, most) in [(1e-3, 0.25, 0.3), (0.15, 0.05, 0.3), (0.6, 0.0, 0.03)] {
            let (score, stated) = score(sigma);
            println!("{sigma}: errors {score:.2} of those stated, {stated:.3} steps");
            assert!(
                (0.6..1.4).contains(&score) && (least..most).contains(&stated),
                "{sigma}: {score} {stated}"
            );
        }
    }
}
