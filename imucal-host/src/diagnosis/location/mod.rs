//! Where a gap lies: covariates that the residual depends on.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | the residual of a set, its noise | covariates with p-values and the size of what follows them |
//!
//! | file | what |
//! | --- | --- |
//! | [`covariate`] | a covariate: a handful of functions of the block |
//! | [`covariates`] | those of a recording: angles, rates, temperature, time, inputs |
//! | [`attitude_covariates`] | those where no gimbals turn the sensor |
//! | [`periodogram`] | a sinusoid of free frequency |
//! | [`score_test`] | Rao's score test of each covariate under the fitted noise |
//!
//! Source: Rao, Proc. Cambridge Phil. Soc. 44 (1948).
//!
//! Not done here: a covariate is no cause. It shows where to look where no effect explains the residual.

pub mod attitude_covariates;
pub mod covariate;
pub mod covariates;
pub mod periodogram;
pub mod score_test;
