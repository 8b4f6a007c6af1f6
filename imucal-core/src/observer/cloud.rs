//! Points of a cloud, chosen by distance: what a magnetometer shows while it is turned about, in a fixed number of slots.
//!
//! ```text
//! x̃_k = median(x_{k−2}, x_{k−1}, x_k)       a slot for x̃ if |x̃ − s| ≥ d for every slot s;   d ← 1.25 d when all are full
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x̃ | median of three samples in succession, axis by axis: a spike of one sample is no point |
//! | s | a point that has a slot |
//! | d | [`CloudObserver::apart`]: slots are at least so far apart |
//!
//! Where all slots are full, points that are nearer than the larger d to an earlier one lose theirs. So the points are spread
//! over all that has been seen, whatever the order and however long a direction was looked at.
//!
//! Source: Charikar, Chekuri, Feder and Motwani (1997), of the doubling algorithm for k centres. Not done here: means of many
//! samples; a fit weighs each point alone.

use heapless::Vec;
use nalgebra::Vector3;

use crate::scalar::Scalar;

/// By what slots are further apart once all are full.
const WIDER: f64 = 1.25;
/// A sample nearer than this share of d to the last one that was looked at is not looked at.
const SKIPPED: f64 = 0.25;

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chosen {
    /// It has a slot.
    New,
    /// It is near to a point that has one, or to the sample before.
    Near,
    /// It is not finite, or the first two samples are not there yet.
    Unusable,
}

/// Chooses points of a cloud as samples arrive.
#[derive(Clone, Debug)]
pub struct CloudObserver<T: Scalar, const N: usize> {
    points: Vec<Vector3<T>, N>,
    apart: T,
    /// The two samples before, the older first.
    before: [Option<Vector3<T>>; 2],
    /// The last median that was compared with the slots.
    compared: Option<Vector3<T>>,
}

impl<T: Scalar, const N: usize> CloudObserver<T, N> {
    /// Without points; slots, of which there is one at least, are `apart` at least, in the unit of the samples: a few times their
    /// noise. What is no positive distance counts as the least.
    pub fn new(apart: T) -> Self {
        const { assert!(N > 0) };
        let apart = if apart > T::EPSILON { apart } else { T::EPSILON };
        Self { points: Vec::new(), apart, before: [None; 2], compared: None }
    }

    /// Takes a sample in.
    pub fn push(&mut self, sample: &Vector3<T>) -> Chosen {
        if !sample.iter().all(|component| component.finite()) {
            self.before = [None; 2];
            return Chosen::Unusable;
        }
        let [older, newer] = self.before;
        self.before = [newer, Some(*sample)];
        let (Some(older), Some(newer)) = (older, newer) else { return Chosen::Unusable };
        let point = median(&older, &newer, sample);
        let skipped = self.apart * T::of(SKIPPED);
        if self.compared.is_some_and(|last| (point - last).norm_squared() < skipped * skipped) {
            return Chosen::Near;
        }
        self.compared = Some(point);
        if is_near(&self.points, &point, self.apart) {
            return Chosen::Near;
        }
        // Each time fewer points keep their slots, until there is one for this, or no distance is left that is finite.
        while self.points.is_full() && self.apart.finite() {
            self.apart *= T::of(WIDER);
            self.thin_out();
            if is_near(&self.points, &point, self.apart) {
                return Chosen::Near;
            }
        }
        match self.points.push(point) {
            Ok(()) => Chosen::New,
            Err(_) => Chosen::Near,
        }
    }

    /// The points, in the order of their coming.
    pub fn points(&self) -> &[Vector3<T>] {
        &self.points
    }

    /// Slots are at least so far apart, in the unit of the samples.
    pub fn apart(&self) -> T {
        self.apart
    }

    /// Points that are near to an earlier one lose their slots.
    fn thin_out(&mut self) {
        let mut kept = Vec::new();
        for point in &self.points {
            if !is_near(&kept, point, self.apart) {
                // As many fit as there were.
                let _ = kept.push(*point);
            }
        }
        self.points = kept;
    }
}

fn is_near<T: Scalar>(points: &[Vector3<T>], point: &Vector3<T>, apart: T) -> bool {
    let near = apart * apart;
    points.iter().any(|other| (other - point).norm_squared() < near)
}

/// Axis by axis.
fn median<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>, c: &Vector3<T>) -> Vector3<T> {
    let middle = |a: T, b: T, c: T| {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        match c {
            c if c < low => low,
            c if c > high => high,
            c => c,
        }
    };
    Vector3::new(middle(a.x, b.x, c.x), middle(a.y, b.y, c.y), middle(a.z, b.z, c.z))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::coverage::Coverage;

    const HARD_IRON: Vector3<f64> = Vector3::new(120.0, -40.0, 30.0);

    /// A field of 50 µT that is turned about at random, each turn for some samples.
    fn walk(seed: u64, samples: usize) -> std::vec::Vec<Vector3<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut share = || random.random::<f64>() - 0.5;
        let (mut field, mut turn) = (Vector3::x() * 50.0, Vector3::zeros());
        (0..samples)
            .map(|k| {
                if k % 50 == 0 {
                    turn = Vector3::new(share(), share(), share()) * 0.2;
                }
                field = crate::rotation::exp(&turn) * field;
                HARD_IRON + field + Vector3::new(share(), share(), share()) * 0.5
            })
            .collect()
    }

    #[test]
    fn sixty_four_slots_cover_what_was_seen() {
        for seed in 0..5 {
            let samples = walk(seed, 6000);
            let mut observer = CloudObserver::<f64, 64>::new(1.0);
            samples.iter().for_each(|sample| {
                observer.push(sample);
            });
            let of = |points: &[Vector3<f64>]| {
                Coverage::of(
                    points
                        .iter()
                        .map(|p| (p - HARD_IRON).normalize())
                        .collect::<std::vec::Vec<_>>()
                        .into_iter(),
                )
            };
            let (chosen, all) = (of(observer.points()), of(&samples));
            assert!(observer.points().len() > 24, "{}", observer.points().len());
            assert!(chosen.share > 0.97 * all.share, "{} of {}", chosen.share, all.share);
            let apart = |a: usize, b: usize| (observer.points()[a] - observer.points()[b]).norm();
            let count = observer.points().len();
            assert!((0..count).all(|a| (0..a).all(|b| apart(a, b) >= observer.apart())));
        }
    }

    #[test]
    fn a_direction_that_is_looked_at_for_long_has_one_slot() {
        let mut observer = CloudObserver::<f32, 8>::new(2.0);
        let still = Vector3::new(20.0, 3.0, -40.0);
        let chosen: std::vec::Vec<_> = (0..1000).map(|_| observer.push(&still)).collect();
        assert_eq!(chosen[..4], [Chosen::Unusable, Chosen::Unusable, Chosen::New, Chosen::Near]);
        assert_eq!(observer.points(), [still]);
    }

    #[test]
    fn a_spike_and_a_sample_that_is_missing_are_no_points() {
        let samples = walk(7, 3000);
        let mut observer = CloudObserver::<f64, 64>::new(1.0);
        for (k, sample) in samples.iter().enumerate() {
            let spike = Vector3::new(0.0, if k % 97 == 50 { 900.0 } else { 0.0 }, 0.0);
            observer.push(&(sample + spike));
            if k % 311 == 0 {
                assert_eq!(observer.push(&Vector3::new(1.0, f64::NAN, 2.0)), Chosen::Unusable);
            }
        }
        assert!(observer.points().iter().all(|point| (point - HARD_IRON).norm() < 52.0));
    }

    #[test]
    fn with_one_slot_it_ends() {
        let mut observer = CloudObserver::<f64, 1>::new(1.0);
        walk(3, 500).iter().for_each(|sample| {
            observer.push(sample);
        });
        assert_eq!(observer.points().len(), 1);
    }

    #[test]
    fn no_distance_and_points_beyond_all_numbers_end_too() {
        for apart in [0.0, -1.0, f32::NAN] {
            let mut observer = CloudObserver::<f32, 4>::new(apart);
            for k in 0..200u8 {
                observer.push(&Vector3::new(f32::from(k), 0.0, 0.0));
            }
            assert!((1..=4).contains(&observer.points().len()));
        }
        let mut observer = CloudObserver::<f32, 1>::new(1.0);
        for far in [f32::MAX, f32::MAX, f32::MAX, -f32::MAX, -f32::MAX, -f32::MAX] {
            observer.push(&Vector3::new(far, far, far));
        }
        assert_eq!(observer.points().len(), 1);
    }
}
