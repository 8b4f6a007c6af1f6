//! The parameters of two calibrations of one sensor, each with its standard error.

use serde::Serialize;

use crate::store::StoredTriad;

const AXES: [char; 3] = ['x', 'y', 'z'];

/// One parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moved {
    /// `gain_xy` or `bias_x`.
    pub name: String,
    /// In the first.
    pub a: f64,
    /// In the second.
    pub b: f64,
    /// Standard error of the difference.
    pub std_error: f64,
    /// The difference in standard errors.
    pub z: f64,
    /// Beyond chance.
    pub moved: bool,
}

/// A coefficient and its standard error, 0 where it is not estimated.
#[derive(Clone, Copy)]
pub(super) struct Estimate(f64, f64);

impl Estimate {
    pub(super) fn known(self) -> bool {
        self.1 > 0.0
    }
}

/// Nonlinear terms: quadratic, cubic, and the products in each axis.
pub(super) fn bent(triad: &StoredTriad) -> [Estimate; 15] {
    let Some(found) = &triad.nonlinearity else { return [Estimate(0.0, 0.0); 15] };
    let all = |axial: [[f64; 3]; 2], cross: [[f64; 3]; 3]| axial.into_iter().chain(cross).flatten();
    let value = all([found.quadratic, found.cubic], found.cross);
    let std = all([found.quadratic_std, found.cubic_std], found.cross_std);
    let mut pairs = value.zip(std).map(|(value, std)| Estimate(value, std));
    std::array::from_fn(|_| pairs.next().unwrap_or(Estimate(0.0, 0.0)))
}

/// Name of each of [`bent`].
fn bent_name(at: usize) -> String {
    let (row, column) = (at / 3, at % 3);
    match row {
        0 => format!("quadratic_{}", AXES[column]),
        1 => format!("cubic_{}", AXES[column]),
        _ => format!("cross_{}_{}", AXES[row - 2], ["xy", "yz", "zx"][column]),
    }
}

/// The parameters that both have estimated; without a verdict.
pub(super) fn both_estimate(a: &StoredTriad, b: &StoredTriad, with_gains: bool) -> Vec<Moved> {
    let of = |name: String, (a, a_std): (f64, f64), (b, b_std): (f64, f64)| {
        let std_error = a_std.hypot(b_std);
        (a_std > 0.0 && b_std > 0.0).then(|| Moved {
            name,
            a,
            b,
            std_error,
            z: (b - a) / std_error,
            moved: false,
        })
    };
    let gains = (0..3).flat_map(|row| (0..3).map(move |column| (row, column))).filter_map(|(row, column)| {
        let name = format!("gain_{}{}", AXES[row], AXES[column]);
        let pair = |triad: &StoredTriad| (triad.gain[row][column], triad.gain_std[row][column]);
        of(name, pair(a), pair(b))
    });
    let biases = (0..3).filter_map(|axis| {
        let name = format!("bias_{}", AXES[axis]);
        of(name, (a.bias[axis], a.bias_std[axis]), (b.bias[axis], b.bias_std[axis]))
    });
    let (bent_a, bent_b) = (bent(a), bent(b));
    let terms = bent_a.into_iter().zip(bent_b).enumerate();
    let terms = terms.filter_map(|(at, (a, b))| of(bent_name(at), (a.0, a.1), (b.0, b.1)));
    gains.filter(|_| with_gains).chain(biases).chain(terms).collect()
}
