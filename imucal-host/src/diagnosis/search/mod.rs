//! Which set of effects explains the residual best, and its fit.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | candidates and their evidence | the best set, its noise, its fitted parameters, and the problem linearised about them |
//!
//! | file | what |
//! | --- | --- |
//! | [`hypothesis`] | a set as it is screened axis by axis and scored jointly |
//! | [`refit`] | Gauss–Newton through the simulator: baseline and a set together |
//! | [`staged_start`] | a start for it, sensor by sensor |
//! | [`linearisation`] | the problem linearised about a fit |
//! | [`score`] | evidence of a set, axis by axis and jointly |
//! | [`memo`] | results that are asked for again |
//! | [`neighbours`] | sets one addition, removal or exchange away |
//! | [`motion_evidence`] | where the sensors agree on a movement that the simulator lacks |
//! | [`motion_mismatch`] | stretches in which the machine moved otherwise than its simulator |
//! | [`turn_likelihood`] | whether two sensors' residuals are one turn of the sensor, or a fault of either |
//! | [`held_back`] | effects that a large noise holds back, found from a perfect sensor |
//! | [`stepwise`] | the search: neighbours are screened and scored until none is better |
//!
//! Not done here: sets of more than a few effects are not enumerated; the search climbs.

pub mod held_back;
pub mod hypothesis;
pub mod linearisation;
pub mod memo;
pub mod motion_evidence;
pub mod motion_mismatch;
pub mod neighbours;
pub mod refit;
pub mod score;
pub mod staged_start;
pub mod stepwise;
pub mod turn_likelihood;
