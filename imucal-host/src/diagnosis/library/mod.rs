//! The effects that may explain a gap, where in their nonlinear parameters each is taken, and the evidence for a set.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | the catalogue, what the recording has, normal equations | candidates; a posterior over each one's instants and time constants; ln Bayes factors |
//!
//! | file | what |
//! | --- | --- |
//! | [`candidates`] | which effects are baseline, which are candidates, and which cannot be tested and why |
//! | [`formulas`] | a user's effects that have a value all over the recording, of those that are the same here one |
//! | [`nonlinear`] | signatures over a grid of nonlinear parameters |
//! | [`grid_posterior`] | the likelihood over that grid and its Occam factor |
//! | [`grid`] | the grid for every candidate of a fit |
//! | [`evidence`] | ln Bayes factors of sets of effects |
//!
//! Source: Kass and Raftery, J. Am. Stat. Assoc. 90 (1995).
//!
//! Not done here: no set is chosen.

pub mod candidates;
pub mod evidence;
pub mod formulas;
pub mod grid;
pub mod grid_posterior;
pub mod nonlinear;
