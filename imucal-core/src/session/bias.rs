//! A gyroscope's bias from its rests, and whether it wanders from one to the next.
//!
//! ```text
//! b̄ = Σ n_k m_k / Σ n_k      s² = Σ (m_k − b̄)² / (K − 1)      wanders: s > 1.5 e on any axis,  e² = mean of Var(m_k)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m_k, n_k | mean rate of a rest, and samples in it |
//! | s, e | spread of the means, and what their own noise explains |
//!
//! Where it wanders, a turn is counted from the bias of the rests at its ends instead of the mean. Not modelled: Earth rate,
//! which is part of the bias, and drift within a turn.

use nalgebra::Vector3;

use crate::scalar::Scalar;

/// The bias wanders where the means spread so many times wider than their own noise explains.
pub const WANDER: f64 = 1.5;

/// What one rest says.
#[derive(Clone, Copy, Debug)]
pub struct MeanRate<T: Scalar> {
    /// Mean rate, rad/s.
    pub mean: Vector3<T>,
    /// Variance of the mean, (rad/s)².
    pub variance: Vector3<T>,
    /// Samples.
    pub count: u32,
}

/// The bias, and how it moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBias<T: Scalar> {
    /// b̄, rad/s.
    pub mean: Vector3<T>,
    /// s, rad/s.
    pub spread: Vector3<T>,
    /// e, rad/s.
    pub expected: Vector3<T>,
    /// Rests.
    pub rests: u32,
}

impl<T: Scalar> RestBias<T> {
    /// Of some rests; `None` without any.
    pub fn of(rates: impl Iterator<Item = MeanRate<T>> + Clone) -> Option<Self> {
        let (mut total, mut sum, mut rests) = (T::zero(), Vector3::zeros(), 0u32);
        for rate in rates.clone() {
            let samples = T::whole(rate.count);
            total += samples;
            sum += rate.mean * samples;
            rests = rests.saturating_add(1);
        }
        if total <= T::zero() {
            return None;
        }
        let mean = sum / total;
        let (mut squares, mut noise) = (Vector3::<T>::zeros(), Vector3::<T>::zeros());
        for rate in rates {
            let off = rate.mean - mean;
            squares += off.component_mul(&off);
            noise += rate.variance;
        }
        let freedom = T::whole(rests.max(2).saturating_sub(1));
        let spread = (squares / freedom).map(T::root);
        Some(Self { mean, spread, expected: (noise / T::whole(rests)).map(T::root), rests })
    }

    /// The bias is not the same at all rests.
    pub fn wanders(&self) -> bool {
        let limit = self.expected * T::of(WANDER);
        self.spread.iter().zip(limit.iter()).any(|(spread, limit)| spread > limit)
    }

    /// Standard error of the mean, rad/s: by the spread of the rests, or by their own noise where that is larger.
    pub fn std(&self) -> Vector3<T> {
        let root = T::whole(self.rests.max(1)).root();
        self.spread.zip_map(&self.expected, |a, b| if a > b { a } else { b } / root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rests(step: f64) -> impl Iterator<Item = MeanRate<f64>> + Clone {
        (0..9u32).map(move |k| MeanRate {
            mean: Vector3::new(0.1, 0.2, 0.3) + Vector3::x() * (step * f64::from(k % 3)),
            variance: Vector3::repeat(1e-8),
            count: 100 + k,
        })
    }

    #[test]
    fn means_that_spread_no_wider_than_their_noise_do_not_wander() {
        let bias = RestBias::of(rests(1e-4)).expect("rests");
        assert!(!bias.wanders() && (bias.mean.y - 0.2).abs() < 1e-12, "{bias:?}");
        assert!((bias.std().y - 1e-4 / 3.0).abs() < 1e-12, "{bias:?}");
    }

    #[test]
    fn one_axis_that_moves_is_enough_to_wander() {
        let bias = RestBias::of(rests(3e-4)).expect("rests");
        assert!(bias.wanders() && bias.std().x > 7e-5, "{bias:?}");
    }

    #[test]
    fn without_rests_there_is_no_bias() {
        assert!(RestBias::<f32>::of(core::iter::empty()).is_none());
    }
}
