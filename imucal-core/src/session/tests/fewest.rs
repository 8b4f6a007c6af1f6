//! The fewest poses that reach an error, by exchange over all candidates: what a guided session is measured against.

use nalgebra::{SMatrix, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::vec::Vec;

use super::*;
use crate::{
    model::{Model, RowSink, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    session::{design::candidate, evidence::shell},
};

/// The one row of a pose.
struct Row(SVector<f64, 9>);

impl RowSink<f32, 9> for Row {
    const JACOBIAN: bool = true;

    fn row(&mut self, _: f32, jacobian: &SVector<f32, 9>) {
        self.0 = jacobian.cast();
    }
}

fn rows() -> Vec<SVector<f64, 9>> {
    let theta = UPPER_TRIANGULAR.theta(&Triad::<f32>::identity());
    let of = |direction: Vector3<f32>| {
        let mut row = Row(SVector::zeros());
        shell(&ShellPoint::new(direction * 9.80665), 9.80665).rows(&theta, &mut row);
        row.0
    };
    (0..).map_while(candidate).map(of).collect()
}

/// The expected error of a calibrated vector, as a session states it, where a rest's mean errs by `noise`.
fn error(design: &[usize], rows: &[SVector<f64, 9>], noise: f64) -> f64 {
    let information: SMatrix<f64, 9, 9> = design.iter().map(|at| rows[*at] * rows[*at].transpose()).sum();
    let Some(inverse) = information.try_inverse() else { return f64::INFINITY };
    let variance = inverse.diagonal() * noise * noise;
    let squared =
        variance.fixed_rows::<6>(0).sum() / 3.0 + variance.fixed_rows::<3>(6).sum() / (9.80665 * 9.80665);
    let freedom = design.len() as f64 - 9.0 + 12.0;
    squared.sqrt() * (1.0 + 1.21 / freedom + 1.44 / (freedom * freedom))
}

/// The fewest poses, from the ten of the limits on, by exchange from many starts.
pub(super) fn fewest(target: f64, noise: f64) -> usize {
    let (rows, mut random) = (rows(), ChaCha8Rng::seed_from_u64(1));
    let reaches = |count: usize, random: &mut ChaCha8Rng| {
        (0..12).any(|_| {
            let mut design: Vec<usize> =
                (0..count).map(|_| (random.random::<f64>() * rows.len() as f64) as usize).collect();
            let mut best = error(&design, &rows, noise);
            for place in (0..count).cycle().take(4 * count) {
                for other in 0..rows.len() {
                    let before = core::mem::replace(&mut design[place], other);
                    let new = error(&design, &rows, noise);
                    if new < best {
                        best = new;
                    } else {
                        design[place] = before;
                    }
                }
            }
            best <= target
        })
    };
    (10..40).find(|count| reaches(*count, &mut random)).expect("forty are enough")
}
