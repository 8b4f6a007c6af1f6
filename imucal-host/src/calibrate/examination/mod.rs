//! Whether the residual of an accepted fit is the noise: if it depends on something else, the sensor is suspect.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a calibration with its residuals | suspicions: what the residual depends on, how clearly, and what it may have done to the parameters |
//!
//! Statistics: Rao's score test of the residual against time, temperature, direction, rate and neighbours, with the number
//! of tests counted; a suspicion that changes no parameter by much is left out.

mod cloud_score;
mod dip_residual;
pub mod examine;
pub mod gyr_residual;
pub mod motion_residual;
pub mod norm_residual;
pub mod pose_residual;
mod pose_score;
pub mod residual_driver;
pub mod side;
mod tested;
mod turn_score;
pub mod turning_rest;
