//! Position and attitude of a robot's body as functions of time, with exact first and second derivatives.
//!
//! ```text
//! C_t_n = R_z(yaw) R_y(pitch) R_x(roll)        n: north, east, down;  t: forward, right, down
//! f_t = C_n_t (a_n − g_n)
//! ```

use nalgebra::Vector3;

use super::{deviation::Deviation, flying::Flight, jet::Jet, legged::Walk, route::Plan, wheeled::Drive};
use crate::{
    effect::Machine,
    recording::manifest::Axis,
    simulator::{
        gimbal::{Pose, direction, pose},
        random::Random,
    },
};

/// Kinds of robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RobotKind {
    /// Walks on legs.
    #[default]
    Legged,
    /// Drives on wheels.
    Wheeled,
    /// Flies with rotors.
    Flying,
}

impl RobotKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Legged, Self::Wheeled, Self::Flying];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Legged => "legged",
            Self::Wheeled => "wheeled",
            Self::Flying => "flying",
        }
    }

    /// The kind of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// The body at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// North, east, down, m.
    pub position: [Jet; 3],
    /// Yaw, pitch, roll, rad.
    pub attitude: [Jet; 3],
}

impl Body {
    /// Position in n, m.
    pub fn position(&self) -> Vector3<f64> {
        Vector3::from(self.position.map(|jet| jet.value))
    }

    /// Acceleration in n, m/s².
    pub fn acceleration(&self) -> Vector3<f64> {
        Vector3::from(self.position.map(|jet| jet.second))
    }

    /// Attitude, rate and angular acceleration against the base.
    pub fn pose(&self) -> Pose {
        let gimbals = self.attitude.map(Jet::swing);
        pose(&Machine { gimbals, ..Machine::exact([Axis::Z, Axis::Y, Axis::X].map(direction)) })
    }
}

/// What a robot of a kind does, from a seed.
#[derive(Clone, Debug)]
pub enum Trajectory {
    /// Of a legged one.
    Legged(Walk),
    /// Of a wheeled one.
    Wheeled(Drive),
    /// Of a flying one.
    Flying(Flight),
}

impl Trajectory {
    /// Draws one of this length, s, which begins and ends at rest.
    pub fn draw(kind: RobotKind, duration: f64, random: &mut Random) -> Self {
        match kind {
            RobotKind::Legged => Self::Legged(Walk::draw(duration, random)),
            RobotKind::Wheeled => Self::Wheeled(Drive::draw(duration, random)),
            RobotKind::Flying => Self::Flying(Flight::draw(duration, random)),
        }
    }

    /// Its length, s.
    pub fn duration(&self) -> f64 {
        match self {
            Self::Legged(walk) => walk.route.duration(),
            Self::Wheeled(drive) => drive.route.duration(),
            Self::Flying(flight) => flight.route.duration(),
        }
    }

    /// The body at a time, s, of a robot that deviates from the plan.
    pub fn body(&self, time: f64, deviation: &Deviation) -> Body {
        let time = time.clamp(0.0, self.duration());
        match self {
            Self::Legged(walk) => walk.body(time, deviation),
            Self::Wheeled(drive) => drive.body(time, deviation),
            Self::Flying(flight) => flight.body(time, deviation),
        }
    }

    /// How hard legs, wheels or rotors work at a time, s: 0 at rest, about 1 at their most.
    pub fn effort(&self, time: f64) -> f64 {
        let time = time.clamp(0.0, self.duration());
        match self {
            Self::Legged(walk) => walk.effort(time),
            Self::Wheeled(drive) => drive.effort(time),
            Self::Flying(flight) => flight.effort(time),
        }
    }
}

/// A sine of time, or of a way or a phase, that is part of a gait.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wave {
    /// In the unit of what sways.
    pub amplitude: f64,
    /// Phases a unit of what it is a function of, rad.
    pub number: f64,
    /// At zero, rad.
    pub phase: f64,
}

impl Wave {
    pub fn draw(amplitude: f64, number: f64, random: &mut Random) -> Self {
        Self { amplitude, number, phase: random.between(0.0, std::f64::consts::TAU) }
    }

    pub fn at(&self, of: Jet, deviation: &Deviation) -> Jet {
        (of * self.number + self.phase + deviation.phase).sin() * self.amplitude
    }

    pub fn sum(waves: &[Self], of: Jet, deviation: &Deviation) -> Jet {
        waves.iter().fold(Jet::default(), |sum, wave| sum + wave.at(of, deviation))
    }
}

/// The last rest fills what is left of a recording, s: at least this.
pub(super) const LAST_REST: f64 = 3.0;

/// Repeats what is done between rests as long as there is time; ends at rest. `episode` is given how much time it may use,
/// s, and says whether it has used some.
pub(super) fn fill(
    plan: &mut Plan,
    duration: f64,
    random: &mut Random,
    mut episode: impl FnMut(&mut Plan, f64, &mut Random) -> bool,
) {
    plan.hold(random.between(3.0, 8.0).min(0.2 * duration));
    loop {
        let left = duration - plan.time() - LAST_REST;
        if !episode(plan, left, random) {
            break;
        }
        let left = duration - plan.time() - LAST_REST;
        if left > 0.0 {
            plan.hold(random.between(1.5, 6.0).min(left));
        }
    }
    plan.hold(duration - plan.time());
}

#[cfg(test)]
mod tests {
    use imucal_core::rotation;

    use super::*;
    use crate::simulator::random::Purpose;

    fn all() -> impl Iterator<Item = (RobotKind, Trajectory)> {
        RobotKind::ALL
            .into_iter()
            .map(|kind| (kind, Trajectory::draw(kind, 80.0, &mut Random::new(5, Purpose::Route))))
    }

    #[test]
    fn acceleration_and_rate_are_the_derivatives_of_position_and_attitude() {
        let (h, still) = (4e-6, Deviation::NONE);
        for (kind, trajectory) in all() {
            let body = |t| trajectory.body(t, &still);
            for k in 1..4000 {
                let t = 0.02 * f64::from(k) - 1e-3;
                let (before, here, after) = (body(t - h), body(t), body(t + h));
                let velocity = |body: &Body| Vector3::from(body.position.map(|jet| jet.first));
                let moved = (after.position() - before.position()) / (2.0 * h);
                assert!((moved - velocity(&here)).norm() < 1e-5, "{kind:?} {t}");
                let faster = (velocity(&after) - velocity(&before)) / (2.0 * h);
                // Of an impact of milliseconds the third derivative is large.
                let tolerance = 2e-4 * (1.0 + here.acceleration().norm());
                assert!((faster - here.acceleration()).norm() < tolerance, "{kind:?} {t}");
                let pose = |body: &Body| body.pose();
                let (before, here, after) = (pose(&before), pose(&here), pose(&after));
                let turned = here.c_t_p.tr_mul(&((after.c_t_p - before.c_t_p) / (2.0 * h)));
                assert!((turned - rotation::cross_matrix(&here.w_pt_t)).norm() < 1e-6, "{kind:?} {t}");
                let faster = (after.w_pt_t - before.w_pt_t) / (2.0 * h);
                assert!((faster - here.dw_pt_t).norm() < 1e-4, "{kind:?} {t}");
            }
        }
    }

    #[test]
    fn it_is_at_rest_in_between_and_moves_about_all_three_axes() {
        for (kind, trajectory) in all() {
            assert!((trajectory.duration() - 80.0).abs() < 1e-9);
            let (mut square, mut rests) = (Vector3::zeros(), 0);
            for k in 0..8000 {
                let t = 0.01 * f64::from(k);
                let w = trajectory.body(t, &Deviation::NONE).pose().w_pt_t;
                let working = trajectory.effort(t);
                assert!((0.0..1.7).contains(&working), "{kind:?} {t} {working}");
                if w == Vector3::zeros() {
                    assert_eq!(working, 0.0, "{kind:?} {t}");
                    rests += 1;
                }
                square += w.component_mul(&w) / 8000.0;
            }
            assert!((600..6000).contains(&rests), "{kind:?} {rests}");
            let rms = square.map(f64::sqrt);
            assert!(rms.min() > 0.01 && rms.max() < 3.0, "{kind:?} {rms}");
        }
    }

    #[test]
    fn accelerations_are_those_of_robots() {
        for (kind, trajectory) in all() {
            let size = |k: i32| trajectory.body(1e-3 * f64::from(k), &Deviation::NONE).acceleration().norm();
            let most = (0..80_000).map(size).fold(0.0, f64::max);
            assert!((0.5..60.0).contains(&most), "{kind:?} {most}");
        }
    }
}
