//! What a missing effect looks like, where the catalogue ends.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | the residual of a search whose verdict is `unknown` or `partly` | a formula a sensor, as an effect of a user's file; or that none was found |
//!
//! | file | what |
//! | --- | --- |
//! | [`term`] | one formula: its drivers, its shape, how it is spelt |
//! | [`grammar`] | all formulas that are tried |
//! | [`problem`] | the residual of a sensor, and formulas as columns |
//! | [`screening`] | all formulas by linear algebra in a given noise |
//! | [`judgement`] | one by its evidence, with the noise estimated again with it; its shape refined |
//! | [`equivalents`] | formulas that the recording cannot distinguish: the simplest stands for them |
//! | [`finalists`] | the best formula, by these |
//! | [`null_threshold`] | what the best of all gains in noise alone |
//! | [`refitted`] | the problem about a fit that has a formula among its effects |
//! | [`entry`] | the text of a user's file |
//! | [`trial`] | what a formula closes on held-out stretches, and what is still followed |
//! | [`constancy`] | whether its amplitude is the same at any time and after any past |
//! | [`proposer`] | sensor by sensor: the proposal, or why there is none |
//! | [`confirmation`] | a formula of another recording, with its amplitudes as they were found there |
//!
//! Sources: Schmidt and Lipson, Science 324 (2009), of formulas sought among simple functions; Gumbel (1958), of the largest
//! of many.
//!
//! Not done here: sums of several formulas on one sensor, functions of three drivers, and what remembers more than a lag does.

pub mod confirmation;
pub mod constancy;
pub mod entry;
pub mod equivalents;
pub mod finalists;
pub mod grammar;
pub mod judgement;
pub mod null_threshold;
pub mod problem;
pub mod proposer;
pub mod refitted;
pub mod screening;
pub mod term;
pub mod trial;

#[cfg(test)]
mod tests;
