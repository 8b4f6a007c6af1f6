//! A robot's trajectory as a source of truth.

use super::{mismatch::Mismatch, trajectory::Trajectory};
use crate::{
    effect::{Machine, Swing, Truth},
    recording::manifest::{Axis, Rig, RigKind},
    simulator::{
        Place,
        climate::Climate,
        gimbal::direction,
        recent::Recent,
        truth::{Motion, at_pose},
    },
};

/// A robot that moves somewhere on Earth.
#[derive(Clone, Debug)]
pub struct RobotMotion {
    /// Where its body is.
    pub trajectory: Trajectory,
    /// How warm its sensor is.
    pub climate: Climate,
    /// Where.
    pub place: Place,
    /// Where it departs from the plan.
    pub mismatch: Mismatch,
}

impl Motion for RobotMotion {
    fn duration(&self) -> f64 {
        self.trajectory.duration()
    }

    /// Of the rig, heading and levelling tilt of the ground act.
    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let mut ground = Machine::exact([Axis::Z, Axis::Y, Axis::X].map(direction));
        rig(&mut ground);
        let body = self.trajectory.body(time, &self.mismatch.at(time));
        let (pose, c_p_n) = (body.pose(), recent.base(&ground));
        let temperature = self.climate.temperature(time);
        let truth = at_pose(time, &pose, c_p_n, [Swing::default(); 3], &self.place, temperature, recent);
        Truth { f_t: truth.f_t + pose.c_t_p.tr_mul(&body.acceleration()), ..truth }
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::Hand, axes: None }
    }

    fn place(&self) -> Place {
        self.place
    }
}
