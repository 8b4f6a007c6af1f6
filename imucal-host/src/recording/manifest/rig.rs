//! What turned the sensor.

use serde::{Deserialize, Serialize};

/// What turned the sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// Kind of rig.
    pub kind: RigKind,
    /// Gimbal axes, outermost first, in the parent's frame at zero; one to three.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<Axis>>,
}

/// Kinds of rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RigKind {
    /// Three gimbals with encoders.
    FlightMotionSimulator,
    /// A table with a commanded rate.
    RateTable,
    /// A turntable with positions.
    Turntable,
    /// Turned by hand.
    Hand,
    /// Tracked by an optical system.
    Optical,
}

/// An axis of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}
