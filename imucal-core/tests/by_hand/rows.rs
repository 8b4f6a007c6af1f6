//! Least-squares problems small enough to be solved by hand.

use imucal_core::model::{Model, RowSink};
use nalgebra::SVector;

/// r_k = c_k + j_k · θ.
#[derive(Clone, Debug)]
pub struct Rows<const P: usize> {
    /// c_k and j_k.
    pub rows: Vec<(f64, [f64; P])>,
}

impl<const P: usize> Model<f64, P> for Rows<P> {
    fn rows<S: RowSink<f64, P>>(&self, theta: &SVector<f64, P>, sink: &mut S) {
        for (constant, slopes) in &self.rows {
            let slopes = SVector::from(*slopes);
            sink.row(constant + slopes.dot(theta), &slopes);
        }
    }

    fn independent_rows(&self) -> usize {
        self.rows.len()
    }
}

/// Rosenbrock's valley as residuals: 10 (y − x²) and 1 − x.
#[derive(Clone, Copy, Debug)]
pub struct Valley;

impl Model<f64, 2> for Valley {
    fn rows<S: RowSink<f64, 2>>(&self, theta: &SVector<f64, 2>, sink: &mut S) {
        sink.row(10.0 * (theta.y - theta.x * theta.x), &SVector::from([-20.0 * theta.x, 10.0]));
        sink.row(1.0 - theta.x, &SVector::from([-1.0, 0.0]));
    }

    fn independent_rows(&self) -> usize {
        2
    }
}

/// One residual x + c x², x = g (θ − θ₀), and two that stay.
#[derive(Clone, Copy, Debug)]
pub struct Bent {
    /// g.
    pub slope: f64,
    /// c.
    pub bend: f64,
    /// θ₀.
    pub at: f64,
    /// Size of the two residuals that stay, one of each sign.
    pub spread: f64,
    /// From an x on, away from zero, the first residual is this.
    pub end: Option<(f64, f64)>,
}

impl Model<f64, 1> for Bent {
    fn rows<S: RowSink<f64, 1>>(&self, theta: &SVector<f64, 1>, sink: &mut S) {
        let x = self.slope * (theta.x - self.at);
        let end = self.end.filter(|(from, _)| x / from >= 1.0);
        let residual = end.map_or(x + self.bend * x * x, |(_, value)| value);
        sink.row(residual, &SVector::from([self.slope * (1.0 + 2.0 * self.bend * x)]));
        sink.row(self.spread, &SVector::zeros());
        sink.row(-self.spread, &SVector::zeros());
    }

    fn independent_rows(&self) -> usize {
        3
    }
}
