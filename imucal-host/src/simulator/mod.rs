//! Simulated recordings: movements that know no sensor, units that know no movement, and effects between them.
//!
//! Everything random follows from a seed and everything else from arithmetic that is the same on any machine: libm by
//! name, no function of the platform.

pub mod chain;
mod clean;
pub mod climate;
pub mod conditions;
mod converter;
pub mod course;
pub mod cubic;
pub mod dose;
mod error;
pub mod gimbal;
pub mod parts;
pub mod place;
pub mod posed;
pub mod position_smoother;
pub mod programme;
pub mod random;
pub mod recent;
pub mod recorder;
pub mod replay;
pub mod robot;
pub mod run;
pub mod streamed;
mod swing_fit;
pub mod tracked;
mod triad_noise;
pub mod truth;
pub mod tumble;
pub mod unit;

pub use conditions::{Conditions, NoiseLevel};
pub use dose::Dose;
pub use error::{OutputError, SimulationError};
pub use parts::Parts;
pub use place::Place;
pub use posed::Posed;
pub use programme::Programme;
pub use recorder::{SimulatedSensor, SimulatedUnit, record};
pub use replay::Replay;
pub use run::Simulation;
pub use streamed::{StreamClock, Streamed};
pub use tracked::Tracked;
pub use truth::{Motion, Recorded};
pub use tumble::Tumble;
pub use unit::{DriftKind, UnitKind};
