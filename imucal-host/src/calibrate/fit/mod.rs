//! What the fits of all sensors share: rows, least squares, outliers, covariances, held-out residuals.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | observations and a model of the core | parameters, standard errors that allow for serial correlation and few residuals, residuals |
//!
//! | file | what |
//! | --- | --- |
//! | [`rows`] | derivatives as a dense matrix, its covariance and leverages |
//! | [`norm_fit`], [`rig_fit`], [`reference_fit`], [`gyr_rig_fit`] | least squares for each kind of observation |
//! | [`heading`] | the heading of a rig's base against a field that is known |
//! | [`least_squares`] | one fit by the core's solver |
//! | [`parallel_rows`] | the same rows on all cores, where they are very many |
//! | [`parallel_turns`] | rows of turns, worked out on all cores |
//! | [`outlier`] | observations that are left out, and the fit without them |
//! | [`held_out`], [`leverage`] | residuals of observations that the fit has not seen, from one factor of all |
//! | [`report`] | the figures of any of these fits |
//! | [`autocorrelation`] | by how much serial correlation of residuals inflates standard errors |
//! | [`rest_noise`], [`rest_covariance`], [`rest_bias`], [`shell_errors`] | errors of the observations |
//! | [`alignment`], [`directions`] | the rotation between two triads, from directions that both see at rest |
//! | [`lag`] | the latency of a reference |
//! | [`score_test`], [`blocked_score`] | Rao's score test of a residual against a covariate; of samples that are alike in time |
//! | [`search`] | the particle swarm of the core |
//! | [`compare`] | forms of a model by held-out residuals |

pub mod alignment;
pub mod autocorrelation;
pub mod blocked_score;
pub mod compare;
pub mod directions;
pub mod gyr_rig_fit;
pub mod heading;
pub mod held_out;
pub mod lag;
pub mod least_squares;
pub mod leverage;
pub mod norm_fit;
pub mod outlier;
pub mod parallel_rows;
pub mod parallel_turns;
pub mod reference_fit;
pub mod report;
pub mod rest_bias;
pub mod rest_covariance;
pub mod rest_noise;
pub mod rig_fit;
pub mod rows;
pub mod score_test;
pub mod search;
pub mod shell_errors;
