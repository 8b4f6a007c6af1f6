//! Programmes of the flight motion simulator, by name. Schedules vary with the seed: order, angles, dwell times.

use crate::{recording::manifest::Axis, simulator::SimulationError};

use super::{
    climate::Climate,
    place::Place,
    random::{Purpose, Random},
};

mod full;
mod gyroscope;
mod mixed;
mod multi_position;
mod plan;
mod rates;
mod schedule;
mod sinusoids;
mod thermal;

pub use plan::{Plan, wrap};
pub use schedule::{Schedule, Segment};

/// Rests may shrink to this share.
const LEAST_REST: f64 = 0.3;
/// Lengths of the mixed programme, s.
const MIXED: (f64, f64) = (150.0, 600.0);
/// What the rests at both ends take, s.
const ENDS: f64 = 18.0;

/// What the rig does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Programme {
    /// Rests in 24 attitudes, six of them twice.
    MultiPosition,
    /// Constant rates of both signs about each axis.
    Rates,
    /// Swings of three frequencies about each axis.
    Sinusoids,
    /// Slews to 150° over 100 s.
    Gyroscope,
    /// The same attitudes again and again while it warms and cools.
    Thermal,
    /// All of these.
    #[default]
    Full,
    /// Drawn item by item, no two alike.
    Mixed,
}

impl Programme {
    /// All programmes.
    pub const ALL: [Self; 7] = [
        Self::MultiPosition,
        Self::Rates,
        Self::Sinusoids,
        Self::Gyroscope,
        Self::Thermal,
        Self::Full,
        Self::Mixed,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::MultiPosition => "multi-position",
            Self::Rates => "rates",
            Self::Sinusoids => "sinusoids",
            Self::Gyroscope => "gyroscope",
            Self::Thermal => "thermal",
            Self::Full => "full",
            Self::Mixed => "mixed",
        }
    }

    /// The programme of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|programme| programme.name() == name)
    }

    /// Its schedule on a rig with these axes, outermost first; `duration` in s, or as long as it takes.
    ///
    /// # Errors
    ///
    /// [`SimulationError::TooShort`], when the movements leave no time for the rests.
    pub fn schedule(
        self,
        axes: [Axis; 3],
        seed: u64,
        duration: Option<f64>,
        place: Place,
    ) -> Result<Schedule, SimulationError> {
        let mut random = Random::new(seed, Purpose::Schedule);
        let mut plan = Plan::default();
        plan.rest(random.between(9.0, 12.0));
        let random = &mut random;
        match self {
            Self::MultiPosition => multi_position::add(&mut plan, axes, random),
            Self::Rates => rates::add(&mut plan, axes, random),
            Self::Sinusoids => sinusoids::add(&mut plan, axes, random),
            Self::Gyroscope => gyroscope::add(&mut plan, axes, random),
            Self::Thermal => thermal::add(&mut plan, axes, random),
            Self::Full => full::add(&mut plan, axes, random),
            Self::Mixed => {
                let whole = duration.filter(|duration| duration.is_finite());
                let whole = whole.unwrap_or_else(|| random.between(MIXED.0, MIXED.1));
                mixed::add(&mut plan, axes, whole - ENDS, random);
            }
        }
        plan.slew([0.0; 3]);
        plan.rest(random.between(5.0, 7.0));
        if let Some(duration) = duration {
            let shortest = plan.shortest(LEAST_REST);
            if duration.is_nan() || duration < shortest {
                return Err(SimulationError::TooShort { programme: self.name(), duration, shortest });
            }
            plan = plan.stretched(duration);
        }
        let climate = self.climate(plan.duration(), random);
        Ok(Schedule::new(axes, plan.into_segments(), climate, place))
    }

    /// Warms and cools, so that temperature and time are distinguished; strongly where that is the point.
    fn climate(self, duration: f64, random: &mut Random) -> Climate {
        let swing = match self {
            Self::Thermal | Self::Full => random.between(5.0, 8.0),
            Self::Mixed => random.between(0.5, 8.0),
            _ => random.between(1.0, 2.0),
        };
        let period = match self {
            Self::Mixed => (0.4, 1.2),
            _ => (0.45, 0.65),
        };
        Climate {
            mean: random.between(22.0, 26.0),
            swing,
            period: duration * random.between(period.0, period.1),
            phase: random.between(-1.5, 1.5),
            lag: random.between(30.0, 60.0),
            self_heating: random.between(1.0, 3.0),
        }
    }
}

#[cfg(test)]
mod tests;
