//! The attitudes and positions of a reference, row by row, as the movement takes them.

use nalgebra::Matrix3;

use crate::{observe::motion, recording::Recording};

/// A reference's attitudes and positions in a level frame with its third axis down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Attitudes, table to the frame; `None` where there is none.
    pub attitudes: motion::Attitudes,
    /// Positions, m, NaN where there is none; `None` without any.
    pub positions: Option<Vec<[f64; 3]>>,
}

impl Pose {
    /// As recorded; `None` without a reference attitude.
    pub fn of(recording: &Recording) -> Option<Self> {
        let attitudes = motion::of_reference(recording.reference.as_deref()?);
        Some(Self { attitudes, positions: recording.position.clone() })
    }

    /// In another frame, into which `turn` takes components of this one.
    #[must_use]
    pub fn turned(self, turn: &Matrix3<f64>) -> Self {
        let position = |p: [f64; 3]| <[f64; 3]>::from(turn * nalgebra::Vector3::from(p));
        Self {
            attitudes: self.attitudes.into_iter().map(|c| Some(turn * c?)).collect(),
            positions: self.positions.map(|rows| rows.into_iter().map(position).collect()),
        }
    }

    /// As a sensor shows it whose row of t is that of t + `offset`, s.
    #[must_use]
    pub fn moved(&self, time: &[f64], offset: f64) -> Self {
        if offset == 0.0 {
            return self.clone();
        }
        Self {
            attitudes: motion::later(time, &self.attitudes, -offset),
            positions: self.positions.as_ref().map(|positions| moved(time, positions, offset)),
        }
    }
}

/// Positions of `offset` later, s, on the straight line between two rows; NaN where either of them is missing.
fn moved(time: &[f64], positions: &[[f64; 3]], offset: f64) -> Vec<[f64; 3]> {
    let at = |now: &f64| {
        let then = now + offset;
        let next = time.partition_point(|t| *t <= then);
        let pair = next
            .checked_sub(1)
            .and_then(|before| Some((before, positions.get(before)?, positions.get(next)?)));
        let Some((before, from, to)) = pair else { return [f64::NAN; 3] };
        let share = (then - time[before]) / (time[next] - time[before]);
        [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share)
    };
    time.iter().map(at).collect()
}
