//! Levenberg–Marquardt on problems whose answer is known.

use imucal_core::solver::LevenbergMarquardt;
use nalgebra::{Matrix2, SVector};

use crate::rows::{Rows, Valley};

#[test]
fn steps_that_lead_uphill_are_damped_until_one_leads_down() {
    let mut fit = LevenbergMarquardt::new(SVector::from([-1.2, 1.0]), Default::default());
    let report = fit.run(&Valley);
    assert!(report.termination.was_successful(), "{report:?}");
    // A pass for each cost and one for each Jacobian: fewer Jacobians than costs means that steps were refused.
    assert!(report.evaluations < 2 * report.iterations, "{report:?}");
    assert!((fit.theta() - SVector::from([1.0, 1.0])).amax() < 1e-6, "{}", fit.theta());
}

#[test]
fn the_covariance_of_a_straight_line_is_the_textbook_s() {
    // y = a + b x at x = 0, 1, 2, 3 with residuals of ±1.
    let rows = Rows { rows: (0..4).map(|k| ([1.0, -1.0, -1.0, 1.0][k], [1.0, k as f64])).collect() };
    let mut fit = LevenbergMarquardt::new(SVector::zeros(), Default::default());
    assert!(fit.run(&rows).termination.was_successful());
    // Σ r² = 4 with two degrees of freedom, and (XᵀX)⁻¹ of n = 4, Σ x = 6, Σ x² = 14.
    let expected = Matrix2::new(14.0, -6.0, -6.0, 4.0) / 20.0 * 2.0;
    assert!((fit.variance().unwrap() - 2.0).abs() < 1e-12);
    assert!((fit.covariance().unwrap() - expected).amax() < 1e-12, "{:?}", fit.covariance());
    let one = Rows { rows: vec![(1.0, [1.0, 0.0]), (1.0, [0.0, 1.0])] };
    let mut fit = LevenbergMarquardt::new(SVector::zeros(), Default::default());
    fit.run(&one);
    assert_eq!((fit.variance(), fit.covariance()), (None, None));
}
