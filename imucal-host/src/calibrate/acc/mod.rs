//! The accelerometer, by the norm of gravity at rests in many directions.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | rests (mean output, covariance), the site's gravity | an outcome: the fit with its standard errors, or a refusal |
//!
//! Model: T9 (nine parameters, lower triangular gain; Secer & Barshan 2016) or its reduced forms.
//!
//! Not done here: known attitudes are used in `known_attitudes`.

pub mod rests;
