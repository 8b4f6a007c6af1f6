//! Why no terms of temperature are estimated.

use std::fmt;

/// The reason, with the figures that led to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TemperatureRefusal {
    /// Observations without a temperature.
    NotMeasured {
        /// Observations with one.
        have: usize,
        /// Observations there are.
        of: usize,
    },
    /// The temperatures of the observations lie too near each other.
    Narrow {
        /// Their span, K.
        span: f64,
        /// The least, K.
        need: f64,
    },
    /// The thermometer repeats one reading while it ought to change.
    Stuck {
        /// From when, s.
        from: f64,
        /// For how long, s.
        duration: f64,
        /// The longest other repetition, s.
        usual: f64,
    },
    /// The thermometer jumps as no sensor warms.
    Jump {
        /// When, s.
        at: f64,
        /// By how much, K.
        by: f64,
    },
    /// Temperature only rises or only falls: whatever drifts with time looks the same.
    AloneWithTime {
        /// Share of the temperature's variance that no monotone function of time has.
        apart: f64,
        /// The least.
        need: f64,
    },
    /// Fewer observations than the terms and the rest of the model need.
    TooFewObservations {
        /// Observations there are.
        have: usize,
        /// Observations needed.
        need: usize,
    },
    /// The model has other terms that are estimated in their place.
    Model {
        /// Name of the model.
        model: &'static str,
    },
}

impl TemperatureRefusal {
    /// The reason's fixed name in files.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::NotMeasured { .. } => "not-measured",
            Self::Narrow { .. } => "narrow-span",
            Self::Stuck { .. } => "stuck",
            Self::Jump { .. } => "jump",
            Self::AloneWithTime { .. } => "alone-with-time",
            Self::TooFewObservations { .. } => "too-few-observations",
            Self::Model { .. } => "model",
        }
    }

    /// What to do.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::NotMeasured { .. } => "record the sensor's own thermometer in the column temp",
            Self::Narrow { .. } => {
                "rest in many poses at temperatures 10 K or more apart, for example before, during and after warming"
            }
            Self::Stuck { .. } | Self::Jump { .. } => "check the thermometer and how it is read",
            Self::AloneWithTime { .. } => {
                "let it cool down again, with poses on the way, or visit the temperatures in another order"
            }
            Self::TooFewObservations { .. } => "rest in more poses, at each temperature in several",
            Self::Model { .. } => "calibrate with a model of gain and bias alone",
        }
    }
}

impl fmt::Display for TemperatureRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMeasured { have, of } => write!(f, "{have} of {of} observations have a temperature"),
            Self::Narrow { span, need } => {
                write!(f, "temperatures span {span:.2} K, {need:.0} K needed")
            }
            Self::Stuck { from, duration, usual } => write!(
                f,
                "the thermometer repeats one reading for {duration:.0} s from {from:.0} s on, elsewhere for {usual:.1} s \
                 at most"
            ),
            Self::Jump { at, by } => {
                write!(f, "the thermometer jumps by {by:+.1} K at {at:.1} s, as no sensor warms")
            }
            Self::AloneWithTime { apart, need } => write!(
                f,
                "temperature only rises or only falls: {:.1} % of its variance is apart from any such function of time \
                 ({:.0} % needed), so that a drift in time would pass for it",
                100.0 * apart,
                100.0 * need
            ),
            Self::TooFewObservations { have, need } => write!(f, "{have} observations, {need} needed"),
            Self::Model { model } => write!(f, "the model {model} has further terms of its own"),
        }
    }
}
