//! What is said of a gap.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | the best set and its fit, covariates, findings of the screening | the diagnosis |
//!
//! | file | what |
//! | --- | --- |
//! | [`estimates`] | parameters of the causes with standard errors |
//! | [`shares`] | how much of the gap each closes on held-out blocks |
//! | [`credible`] | which other effects could stand in a cause's place |
//! | [`cross_validation`] | causes that held-out data do not confirm are taken out, where no rig guides the sensor |
//! | [`confounded_episode`] | episodes that cover the whole movement are taken out |
//! | [`model_error`] | causes within the standard errors of the given model are taken out |
//! | [`reference_clock`] | the offset of a reference's clock, a term of the baseline, as a cause |
//! | [`reference_error`] | causes that an error of the source could stand for are taken out |
//! | `swallowed` | what no effect explains, taken for noise |
//! | [`fault`] | shares of faults of the recording itself |
//! | [`detectability`] | what is absent, and from what size on it would have been detected |
//! | [`profile`] | the residual over what a sensor follows most, for drawings |
//! | [`experiment`] | what to record next to distinguish what is ambiguous |
//! | `tested` | what the residual of the best set still follows, what the set closes |
//! | `asserted` | the causes that are asserted |
//! | [`decision`] | the verdict, decided once from all of these |
//! | [`answer`] | the diagnosis, put together once |
//!
//! Not done here: nothing is fitted that the search has not fitted, but for the folds of the cross-validation.

pub mod answer;
mod asserted;
pub mod confounded_episode;
pub mod credible;
pub mod cross_validation;
pub mod decision;
pub mod detectability;
pub mod estimates;
pub mod experiment;
pub mod fault;
pub mod model_error;
pub mod profile;
pub mod reference_clock;
pub mod reference_error;
pub mod shares;
mod swallowed;
mod tested;
