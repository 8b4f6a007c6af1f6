//! Accelerometer and magnetometer where the attitude is known: from a rig's encoders or from a reference.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | poses with their attitude, the field at the site | an outcome per sensor, and the forms of the model compared |
//!
//! | file | what |
//! | --- | --- |
//! | [`rig`] | poses of a rig with encoders |
//! | [`ladder`] | forms of the model from few to many parameters, compared by held-out residuals |
//! | [`mag_reference`] | the magnetometer along a reference attitude, with its latency |

pub mod ladder;
pub mod mag_reference;
pub mod rig;
