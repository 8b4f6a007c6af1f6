//! Why a fit that keeps its limits is not trusted: its residual is not the sensor's noise.
//!
//! A limit on the residual as a share of the norm cannot see a small error that standard errors do not describe. Here a
//! finding says what the residual follows; a sensor with one is `suspect`, a status between accepted and refused.

/// What a residual follows though it should follow nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Follows {
    /// Nothing that is known; it is larger than the noise of the samples.
    Excess,
    /// The time since the recording's beginning.
    Time,
    /// The temperature.
    Temperature,
    /// The direction of what is measured, in the sensor's axes.
    Direction,
    /// The rate of rotation.
    Rate,
    /// The specific force.
    Force,
    /// The attitude that encoders, or an accelerometer, show.
    Attitude,
    /// Single observations that disagree with their neighbours.
    Neighbours,
    /// The clock of the samples.
    Clock,
    /// The field that the manifest declares.
    Field,
    /// Another sensor, itself suspect, that this one is calibrated against.
    Accelerometer,
}

impl Follows {
    /// Its fixed name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Excess => "excess",
            Self::Time => "time",
            Self::Temperature => "temperature",
            Self::Direction => "direction",
            Self::Rate => "rate",
            Self::Force => "force",
            Self::Attitude => "attitude",
            Self::Neighbours => "neighbours",
            Self::Clock => "clock",
            Self::Field => "field",
            Self::Accelerometer => "accelerometer",
        }
    }
}

/// One finding against a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Suspicion {
    /// What the residual follows.
    pub follows: Follows,
    /// A sentence with the figures that led to it.
    pub detail: String,
}

/// What became of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The calibration may be used.
    Accepted,
    /// The fit keeps its limits, but its residual is not the noise; written only on request.
    Suspect,
    /// There is no calibration.
    Refused,
}

impl Status {
    /// Its fixed name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::Suspect => "suspect",
            Self::Refused => "refused",
        }
    }
}
