//! Stretches in which a robot moves otherwise than its simulator says, as a whole: its sensors stay right about it.
//!
//! Each departure grows and fades smoothly within its stretch; outside of it not a bit changes.

use super::{deviation::Deviation, jet::Jet, trajectory::Trajectory};
use crate::simulator::random::Random;

/// Lengths of a stretch, s, and least time between two.
const LENGTH: (f64, f64) = (2.5, 8.0);
const APART: f64 = 2.0;
/// Most stretches.
const MOST: usize = 4;
/// It grows and fades over this share of a stretch each.
const EDGE: f64 = 0.3;
/// A robot that works less stands.
const WORKING: f64 = 0.2;
/// Draws of a stretch before there is taken to be no room.
const TRIES: usize = 200;

/// In what a robot departs from its simulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MismatchKind {
    /// It slips, or is pushed: position and attitude are elsewhere for a while.
    Slip,
    /// Its gait, its ground or its gusts have another phase and size.
    Gait,
    /// Feet or wheels strike nothing where the simulator has a contact, or harder.
    Contact,
}

impl MismatchKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Slip, Self::Gait, Self::Contact];

    /// Its name in labels.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slip => "slip",
            Self::Gait => "gait",
            Self::Contact => "contact",
        }
    }

    /// The kind of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// One stretch, and the whole departure in its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Beginning and end, s of the simulator's clock.
    pub span: (f64, f64),
    /// North, east, down, m.
    pub shift: [f64; 3],
    /// Yaw, pitch, roll, rad.
    pub turn: [f64; 3],
    /// Of the gait, beyond one.
    pub amplitude: f64,
    /// Of the gait, rad.
    pub phase: f64,
    /// Of contacts, beyond one.
    pub contact: f64,
}

/// All stretches, in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mismatch {
    /// They do not overlap.
    pub stretches: Vec<Stretch>,
}

impl Mismatch {
    /// Draws one to four stretches in which the robot works; `size` multiplies how far it departs. None where there is no
    /// time for any. Contacts of a flying robot, which has none, are drawn as slips.
    pub fn draw(kind: MismatchKind, size: f64, trajectory: &Trajectory, random: &mut Random) -> Self {
        let wanted = 1 + random.below(MOST);
        let mut stretches: Vec<Stretch> = Vec::new();
        let mut tries = 0;
        while stretches.len() < wanted && tries < TRIES {
            tries += 1;
            let length = random.between(LENGTH.0, LENGTH.1);
            let from = random.between(0.0, (trajectory.duration() - length).max(0.0));
            let span = (from, from + length);
            let free =
                stretches.iter().all(|other| span.1 + APART < other.span.0 || other.span.1 + APART < span.0);
            let works = (0..=10).all(|k| trajectory.effort(from + 0.1 * f64::from(k) * length) > WORKING);
            if free && works {
                stretches.push(Stretch::draw(kind, size, span, trajectory, random));
            }
        }
        stretches.sort_by(|a, b| a.span.0.total_cmp(&b.span.0));
        Self { stretches }
    }

    /// The departure at a time, s of the simulator's clock.
    pub fn at(&self, time: f64) -> Deviation {
        let inside = |stretch: &&Stretch| stretch.span.0 < time && time < stretch.span.1;
        self.stretches.iter().find(inside).map_or(Deviation::NONE, |stretch| stretch.at(time))
    }
}

impl Stretch {
    fn draw(
        kind: MismatchKind,
        size: f64,
        span: (f64, f64),
        trajectory: &Trajectory,
        random: &mut Random,
    ) -> Self {
        let mut of = |low: f64, high: f64| {
            let sign = if random.share() < 0.5 { -1.0 } else { 1.0 };
            sign * size * random.between(low, high)
        };
        let none = Self { span, shift: [0.0; 3], turn: [0.0; 3], amplitude: 0.0, phase: 0.0, contact: 0.0 };
        let degree = 1f64.to_radians();
        match (kind, trajectory) {
            (MismatchKind::Gait, _) => {
                let amplitude = of(0.3, 0.8);
                Self { amplitude, phase: of(0.5, 2.0), ..none }
            }
            (MismatchKind::Contact, Trajectory::Legged(_) | Trajectory::Wheeled(_)) => {
                Self { contact: if of(1.0, 1.0) < 0.0 { -1.0 } else { size }, ..none }
            }
            (MismatchKind::Slip | MismatchKind::Contact, _) => Self {
                shift: [of(0.05, 0.3), of(0.05, 0.3), of(0.005, 0.03)],
                turn: [
                    of(3.0 * degree, 10.0 * degree),
                    of(0.5 * degree, 3.0 * degree),
                    of(0.5 * degree, 3.0 * degree),
                ],
                ..none
            },
        }
    }

    fn at(&self, time: f64) -> Deviation {
        let edge = EDGE * (self.span.1 - self.span.0);
        let rise = Jet { value: (time - self.span.0) / edge, first: 1.0 / edge, second: 0.0 };
        let fall = Jet { value: (self.span.1 - time) / edge, first: -1.0 / edge, second: 0.0 };
        let share = rise.step() * fall.step();
        Deviation {
            amplitude: share * self.amplitude + 1.0,
            phase: share * self.phase,
            contact: share * self.contact + 1.0,
            shift: self.shift.map(|shift| share * shift),
            turn: self.turn.map(|turn| share * turn),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{random::Purpose, robot::RobotKind};

    #[test]
    fn a_robot_departs_while_it_works_and_comes_back() {
        for kind in RobotKind::ALL {
            let trajectory = Trajectory::draw(kind, 200.0, &mut Random::new(1, Purpose::Route));
            for what in MismatchKind::ALL {
                let mismatch =
                    Mismatch::draw(what, 1.0, &trajectory, &mut Random::new(2, Purpose::Deviation));
                assert!(!mismatch.stretches.is_empty(), "{kind:?}");
                for stretch in &mismatch.stretches {
                    let (from, to) = stretch.span;
                    assert_eq!(mismatch.at(from), Deviation::NONE);
                    assert_eq!(mismatch.at(to), Deviation::NONE);
                    let middle = mismatch.at(0.5 * (from + to));
                    assert_ne!(middle, Deviation::NONE);
                    assert!(trajectory.effort(0.5 * (from + to)) > 0.1);
                    let near = mismatch.at(from + 1e-6);
                    assert!(near.shift.iter().all(|shift| shift.second.abs() < 1e-3), "{near:?}");
                }
            }
        }
    }
}
