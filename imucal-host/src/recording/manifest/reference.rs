//! What the reference columns of a recording are.

use serde::{Deserialize, Serialize};

/// What the reference is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInfo {
    /// Kind of reference.
    pub kind: ReferenceKind,
    /// Its noise, rms: rad of an attitude, m of a position; finite, above zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Name of the system that it comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// Kinds of reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// An attitude alone.
    Attitude,
    /// An attitude and a position.
    Pose,
    /// A simulator's ideal sensors.
    Simulator,
}
