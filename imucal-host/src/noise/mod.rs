//! Noise of observations that are means over stretches of time: white, scatter from one to the next, drift.
//!
//! ```text
//! V_ij = S ( w δ_ij / T_i + d F_ij )       each axis on its own, S its white noise
//! ```
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | S | density of the white noise within rests ([`white`]) | unit²·s |
//! | T_i | length of observation i | s |
//! | w | 1 for white noise alone; above it what differs from one observation to the next, as stops that scatter | – |
//! | d | variance of the drift over S; its inverse is the time over which white noise averages to the drift's size | 1/s |
//! | F | covariance of unit flicker between the observations' means ([`flicker`]) | – |
//!
//! S is measured within rests, w and d from residuals ([`estimate`]). Not modelled: axes that err alike, scatter whose
//! size or direction depends on the pose, an error that repeats when a pose comes back.

pub mod estimate;
pub mod flicker;
pub mod white;
pub mod whitening;

pub use estimate::{Noise, Residuals};
pub use whitening::Whitening;

use std::ops::Range;

/// When an observation was made, s.
pub type Span = Range<f64>;
