//! Mirrored and swapped triads, and gains that look like a wrong unit.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a calibration, rates and directions between rests, the site's dip | refusals by name, or axes put right; remarks on gains near 0.5 or 57.3 |

mod body_axes;
pub mod gain_remark;
pub mod mirror;
pub mod turn_sense;
