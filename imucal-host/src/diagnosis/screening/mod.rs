//! Faults of the recording itself, which are named, undone or left out before anything is fitted.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a recording and its reference | usable rows of each sensor, triads with axes and units put right, findings with their p-values, remarks |
//!
//! | file | what |
//! | --- | --- |
//! | [`bandwidth`] | how fast a movement recorded positions can be believed to follow |
//! | [`conventions`] | axis order and signs, units, gimbal order, clipping, repeated samples, noise bursts |
//! | `constant_axis` | an axis that shows one value in all rows |
//! | [`mounting`] | the small turn of a unit against the sensor that a simulator's stream is of |
//! | [`first_time`] | times that begin far from zero |
//! | [`held_values`] | rows that repeat the one before until a new value comes |
//! | [`recorded_values`] | a sensor that is slower than the table, whose rows repeat its values |
//! | [`pose_conventions`] | what a reference's attitudes and positions hold instead of what they should: order, frame, rate, jumps, steps, unit |
//! | [`stream_conventions`] | what a simulator's stream holds instead of what it should: unit, gravity, axes, noise, steps, too few samples |
//! | [`reference_offset`] | a large offset of the reference's clock, by the share of variance that no gain and bias explain |
//! | [`preparation`] | all of them together: what the rest of the diagnosis starts from |
//!
//! Statistics: linear regression of samples on the ideal input and its coefficient of determination; F and χ² tests with
//! the number of alternatives counted (Bonferroni).
//!
//! Not done here: effects that leave the samples usable; those are candidates of the search.

pub mod bandwidth;
mod constant_axis;
pub mod conventions;
pub mod first_time;
pub mod held_values;
pub mod mounting;
pub mod pose_conventions;
pub mod preparation;
pub mod recorded_values;
pub mod reference_offset;
pub mod stream_conventions;
