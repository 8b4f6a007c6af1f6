//! Parameters of effects.

/// What a parameter is to its effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// How much: the effect is off where all of these are zero, and they are scaled by its size.
    Amplitude,
    /// How, once it is there, such as a time constant.
    Shape {
        /// Usual value.
        usual: f64,
    },
    /// How, in a detail that a strong effect alone shows: zero until it is fitted with the amplitudes, and not looked for.
    Detail {
        /// Usual value.
        usual: f64,
    },
    /// When, as a time of the run.
    Instant {
        /// Usual share of the run, 0 to 1.
        share: f64,
    },
    /// One of a list, by its whole number; zero is off.
    Choice,
}

/// One parameter of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, unique within the effect.
    pub name: String,
    /// Unit, as the diagnosis prints it.
    pub unit: String,
    /// What it does.
    pub role: Role,
    /// Usual size, one standard deviation of the prior; in `unit`, positive.
    pub prior_scale: f64,
    /// Plausible values, in `unit`. A parameter from zero up cannot be negative.
    pub range: (f64, f64),
    /// Nothing in the world is beyond `range`: an estimate beyond it has another cause.
    pub is_bounded: bool,
    /// Smaller amplitudes do not matter to a user; in `unit`.
    pub material: f64,
}

impl Parameter {
    /// An amplitude of either sign: plausible to 30 times its usual size, material from a fifth of it.
    pub(super) fn amplitude(name: &str, unit: &str, prior_scale: f64) -> Self {
        Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            role: Role::Amplitude,
            prior_scale,
            range: (-30.0 * prior_scale, 30.0 * prior_scale),
            is_bounded: false,
            material: 0.2 * prior_scale,
        }
    }

    /// An amplitude that the world bounds.
    pub(super) fn bounded(name: &str, unit: &str, prior_scale: f64, range: (f64, f64)) -> Self {
        Self { range, is_bounded: true, ..Self::amplitude(name, unit, prior_scale) }
    }

    /// An amplitude that cannot be negative.
    pub(super) fn magnitude(name: &str, unit: &str, prior_scale: f64, largest: f64) -> Self {
        Self { range: (0.0, largest), ..Self::amplitude(name, unit, prior_scale) }
    }

    /// A positive shape, plausible within a factor of ten.
    pub(super) fn shape(name: &str, unit: &str, usual: f64) -> Self {
        Self {
            role: Role::Shape { usual },
            range: (0.1 * usual, 10.0 * usual),
            material: 0.0,
            ..Self::amplitude(name, unit, 0.5 * usual)
        }
    }

    /// A detail from zero to ten times its usual value.
    pub(super) fn detail(name: &str, unit: &str, usual: f64) -> Self {
        Self {
            role: Role::Detail { usual },
            range: (0.0, 10.0 * usual),
            material: 0.0,
            ..Self::amplitude(name, unit, usual)
        }
    }

    /// A time of the run.
    pub(super) fn instant(name: &str, share: f64) -> Self {
        Self {
            role: Role::Instant { share },
            range: (0.0, f64::INFINITY),
            material: 0.0,
            ..Self::amplitude(name, "s", 60.0)
        }
    }

    /// One of a list; zero is off.
    pub(super) fn choice(name: &str, last: f64) -> Self {
        Self { role: Role::Choice, range: (0.0, last), material: 1.0, ..Self::amplitude(name, "-", 1.0) }
    }

    /// Amplitudes of like size.
    pub(super) fn amplitudes(names: &[&str], unit: &str, prior_scale: f64) -> Vec<Self> {
        names.iter().map(|name| Self::amplitude(name, unit, prior_scale)).collect()
    }

    /// It says whether the effect is there.
    pub fn switches(&self) -> bool {
        matches!(self.role, Role::Amplitude | Role::Choice)
    }

    /// Its value in a run of `duration` s where the effect is off.
    pub fn neutral(&self, duration: f64) -> f64 {
        match self.role {
            Role::Amplitude | Role::Choice | Role::Detail { .. } => 0.0,
            Role::Shape { usual } => usual,
            Role::Instant { share } => share * duration,
        }
    }
}
