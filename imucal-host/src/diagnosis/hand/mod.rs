//! Recordings without a rig or a reference: what a hand that turns a sensor from rest to rest can show.
//!
//! The attitude of each rest is told by the sensors themselves, so that it is a nuisance: of an accelerometer's error
//! only the part along gravity counts, and of a gyroscope's turn only where it carries gravity to.

mod held;
mod view;

pub use self::{held::Held, view::View};
