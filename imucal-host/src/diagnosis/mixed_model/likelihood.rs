//! How likely a sensor's residual is under a noise, whatever a model's columns have taken of it: the restricted likelihood
//! (Patterson and Thompson 1971).
//!
//! ```text
//! −2 ln L = ln|Σ| + ln|XᵀΣ⁻¹X + Λ| − ln|Λ| + rᵀΣ⁻¹r − zᵀ(XᵀΣ⁻¹X + Λ)⁻¹z      z = XᵀΣ⁻¹r
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, X | residual and columns |
//! | Σ | covariance: [`crate::noise::precision`] |
//! | Λ | a vague prior of the columns' amounts |

use crate::noise::{precision::Precision, process::Process};
use std::cell::RefCell;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::design::{DesignProducts, GroupProducts, Normal};
use crate::recording::SensorKind;

/// Prior information on a column: a usual size is one, and this many of them would be no surprise.
const LOOSE: f64 = 30.0;

/// Scatter and drifts.
type Parameters = (f64, [Process; 2]);

/// The likelihood of one sensor's residual.
pub struct Likelihood {
    design: DesignProducts,
    size: usize,
    /// A search comes back to parameters that it has tried.
    known: RefCell<Vec<(Parameters, f64)>>,
}

impl Likelihood {
    /// Of a sensor's residual, less some columns of a design.
    pub fn new(design: &DesignProducts, kind: SensorKind, columns: &[usize]) -> Self {
        let design = design.picked(Some(kind), columns);
        Self { design, size: columns.len(), known: RefCell::default() }
    }

    /// −2 ln of the likelihood under a scatter and drifts, and the white noise of the products, but for a constant.
    pub fn of(&self, scatter: f64, drifts: [Process; 2]) -> f64 {
        let known = |(known, value): &(Parameters, f64)| (*known == (scatter, drifts)).then_some(*value);
        if let Some(value) = self.known.borrow().iter().find_map(known) {
            return value;
        }
        let part = |group: &GroupProducts| {
            let precision = Precision::new(&group.columns.effects, scatter, &[&drifts]);
            Normal::of(&group.columns, &precision)
        };
        let parts: Vec<Normal> = self.design.groups.par_iter().map(part).collect();
        let value = reml_criterion(&self.design.sum(self.size, &parts));
        self.known.borrow_mut().push(((scatter, drifts), value));
        value
    }
}

/// −2 ln of the restricted likelihood, but for a constant.
pub fn reml_criterion(normal: &Normal) -> f64 {
    let n = normal.score.len();
    let prior = 1.0 / (LOOSE * LOOSE);
    let loosened = &normal.information + DMatrix::identity(n, n) * prior;
    let Some(factor) = loosened.cholesky() else { return f64::INFINITY };
    let explained = normal.score.dot(&factor.solve(&normal.score));
    normal.log_determinant + factor.ln_determinant() - n as f64 * prior.ln() + normal.energy - explained
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::noise::precision::tests::{SIGMA, Toy, columns};
    use nalgebra::DVector;

    use super::{
        super::design::{Channel, ChannelGroup, Design},
        *,
    };

    #[test]
    fn it_is_that_of_its_definition_in_whatever_order_noises_are_asked_for() {
        let toy = Toy::new(5, 1);
        let all = columns(&toy, 3).remove(0);
        let column = |at: usize| Arc::new(all.column(at).iter().copied().collect::<Vec<f64>>());
        let channel = Channel {
            kind: SensorKind::Mag,
            axis: 0,
            ids: vec![0, 1],
            x: vec![column(0), column(1)],
            y: DVector::from_column_slice(all.column(2).as_slice()),
        };
        let design = Design { columns: Vec::new(), size: 2, channels: vec![channel] };
        let groups = [ChannelGroup { channels: vec![0], effects: toy.effects(2) }];
        let likelihood = Likelihood::new(&design.products(&groups, &[0, 1]), SensorKind::Mag, &[0, 1]);
        for slow in [1.0, 4.0, 1.0, 0.1, 4.0] {
            let drifts = [Process { time: 8.0, sigma: 0.7 }, Process { time: 120.0, sigma: slow }];
            let (products, log_determinant) = toy.products(std::slice::from_ref(&all), &drifts);
            let expected = reml_criterion(&Normal::within(&products, log_determinant));
            let found = likelihood.of(SIGMA, drifts);
            assert!((found - expected).abs() < 1e-9, "{slow}: {found} {expected}");
        }
    }
}
