//! Which pose says most: the reduction of the expected error by each of 26 poses that a hand can do.
//!
//! ```text
//! e² = tr(W C)        a pose with rows a:   Δe² ≈ Σ aᵀ C W C a / (σ² + aᵀ C a)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | C, σ² | covariance of the parameters so far, and variance of a residual |
//! | W | weights of the gain's and the bias's errors in the relative error of a vector ([`crate::accept::relative_error`]) |
//! | a | derivatives of the residuals that the pose, or the turn to it, would add |
//!
//! A pose that adds one row is exact; of several rows the sum is an upper bound. The score of a pose is the largest share by which
//! it lowers e² of a sensor that has not reached its target. Source: sequential A-optimal design (Fedorov 1972, *Theory of Optimal
//! Experiments*). Until there is a first fit, the pose furthest from all seen is next.

use nalgebra::{SMatrix, SVector, Vector3};

use crate::model::RowSink;

/// Poses to choose from: faces, edges and corners of a cube, by the direction of the specific force.
pub const CANDIDATES: usize = 26;
/// cos of the angle within which a pose counts as one that is there already, 15°.
const SAME: f32 = 0.965_925_8;

/// Direction of candidate `index`, unit vector; `None` beyond the last.
#[inline]
pub(super) fn candidate(index: usize) -> Option<Vector3<f32>> {
    // Skips the middle of the cube.
    let index = if index < 13 { index } else { index.saturating_add(1) };
    let digit = |place: usize| (index / place % 3) as f32 - 1.0;
    let corner = Vector3::new(digit(9), digit(3), digit(1));
    (index < 27).then(|| corner / libm::sqrtf(corner.norm_squared()))
}

/// Gathers what the rows of a pose would lower the error by.
pub(super) struct Lowered<'a> {
    /// C.
    pub(super) covariance: &'a SMatrix<f32, 9, 9>,
    /// W, diagonal.
    pub(super) weights: &'a SVector<f32, 9>,
    /// σ².
    pub(super) variance: f32,
    /// Σ.
    pub(super) sum: f32,
}

impl RowSink<f32, 9> for Lowered<'_> {
    const JACOBIAN: bool = true;

    #[inline]
    fn row(&mut self, _: f32, jacobian: &SVector<f32, 9>) {
        let moved = self.covariance * jacobian;
        let weighed = moved.component_mul(&moved).dot(self.weights);
        self.sum += weighed / (self.variance + moved.dot(jacobian));
    }
}

/// Scores of the candidates, larger is better.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scores([f32; CANDIDATES]);

impl Scores {
    pub(super) const NONE: Self = Self([0.0; CANDIDATES]);

    /// Of a function of the direction.
    pub(super) fn of(mut score: impl FnMut(&Vector3<f32>) -> f32) -> Self {
        let mut scores = Self::NONE;
        for (index, slot) in scores.0.iter_mut().enumerate() {
            *slot = candidate(index).map_or(0.0, |direction| score(&direction));
        }
        scores
    }

    /// The larger score of both.
    #[inline]
    pub(super) fn larger(&self, other: &Self) -> Self {
        let mut all = *self;
        for (slot, new) in all.0.iter_mut().zip(&other.0) {
            *slot = if new > slot { *new } else { *slot };
        }
        all
    }

    /// The best candidate that is not where the sensor lies now; before any score the one furthest from all seen.
    pub(super) fn best(
        &self,
        now: Option<Vector3<f32>>,
        seen: impl Iterator<Item = Vector3<f32>> + Clone,
    ) -> Vector3<f32> {
        let scored = self.0.iter().any(|score| *score > 0.0);
        let mut best = (Vector3::z(), f32::NEG_INFINITY);
        for (index, score) in self.0.iter().enumerate() {
            let Some(direction) = candidate(index) else { continue };
            let cosine = |other: Vector3<f32>| other.dot(&direction);
            if now.is_some_and(|now| cosine(now) > SAME) {
                continue;
            }
            let nearest = seen.clone().chain(now).map(cosine).fold(-1.0, |a, b| if b > a { b } else { a });
            let value = if scored { *score } else { -nearest };
            if value > best.1 {
                best = (direction, value);
            }
        }
        best.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_candidates_are_faces_edges_and_corners_each_once() {
        let all: std::vec::Vec<_> = (0..CANDIDATES + 3).filter_map(candidate).collect();
        assert_eq!(all.len(), CANDIDATES);
        for (k, a) in all.iter().enumerate() {
            assert!((a.norm() - 1.0).abs() < 1e-6);
            assert!(all.iter().take(k).all(|b| a.dot(b) < 0.95));
        }
    }

    #[test]
    fn without_scores_the_pose_furthest_from_all_seen_is_next() {
        let seen = [Vector3::z(), Vector3::x()];
        let next = Scores::NONE.best(Some(Vector3::y()), seen.into_iter());
        assert!(next.dot(&Vector3::repeat(-0.577)) > 0.99, "{next}");
    }
}
