//! The magnetometer, by the norm of the field in many directions (E9), and its alignment with gravity.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | samples of a cloud, the site's field, directions at rests | an outcome: the fit with its standard errors, or a refusal |
//!
//! Not done here: known attitudes are used in `known_attitudes`.

pub mod declared_field;
pub mod samples;
