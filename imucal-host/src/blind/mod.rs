//! Sealed trials of the diagnosis: recordings whose effects it does not know, and how often it is right.
//!
//! A nonce draws every case: what the rig does, under what conditions, and which effects of which size are there. Labels
//! are hashed before the recording is diagnosed. The simulator is the diagnosis' own where it has effects, since the
//! catalogue is one; all else about a recording varies, and what is outside the catalogue stands in [`mod@outside`] alone.
//! Not simulated either: what the [simulator](crate::simulator) leaves out.

pub mod answer;
pub mod case;
pub mod interval;
pub mod judgement;
pub mod lambda;
pub mod outside;
pub mod proposal;
pub mod robot;
pub mod score;
pub mod seal;
mod setting;
mod table;
pub mod trial;
pub mod trial_error;
pub mod world;
