//! Recorded less simulated samples, as means over blocks, and the simulator's own derivatives.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | usable rows, a movement, triads | block means of the residual; the signature of any parameter of any effect |
//!
//! | file | what |
//! | --- | --- |
//! | [`block`] | rows that are averaged: short in motion, longer at rest |
//! | [`sample_points`] | where in a block the simulator is evaluated |
//! | [`forward_model`] | data and simulator side by side |
//! | [`simulated_rows`] | recorded less simulated, row by row |
//! | [`base_run`] | a simulated run and its derivatives by difference quotients |
//! | [`gimbal_derivatives`] | what a radian of a gimbal's offset changes |
//! | [`gravity_observables`] | what rests and turns of a hand show whatever the heading was |
//! | [`vibration`] | how much noise a shaking machine makes, block by block |
//! | [`transient`] | blocks in which a magnet is brought near or taken away are left out |
//!
//! Not done here: nothing is estimated; noise is weighed in `mixed_model`.

pub mod base_run;
pub mod block;
pub mod forward_model;
pub mod gimbal_derivatives;
pub mod gravity_observables;
pub mod sample_points;
pub mod simulated_rows;
pub mod transient;
pub mod vibration;
