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
//! | Σ | covariance: [`super::whitening`] |
//! | Λ | a prior of the columns' amounts that tells next to nothing |
//!
//! A search asks for many noises of like scatter, and for some of them again: neither is worked out twice.

use std::{cell::RefCell, sync::Arc};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::{
    design::{DesignProducts, Normal},
    whitening::{Process, Still, Stilled, Whitening},
};
use crate::recording::SensorKind;

/// Prior information on a column: a usual size is one, and this many of them would be no surprise.
const LOOSE: f64 = 30.0;

/// Scatter and drifts.
type Asked = (f64, [Process; 2]);

/// The likelihood of one sensor's residual.
pub struct Likelihood {
    design: DesignProducts,
    size: usize,
    /// The columns of each channel under a scatter.
    stilled: RefCell<Vec<(f64, Arc<Vec<Stilled>>)>>,
    known: RefCell<Vec<(Asked, f64)>>,
}

impl Likelihood {
    /// Of a sensor's residual, less some columns of a design.
    pub fn new(design: &DesignProducts, kind: SensorKind, columns: &[usize]) -> Self {
        let design = design.picked(Some(kind), columns);
        Self { design, size: columns.len(), stilled: RefCell::default(), known: RefCell::default() }
    }

    /// −2 ln of the likelihood under a scatter and drifts beside the white noise by which the design was condensed, but for
    /// a constant.
    pub fn of(&self, scatter: f64, drifts: [Process; 2]) -> f64 {
        if let Some((_, value)) = self.known.borrow().iter().find(|(known, _)| *known == (scatter, drifts)) {
            return *value;
        }
        let part = |stilled: &Stilled| {
            let whitening = Whitening::drifting(Arc::clone(&stilled.still), &drifts);
            Normal::within(&whitening.stilled_products(stilled), &whitening)
        };
        let parts: Vec<Normal> = self.stilled(scatter).par_iter().map(part).collect();
        let value = reml_criterion(&self.design.sum(self.size, &parts));
        self.known.borrow_mut().push(((scatter, drifts), value));
        value
    }

    fn stilled(&self, scatter: f64) -> Arc<Vec<Stilled>> {
        if let Some((_, stilled)) = self.stilled.borrow().iter().find(|(known, _)| *known == scatter) {
            return Arc::clone(stilled);
        }
        let channels = self.design.channels.par_iter();
        let stilled = channels.map(|channel| {
            Arc::new(Still::new(Arc::clone(&channel.columns.latents), scatter)).weighed(&channel.columns)
        });
        let stilled = Arc::new(stilled.collect());
        self.stilled.borrow_mut().push((scatter, Arc::clone(&stilled)));
        stilled
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
    use nalgebra::DVector;

    use super::{
        super::{
            design::{Channel, Design},
            random_effects::{RandomEffects, Shared},
        },
        *,
    };

    const BLOCKS: usize = 30;
    const COURSE: f64 = 0.4;

    fn time(block: usize) -> f64 {
        2.5 * block as f64
    }

    /// Two axes with two columns each: blocks as far apart as knots, so that drifts are what their knots are.
    fn design() -> Design {
        let channel = |axis: usize| {
            let x = DMatrix::from_fn(BLOCKS, 2, |block, at| ((block * (at + 2) + axis) as f64).cos());
            let y = DVector::from_fn(BLOCKS, |block, _| ((block * block + 5 * axis) as f64).sin());
            Channel { kind: SensorKind::Mag, axis, ids: vec![axis, 2], x, y }
        };
        Design { columns: Vec::new(), size: 3, channels: vec![channel(0), channel(1)] }
    }

    /// By its definition.
    fn expected(scatter: f64, drifts: &[Process; 2]) -> f64 {
        let sigma = DMatrix::from_fn(BLOCKS, BLOCKS, |a, b| {
            let drift =
                |drift: &Process| drift.sigma.powi(2) * (-(time(a) - time(b)).abs() / drift.time).exp();
            let shared = if a < 9 && b < 9 { (scatter * COURSE).powi(2) } else { 0.0 };
            let white = if a == b { 0.5 } else { 0.0 };
            white + shared + drifts.iter().map(drift).sum::<f64>()
        });
        let factor = sigma.cholesky().unwrap();
        let (mut normal, design) = (Normal::zeros(3), design());
        for channel in &design.channels {
            let (x, y) = (factor.solve(&channel.x), factor.solve(&channel.y));
            let part = Normal {
                information: channel.x.tr_mul(&x),
                score: channel.x.tr_mul(&y),
                energy: channel.y.dot(&y),
                log_determinant: factor.ln_determinant(),
            };
            normal.add(&part, &channel.ids);
        }
        reml_criterion(&normal)
    }

    #[test]
    fn it_is_that_of_its_definition_in_whatever_order_noises_are_asked_for() {
        let times: Vec<f64> = (0..BLOCKS).map(time).collect();
        let shared = [Shared { blocks: 0..9, courses: vec![vec![COURSE; 9]] }];
        let condensed = design().condensed(&|_| RandomEffects::new(&times, vec![2.0; BLOCKS], &shared));
        let likelihood = Likelihood::new(&condensed, SensorKind::Mag, &[0, 1, 2]);
        let asked = [(0.3, 1.0), (2.0, 1.0), (0.3, 4.0), (0.3, 1.0), (2.0, 0.1), (2.0, 1.0)];
        for (scatter, sigma) in asked {
            let drifts = [Process { time: 8.0, sigma: 0.7 }, Process { time: 120.0, sigma }];
            let (found, expected) = (likelihood.of(scatter, drifts), expected(scatter, &drifts));
            assert!((found - expected).abs() < 1e-7, "{scatter} {sigma}: {found} {expected}");
        }
    }
}
