//! What an effect is to a diagnosis, what a recording must hold to show it, and which rows a fault spoils.

use crate::recording::SensorKind;

/// The part an effect plays in a diagnosis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// It may explain what the baseline leaves.
    #[default]
    Candidate,
    /// A term of a triad: fitted always, unless a calibration made elsewhere gives the triad.
    TriadTerm,
    /// How a rig or a reference is set up: fitted always where one of these sensors shows it.
    RigTerm(&'static [SensorKind]),
    /// The reference's clock: fitted always where no gimbals turn the sensor, since such a reference has a clock of its
    /// own; a candidate on a rig.
    ClockTerm,
    /// The rate of that clock: fitted always where it is not that of the sensor; a candidate on a rig.
    ClockRateTerm,
    /// Fitted where nothing else fixes it, and never named as a cause.
    Nuisance(Free),
    /// A fault of the recording itself, which the screening finds.
    Fault(Spoils),
}

/// Where a nuisance is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// Nothing says that the chip was read when the others were.
    ReadApart,
    /// Positions are known.
    Placed,
    /// No gimbals turn the sensor, and its triad is given.
    NoGimbalsTriadGiven,
    /// The site's field is not given, and an accelerometer shows the vertical.
    FieldUnknown,
    /// The site's field is not given, and the triad is: a free triad takes it up.
    FieldUnknownTriadGiven,
}

/// What a fault does to rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spoils {
    /// The samples are a linear function of the right ones, which can be undone.
    Nothing,
    /// Likewise, but of another size, so that any may seem to lie beyond the range.
    Scale,
    /// Rows that repeat the one before.
    Repeats,
    /// Rows beyond the limit.
    BeyondLimit,
    /// Rows of a passage of time.
    Passage,
}

/// What a recording must hold to show an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Gimbals that turn the sensor.
    pub gimbals: bool,
    /// A temperature.
    pub thermometer: bool,
    /// A heading, from a rig or a reference.
    pub heading: bool,
    /// A calibration made elsewhere: one made of the recording itself takes the effect up.
    pub other_calibration: bool,
    /// An attitude without noise and filter of its own: of encoders, or of rests.
    pub exact_attitude: bool,
    /// A place, or a sensor that is not moved to and fro.
    pub position: bool,
    /// A reference on the body, of a tracker or a simulator: neither a rig nor the sensor's own rests.
    pub outside: bool,
    /// Specific force without the errors of accelerations that follow from positions.
    pub exact_force: bool,
    /// A simulator's stream: elsewhere the base's heading and the site's field are terms of the baseline.
    pub stream: bool,
    /// That all sensors were read at the same time: else a delay of one of them is the reference's clock.
    pub read_together: bool,
}

impl Needs {
    /// Nothing but the sensor.
    pub const NOTHING: Self = Self {
        gimbals: false,
        thermometer: false,
        heading: false,
        other_calibration: false,
        exact_attitude: false,
        position: false,
        outside: false,
        exact_force: false,
        stream: false,
        read_together: false,
    };
    /// Gimbals.
    pub const GIMBALS: Self = Self { gimbals: true, ..Self::NOTHING };
    /// A temperature.
    pub const THERMOMETER: Self = Self { thermometer: true, ..Self::NOTHING };
    /// A heading.
    pub const HEADING: Self = Self { heading: true, ..Self::NOTHING };
    /// A calibration made elsewhere.
    pub const OTHER_CALIBRATION: Self = Self { other_calibration: true, ..Self::NOTHING };
    /// A place.
    pub const POSITION: Self = Self { position: true, ..Self::NOTHING };
    /// A reference on the body.
    pub const OUTSIDE: Self = Self { outside: true, ..Self::NOTHING };
    /// An exact specific force.
    pub const EXACT_FORCE: Self = Self { exact_force: true, ..Self::NOTHING };
    /// A simulator's stream.
    pub const STREAM: Self = Self { stream: true, ..Self::NOTHING };
    /// Sensors that were read together.
    pub const READ_TOGETHER: Self = Self { read_together: true, ..Self::NOTHING };
    /// An exact attitude.
    pub const EXACT_ATTITUDE: Self = Self { exact_attitude: true, ..Self::NOTHING };
}
