//! What an ideal sensor would have been through.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a recording with encoders (`gimbal_*`), a reference attitude (`ref_q*`), a simulator's stream (`sim_*`) or none of them; a calibration made elsewhere | a movement that gives the truth at any instant; the triads that the simulator starts from, with their standard errors |
//!
//! | file | what |
//! | --- | --- |
//! | [`model`] | the simulator's present model of the unit: a stored calibration as triads in SI |
//! | `moments` | samples against what they were given, by least squares |
//! | [`movement`] | which of the movements a recording has, and its place on Earth |
//! | [`pose`] | attitudes and positions of a reference |
//! | [`rest_to_rest`] | a movement reconstructed from the sensor's own rests and turns (this runs a whole calibration) |
//! | [`stream`] | the movement of a simulator's stream |
//! | [`impact`] | rows near an impact that the samples of a stream do not resolve |
//! | [`strikes`] | impacts in a row that the recording or the stream lacks |
//! | [`common_instants`] | impacts of both at the same instants |
//! | [`absence`] | impacts in a row that one side does not show at all |
//! | [`gain`] | impacts in a row that one side has fainter or stronger, where the faster side resolves them |
//! | [`scan`] | stretches of a row over which a sum of logarithms of odds is largest |
//! | [`unforeseen`] | what a sample's neighbours do not foretell of it |
//! | [`stream_clock`] | its clock against that of the sensor, roughly |
//! | `rate_lags` | by how much later than a clock says the stream is, by windows |
//! | `lag_steps` | a line with steps through these |
//! | `binned` | means of a vector's samples over short bins |
//! | [`clock_steadiness`] | where that clock jumps or wanders |
//! | `clock_confirmation` | whether another sensor than the gyroscope shows it |
//! | [`revisits`] | whether attitudes are held more than once, without which repeatability cannot be estimated |
//!
//! Encoders are replayed, reference attitudes differentiated and streams interpolated by `simulator`.
//!
//! Not done here: a reference attitude holds no linear acceleration; its clock is put right in `screening`.

pub mod absence;
mod binned;
mod clock_confirmation;
pub mod clock_steadiness;
pub mod common_instants;
pub mod gain;
pub mod impact;
mod lag_steps;
pub mod model;
pub(super) mod moments;
pub mod movement;
pub mod pose;
mod rate_lags;
pub mod rest_to_rest;
pub mod revisits;
pub mod scan;
pub mod stream;
pub mod stream_clock;
pub mod strikes;
pub mod unforeseen;
