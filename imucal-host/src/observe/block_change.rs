//! How the sums over a block of samples change with its rates, to first order.
//!
//! ```text
//! w' = w + ε f(w_j) e_j:   ∂s0 = Σ f_i h_i e_j,   ∂c = Σ_i (s_i × f_i h_i e_j + S_i e_j × w_i h_i)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | w, h | rate of a sample, rad/s, and how long it is held, s |
//! | s_i, S_i | Σ w h and Σ f h over the samples of the block before i |
//! | s0, c | sums over the block ([`Block`]), of which c = Σ s_i × w_i h_i |
//!
//! The block's third sum, s1, counts only next to a constant rate: it is left out, so that the bias has to be taken off the rates
//! before. Source: the derivative of models.md 3.

use imucal_core::observation::Block;
use nalgebra::{Matrix3, Vector3};

/// Derivatives of a block's sums by ε, of each axis j.
#[derive(Clone, Copy, Debug)]
pub struct BlockChange {
    /// ∂s0 by axis: the change of axis j is along j.
    s0: Vector3<f64>,
    /// ∂c, a column for each axis.
    c: Matrix3<f64>,
}

impl BlockChange {
    /// Of the samples of a block, each a rate, rad/s, and how long it is held, s, by functions.
    pub(super) fn of<const N: usize>(samples: &[(Vector3<f64>, f64)], of: [fn(f64) -> f64; N]) -> [Self; N] {
        let mut changes = [Self { s0: Vector3::zeros(), c: Matrix3::zeros() }; N];
        let mut before = Vector3::zeros();
        for (rate, held) in samples {
            let angle = rate * *held;
            for (change, f) in changes.iter_mut().zip(of) {
                change.push(&before, &angle, &(rate.map(f) * *held));
            }
            before += angle;
        }
        changes
    }

    /// Takes a sample in: Σ w h before it, its own w h, and its f h by axis.
    fn push(&mut self, before: &Vector3<f64>, angle: &Vector3<f64>, step: &Vector3<f64>) {
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            // s × e_j and e_j × w, of which the component along j is zero.
            self.c[(next, axis)] += before[last] * step[axis] - self.s0[axis] * angle[last];
            self.c[(last, axis)] += self.s0[axis] * angle[next] - before[next] * step[axis];
        }
        self.s0 += step;
    }

    /// The change by an axis.
    pub fn by(&self, axis: usize) -> Block<f64> {
        let mut s0 = Vector3::zeros();
        s0[axis] = self.s0[axis];
        Block { s0, s1: Vector3::zeros(), c: self.c.column(axis).into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::compression;

    #[test]
    fn a_block_changes_as_that_of_altered_rates_differs() {
        let rate = |k: u32| {
            let k = f64::from(k);
            Vector3::new((1.3 * k).sin(), (0.7 * k).cos(), 0.8 * (2.1 * k).sin() - 0.3)
        };
        let samples: Vec<_> = (0..5).map(|k| (rate(k), 0.01 + 0.002 * f64::from(k))).collect();
        let functions: [fn(f64) -> f64; 3] = [|w| w * w * w, f64::abs, |_| 1.0];
        let changes = BlockChange::of(&samples, functions);
        for (change, f) in changes.iter().zip(functions) {
            for axis in 0..3 {
                let block = |size: f64| {
                    let altered = samples.iter().map(|(rate, held)| {
                        let mut rate = *rate;
                        rate[axis] += size * f(rate[axis]);
                        (rate, *held)
                    });
                    compression::blocks(altered, 5, |_| ()).0[0]
                };
                let (above, below, found) = (block(1e-3), block(-1e-3), change.by(axis));
                let s0 = (above.s0 - below.s0) / 2e-3 - found.s0;
                let c = (above.c - below.c) / 2e-3 - found.c;
                assert!(s0.amax() < 1e-13 && c.amax() < 1e-13, "axis {axis}: {s0} {c}");
            }
        }
    }
}
