//! Numerical derivatives of a model: for tests, and for whoever writes a model.

use nalgebra::SVector;

use crate::{
    model::{Model, RowSink},
    scalar::Scalar,
};

/// Picks one row out of a stream.
struct Pick<T: Scalar, const P: usize> {
    wanted: usize,
    seen: usize,
    row: Option<(T, SVector<T, P>)>,
}

impl<T: Scalar, const P: usize> RowSink<T, P> for Pick<T, P> {
    const JACOBIAN: bool = true;

    fn row(&mut self, residual: T, jacobian: &SVector<T, P>) {
        if self.seen == self.wanted {
            self.row = Some((residual, *jacobian));
        }
        self.seen += 1;
    }
}

fn pick<T: Scalar, const P: usize>(
    model: &impl Model<T, P>,
    theta: &SVector<T, P>,
    wanted: usize,
) -> Option<(T, SVector<T, P>)> {
    let mut sink = Pick { wanted, seen: 0, row: None };
    model.rows(theta, &mut sink);
    sink.row
}

/// Largest difference between the analytic derivative and a central difference, over all rows and parameters,
/// relative to 1 plus the entry's size.
///
/// Costs 2P + 1 passes a row, and holds none of them.
pub fn largest_jacobian_error<T: Scalar, const P: usize>(
    model: &impl Model<T, P>,
    theta: &SVector<T, P>,
) -> T {
    // The cube root of the rounding unit balances truncation against cancellation.
    let relative = T::of(libm::cbrt(T::EPSILON.wide()));
    let mut worst = T::zero();
    let mut index = 0;
    while let Some((_, analytic)) = pick(model, theta, index) {
        for (k, expected) in analytic.iter().enumerate() {
            let Some(numeric) = central_difference(model, theta, index, k, relative) else {
                return T::LARGEST;
            };
            let error = (numeric - *expected).abs() / (T::one() + numeric.abs());
            worst = if error > worst { error } else { worst };
        }
        index += 1;
    }
    worst
}

/// Derivative of one row's residual by parameter `k`.
fn central_difference<T: Scalar, const P: usize>(
    model: &impl Model<T, P>,
    theta: &SVector<T, P>,
    index: usize,
    k: usize,
    relative: T,
) -> Option<T> {
    let at = theta.get(k).copied()?;
    let step = relative * (T::one() + at.abs());
    let residual_at = |value: T| {
        let mut moved = *theta;
        *moved.get_mut(k)? = value;
        Some(pick(model, &moved, index)?.0)
    };
    let (up, down) = (at + step, at - step);
    Some((residual_at(up)? - residual_at(down)?) / (up - down))
}
