//! Simulated recordings: a motion that knows no sensor, and a sensor that knows no motion.

pub mod recorder;
pub mod tumble;

pub use recorder::{SimulatedSensor, SimulatedUnit, record};
pub use tumble::{Truth, Tumble};
