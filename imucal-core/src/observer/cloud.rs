//! Points of a cloud, chosen by distance: what a magnetometer shows while it is turned about, in a fixed number of slots.
//!
//! ```text
//! a slot for x if |x − s| ≥ d for every slot s;    d ← 1.25 d when all are full
//! s ← mean of the x with |x − s| < d/4             e = −Σ|x − s|² / (2 n F)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x | a sample that is no spike: further from both its neighbours than three times their distance and d |
//! | s, n | mean of a slot's points, and how many they are |
//! | d | [`CloudObserver::apart`]: slots begin at least so far apart |
//! | e | distance of the mean outside the shell of radius F, on which its points lie: it lies inside |
//!
//! Where all slots are full, those that are nearer than the larger d to an earlier one go. So slots are spread over all that has
//! been seen, whatever the order and however long a direction was looked at; and what was looked at for long is a mean.
//!
//! Source: Charikar, Chekuri, Feder and Motwani (1997), of the doubling algorithm for k centres.

use heapless::Vec;
use nalgebra::Vector3;

use super::{is_finite, squared_distance};
use crate::{observation::ShellPoint, scalar::Scalar};

/// By what slots are further apart once all are full.
const WIDER: f64 = 1.25;
/// A point within this share of d of a slot's mean belongs to it; a sample within it of the last one that was compared with the
/// slots is not compared again.
const NEAR: f64 = 0.25;

/// A sample is a spike where it is so many times as far from both its neighbours as they are from one another.
const SPIKE: f64 = 3.0;

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chosen {
    /// It has a slot.
    New,
    /// It is near to a point that has one, or to the sample before.
    Near,
    /// It is not finite, the first one, or a spike; each is looked at once the next has come.
    Unusable,
}

/// Points in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot<T: Scalar> {
    /// Their mean, in the unit of the samples.
    pub mean: Vector3<T>,
    /// How many there are; counted up to the largest number.
    pub count: u16,
    /// Sum of their squared distances from the mean.
    squares: T,
}

impl<T: Scalar> Slot<T> {
    fn new(point: &Vector3<T>) -> Self {
        Self { mean: *point, count: 1, squares: T::zero() }
    }

    fn push(&mut self, point: &Vector3<T>) {
        if self.count == u16::MAX {
            return;
        }
        self.count += 1;
        let count = T::whole(self.count.into());
        let mut axis = |point: T, mean: &mut T| {
            let before = point - *mean;
            *mean += before / count;
            self.squares += before * (point - *mean);
        };
        axis(point.x, &mut self.mean.x);
        axis(point.y, &mut self.mean.y);
        axis(point.z, &mut self.mean.z);
    }

    /// As a point of a shell of some radius, in the unit of the samples: the mean of points on a sphere lies inside it.
    pub fn on_shell(&self, radius: T) -> ShellPoint<T> {
        let spread = self.squares / T::whole(self.count.into());
        ShellPoint { value: self.mean, excess: -spread / (radius + radius) }
    }
}

/// Chooses points of a cloud as samples arrive.
#[derive(Clone, Debug)]
pub struct CloudObserver<T: Scalar, const N: usize> {
    slots: Vec<Slot<T>, N>,
    apart: T,
    /// The two samples before, the older first.
    before: [Option<Vector3<T>>; 2],
    /// The last sample that was compared with the slots, and the slot that it belongs to.
    compared: Option<(Vector3<T>, Option<u8>)>,
}

impl<T: Scalar, const N: usize> CloudObserver<T, N> {
    /// Without points; slots, of which there is one at least, are `apart` at least, in the unit of the samples: a few times their
    /// noise. What is no positive distance counts as the least.
    pub fn new(apart: T) -> Self {
        const { assert!(N > 0 && N <= 256) };
        let apart = if apart > T::EPSILON { apart } else { T::EPSILON };
        Self { slots: Vec::new(), apart, before: [None; 2], compared: None }
    }

    /// Takes a sample in.
    pub fn push(&mut self, sample: &Vector3<T>) -> Chosen {
        if !is_finite(sample) {
            self.before = [None; 2];
            return Chosen::Unusable;
        }
        let [older, newer] = self.before;
        self.before = [newer, Some(*sample)];
        let Some(newer) = newer else { return Chosen::Unusable };
        if older.is_some_and(|older| self.is_spike(&older, &newer, sample)) {
            return Chosen::Unusable;
        }
        self.take(&newer)
    }

    /// The sample that the last one has judged: the one before it, in the unit of the samples. `None` where that was none.
    pub fn judged(&self) -> Option<&Vector3<T>> {
        let [judged, _] = &self.before;
        judged.as_ref()
    }

    /// A sample is far from both its neighbours, which are near to one another.
    fn is_spike(&self, before: &Vector3<T>, sample: &Vector3<T>, after: &Vector3<T>) -> bool {
        let least = self.apart * self.apart;
        let far = |other: &Vector3<T>| squared_distance(sample, other);
        far(before) > least
            && far(after) > least
            && far(before) > squared_distance(after, before) * T::of(SPIKE * SPIKE)
            && far(after) > squared_distance(after, before) * T::of(SPIKE * SPIKE)
    }

    fn take(&mut self, point: &Vector3<T>) -> Chosen {
        let within = self.apart * T::of(NEAR);
        let near = |other: &Vector3<T>| squared_distance(point, other) < within * within;
        if let Some((last, at)) = &self.compared
            && near(last)
        {
            let slot = at.and_then(|at| self.slots.get_mut(usize::from(at)));
            if let Some(slot) = slot.filter(|slot| near(&slot.mean)) {
                slot.push(point);
            }
            return Chosen::Near;
        }
        // What is near is not far enough apart either: one pass over the slots answers both.
        let apart = self.apart * self.apart;
        let first = self.slots.iter().position(|slot| squared_distance(&slot.mean, point) < apart);
        let at = first.and_then(|first| {
            let later = self.slots.get(first..)?.iter().position(|slot| near(&slot.mean))?;
            first.checked_add(later)
        });
        self.compared = Some((*point, at.and_then(|at| u8::try_from(at).ok())));
        if first.is_none() {
            return self.begin(point);
        }
        if let Some(slot) = at.and_then(|at| self.slots.get_mut(at)) {
            slot.push(point);
        }
        Chosen::Near
    }

    /// A slot for a point that is far enough from all.
    fn begin(&mut self, point: &Vector3<T>) -> Chosen {
        // Each time fewer slots stay, until there is one for this, or no distance is left that is finite.
        while self.slots.is_full() && self.apart.finite() {
            self.apart *= T::of(WIDER);
            self.thin_out();
            if is_near(&self.slots, point, self.apart) {
                return Chosen::Near;
            }
        }
        self.compared = Some((*point, u8::try_from(self.slots.len()).ok()));
        match self.slots.push(Slot::new(point)) {
            Ok(()) => Chosen::New,
            Err(_) => Chosen::Near,
        }
    }

    /// The slots, in the order of their coming.
    pub fn slots(&self) -> &[Slot<T>] {
        &self.slots
    }

    /// Slots begin at least so far apart, in the unit of the samples.
    pub fn apart(&self) -> T {
        self.apart
    }

    /// Slots that are near to an earlier one go.
    fn thin_out(&mut self) {
        let mut kept = Vec::new();
        for slot in &self.slots {
            if !is_near(&kept, &slot.mean, self.apart) {
                // As many fit as there were.
                let _ = kept.push(*slot);
            }
        }
        self.slots = kept;
    }
}

fn is_near<T: Scalar>(slots: &[Slot<T>], point: &Vector3<T>, apart: T) -> bool {
    let near = apart * apart;
    slots.iter().any(|slot| squared_distance(&slot.mean, point) < near)
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
            let means: std::vec::Vec<_> = observer.slots().iter().map(|slot| slot.mean).collect();
            let (chosen, all) = (of(&means), of(&samples));
            assert!(means.len() > 24, "{}", means.len());
            assert!(chosen.share > 0.97 * all.share, "{} of {}", chosen.share, all.share);
            let apart = |a: usize, b: usize| (means[a] - means[b]).norm();
            assert!((0..means.len()).all(|a| (0..a).all(|b| apart(a, b) >= 0.5 * observer.apart())));
        }
    }

    #[test]
    fn a_direction_that_is_looked_at_for_long_has_one_slot() {
        let mut observer = CloudObserver::<f32, 8>::new(2.0);
        let still = Vector3::new(20.0, 3.0, -40.0);
        let chosen: std::vec::Vec<_> = (0..1000).map(|_| observer.push(&still)).collect();
        assert_eq!(chosen[..3], [Chosen::Unusable, Chosen::New, Chosen::Near]);
        assert_eq!((observer.slots().len(), observer.slots()[0].mean), (1, still));
        assert_eq!(observer.slots()[0].count, 999);
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
        assert!(observer.slots().iter().all(|slot| (slot.mean - HARD_IRON).norm() < 52.0));
    }

    #[test]
    fn the_mean_of_points_on_a_sphere_is_corrected_to_lie_on_it() {
        let mut slot = Slot::new(&Vector3::new(50.0, 0.0, 0.0));
        for k in 0..400 {
            let (along, around) = (0.1 * f64::from(k % 20) / 20.0, 2.4 * f64::from(k));
            let tangent = Vector3::new(0.0, around.cos(), around.sin()) * along.sin();
            slot.push(&((Vector3::x() * along.cos() + tangent) * 50.0));
        }
        let point = slot.on_shell(50.0);
        assert!(50.0 - point.value.norm() > 0.05, "{}", point.value.norm());
        assert!((point.value.norm() - 50.0 - point.excess).abs() < 2e-3, "{point:?}");
    }

    #[test]
    fn with_one_slot_it_ends() {
        let mut observer = CloudObserver::<f64, 1>::new(1.0);
        walk(3, 500).iter().for_each(|sample| {
            observer.push(sample);
        });
        assert_eq!(observer.slots().len(), 1);
    }

    #[test]
    fn no_distance_and_points_beyond_all_numbers_end_too() {
        for apart in [0.0, -1.0, f32::NAN] {
            let mut observer = CloudObserver::<f32, 4>::new(apart);
            for k in 0..200u8 {
                observer.push(&Vector3::new(f32::from(k), 0.0, 0.0));
            }
            assert!((1..=4).contains(&observer.slots().len()));
        }
        let mut observer = CloudObserver::<f32, 1>::new(1.0);
        for far in [f32::MAX, f32::MAX, f32::MAX, -f32::MAX, -f32::MAX, -f32::MAX] {
            observer.push(&Vector3::new(far, far, far));
        }
        assert_eq!(observer.slots().len(), 1);
    }
}
