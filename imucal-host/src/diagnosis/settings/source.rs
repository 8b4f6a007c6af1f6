//! Where the movement of a recording comes from, and what that provides.

use crate::recording::{Recording, Stream, manifest::ReferenceKind};

/// Where the movement of a recording comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Encoders of a rig's gimbals.
    Rig,
    /// A reference attitude, as of an optical tracker.
    Reference,
    /// A reference attitude and position.
    Pose,
    /// A simulator's stream of what ideal sensors would have read.
    Simulator,
    /// The sensor's own rests: a hand, or a turntable without a readout.
    Rests,
}

impl Source {
    /// That of a recording, with the stream that a simulator gives for it, where there is one: a stream in a file of
    /// its own is asked for; one in the recording's own columns comes after encoders.
    pub fn of(recording: &Recording, stream: Option<&Stream>) -> Self {
        match (stream, &recording.gimbal, &recording.simulated, &recording.reference) {
            (Some(_), ..) => Self::Simulator,
            (None, Some(_), ..) => Self::Rig,
            (None, None, Some(_), _) => Self::Simulator,
            (None, None, None, Some(_)) if has_positions(recording) => Self::Pose,
            (None, None, None, Some(_)) => Self::Reference,
            (None, None, None, None) => Self::Rests,
        }
    }

    /// The kind of a reference on the body; `None` of a rig and of rests.
    pub fn reference(self) -> Option<ReferenceKind> {
        match self {
            Self::Reference => Some(ReferenceKind::Attitude),
            Self::Pose => Some(ReferenceKind::Pose),
            Self::Simulator => Some(ReferenceKind::Simulator),
            Self::Rig | Self::Rests => None,
        }
    }
}

/// Positions are given somewhere.
fn has_positions(recording: &Recording) -> bool {
    let given = |row: &[f64; 3]| row.iter().all(|value| value.is_finite());
    recording.position.as_ref().is_some_and(|positions| positions.iter().any(given))
}

/// What the source of a movement provides; an effect's needs are compared with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Provided {
    /// Angles of three gimbals.
    pub gimbals: bool,
    /// Something outside of the sensor turns with it, whose own errors can be distinguished from the sensor's.
    pub table: bool,
    /// A base that stands in some way against the vertical and north.
    pub base: bool,
    /// A clock of its own, whose offset from the sensor's is always fitted.
    pub clock: bool,
    /// That clock may also run at another rate, which is fitted too.
    pub clock_rate: bool,
    /// That the sensors follow it was seen when its clock was found.
    pub followed: bool,
    /// Nothing says that all sensors were read at the same time: each may lag.
    pub lags: bool,
    /// A place: the sensor is not moved to and fro, or its acceleration would be known.
    pub position: bool,
    /// Positions, row by row.
    pub placed: bool,
    /// The heading against north.
    pub heading: bool,
    /// An attitude without noise or a filter of its own.
    pub exact_attitude: bool,
}

impl Provided {
    /// Where there is a magnetometer, the field in the sensor's axes: by the heading, or as a stream holds it.
    pub fn gives_field(&self) -> bool {
        self.heading || self.followed
    }
}
