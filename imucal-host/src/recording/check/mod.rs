//! What a recording's samples say of themselves: gaps, saturation, stuck stretches, units that cannot be.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | columns in SI | usable rows of each sensor; warnings; refusals of units that no sensor has |

pub(crate) mod absurd;
pub mod integrity;
pub(crate) mod saturation;
mod stuck;
pub(crate) mod unit_check;
