//! What to do next, how sure each sensor is, and what was thrown away.
//!
//! ```text
//! targets reached → enough;   axes that contradict → correct them;   no rest yet → hold still;   a rest too short → hold on;
//! else → the pose that says most, or, where only the magnetometer is missing, a direction of the field that was not seen
//! ```
//!
//! A session ends at its targets, standard errors as shares of a vector's length, and not after a number of poses.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{Session, estimate::Estimate, poses::unit};
use crate::{coverage, observer::rest::Stage, record::Sensor};

/// What was not used, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Thrown {
    /// Rests that were too short or too noisy.
    pub rests: u16,
    /// Turns with a gap or a clipped sample in them.
    pub turns: u16,
    /// Samples beyond the sensor's range.
    pub clipped: u16,
    /// Rests that had to go for want of room.
    pub forgotten: u16,
}

/// What to do next. The order of the variants is the messages' format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Advice {
    /// Lay the sensor still: no rest was seen yet, or it moves since a while.
    HoldStill,
    /// Keep it still: the rest that goes on is too short.
    HoldOn,
    /// Turn it until the specific force (upwards, at rest) points this way in the sensor's axes, unit vector; then hold it still.
    Turn([f32; 3]),
    /// Turn it about until the field points this way in the magnetometer's axes, unit vector.
    TurnAbout([f32; 3]),
    /// Every sensor has reached its target.
    Enough,
    /// End the session: the sensors disagree on the axes, and no further pose mends that. Their verdicts say which.
    CorrectAxes,
}

/// How far a session is. The order of the fields is the messages' format.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Guide {
    /// What to do next.
    pub advice: Advice,
    /// What was thrown away.
    pub thrown: Thrown,
    /// Rests that are kept.
    pub rests: u16,
    /// Turns that are kept.
    pub turns: u16,
    /// Points of the magnetometer's cloud.
    pub points: u16,
    /// Share of the sphere of directions that the rests of the accelerometer's last fit cover; 0 before it.
    pub coverage: f32,
    /// Expected error of a calibrated vector of each sensor, as a share of its length; `None` before its first fit.
    pub error: [Option<f32>; 3],
    /// Whether it is accepted as it is.
    pub accepted: [bool; 3],
    /// It moves, and has never been still: a vehicle, or a hand.
    pub never_still: bool,
}

/// Samples without a rest after which the guide asks for one, as quarters of a second.
const WITHOUT_REST: u32 = 20;

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// What to do next, and how far it is.
    pub fn guide(&self) -> Guide {
        let rests = self.observer.rests();
        let of = |sensor: Sensor| self.estimate(sensor);
        let count = |number: usize| u16::try_from(number).unwrap_or(u16::MAX);
        let turns = self.poses.list().iter().filter(|pose| pose.has_turn()).count();
        Guide {
            advice: self.advice(),
            thrown: Thrown {
                turns: self.observer.broken(),
                forgotten: self.poses.forgotten(),
                ..self.thrown
            },
            rests: count(self.poses.list().len()),
            turns: count(turns),
            points: count(self.cloud.slots().len()),
            coverage: of(Sensor::Accelerometer).map_or(0.0, |acc| acc.summary.coverage.share),
            error: Sensor::ALL.map(|sensor| of(sensor).map(|estimate| estimate.error)),
            accepted: Sensor::ALL.map(|sensor| of(sensor).is_some_and(|estimate| estimate.verdict.is_ok())),
            never_still: self.poses.list().is_empty()
                && rests.stage() == Stage::Moving
                && rests.quarters() > WITHOUT_REST,
        }
    }

    /// Whether a sensor has reached its target.
    pub(super) fn is_done(&self, sensor: Sensor, estimate: &Estimate) -> bool {
        let target = self.settings.target.get(sensor as usize).copied().unwrap_or(0.0);
        estimate.verdict.is_ok() && estimate.error <= target
    }

    fn is_reached(&self, sensor: Sensor) -> bool {
        let asked = self.settings.target.get(sensor as usize).is_some_and(|target| *target > 0.0);
        !asked || self.estimate(sensor).is_some_and(|estimate| self.is_done(sensor, estimate))
    }

    fn advice(&self) -> Advice {
        if Sensor::ALL.into_iter().all(|sensor| self.is_reached(sensor)) {
            return Advice::Enough;
        }
        if Sensor::ALL.into_iter().any(|sensor| self.not_mirrored(sensor).is_err()) {
            return Advice::CorrectAxes;
        }
        let rests = self.observer.rests();
        match rests.stage() {
            Stage::Moving if self.poses.list().is_empty() => return Advice::HoldStill,
            Stage::Still => return Advice::HoldOn,
            Stage::Resting if rests.lasted() < self.settings.hold => return Advice::HoldOn,
            _ => {}
        }
        if self.is_reached(Sensor::Accelerometer) && self.is_reached(Sensor::Gyroscope) {
            return Advice::TurnAbout(self.field_missing().into());
        }
        let now = rests.direction();
        let seen = self.poses.list().iter().map(|pose| pose.direction());
        let [acc, gyr] = &self.scores;
        Advice::Turn(acc.larger(gyr).best(now.map(|mean| unit(&mean)), seen).into())
    }

    /// Direction of the field that is furthest from all seen, magnetometer's axes.
    fn field_missing(&self) -> Vector3<f32> {
        let centre = self.estimate(Sensor::Magnetometer).map_or_else(Vector3::zeros, |mag| mag.triad.bias);
        let directions = self.cloud.slots().iter().map(move |slot| unit(&(slot.mean - centre)));
        coverage::missing(directions).0
    }
}
