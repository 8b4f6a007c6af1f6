//! A recorded pose: attitude and position of a reference, as a source of truth with linear acceleration.
//!
//! ```text
//! f_t = C_n_t (a_n − g_n)      a_n = (S p)″      ẇ = 2 Im(q̄ (S q)″)      f'_t = C_n_t S (C_t_n f_t)
//! ```
//!
//! S is the smoother of [`position_smoother`](super::position_smoother), of one bandwidth for position, attitude and the samples f
//! that are compared with them: what it cuts off a brisk movement is cut off all three. Were it cut off the position alone, the
//! accelerometer would feel what is missing there, and an arm, which goes with the turns of the same hand, would be
//! found for it; were ẇ cut off more than the samples, every arm would be found too long.
//!
//! The reference point is where the position is measured; an accelerometer elsewhere has an arm (`acc.lever_arm`). Not modelled:
//! what [`Tracked`] does not, a position whose clock is not that of the attitude, and a mount that the accelerometer's triad does
//! not hold: S acts in axes that are turned by it.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::{
    place::Place,
    position_smoother::{Readings, Smoothed},
    recent::{Recent, nearest},
    tracked::Tracked,
    truth::{Motion, Recorded},
};
use crate::{
    effect::{Machine, Truth},
    recording::{manifest::Rig, median},
};

/// It moves above this speed, m/s.
const SPEED: f64 = 0.03;
/// Fewer positions than this are none.
const FEWEST: usize = 10;
/// Positions further apart than so many of their usual intervals have a gap between them.
const GAP: f64 = 1.5;
/// Rows so close to one without a position are not known, s.
const NEAR: f64 = 0.1;

/// The movement that a pose has followed.
#[derive(Clone, Debug)]
pub struct Posed {
    tracked: Tracked,
    time: Vec<f64>,
    positions: Vec<Vector3<f64>>,
    accelerations: Vec<Vector3<f64>>,
    angular_accelerations: Vec<Vector3<f64>>,
    bandwidth: f64,
    errors: Vec<f64>,
    speeds: Vec<f64>,
    moving: Vec<bool>,
    known: Vec<bool>,
}

impl Posed {
    /// A tracked movement by its attitudes, with positions in their frame, m, one a row, NaN where there is none; what is
    /// faster than `bandwidth`, rad/s, is taken for noise. `None` where hardly a row has one.
    pub fn new(
        tracked: Tracked,
        time: &[f64],
        attitudes: &[Option<Matrix3<f64>>],
        positions: &[[f64; 3]],
        bandwidth: f64,
    ) -> Option<Self> {
        let is_given = |row: &[f64; 3]| row.iter().all(|value| value.is_finite());
        let given: Vec<f64> =
            time.iter().zip(positions).filter(|(_, row)| is_given(row)).map(|(time, _)| *time).collect();
        let interval = median(given.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
        if given.len() < FEWEST {
            return None;
        }
        let axes: Vec<Vec<Smoothed>> = [0, 1, 2]
            .into_par_iter()
            .map(|axis| {
                let position: Vec<f64> = positions.iter().map(|row| row[axis]).collect();
                Readings { time, position: &position, interval, bandwidth }.smoothed()
            })
            .collect();
        let of = |row: usize, order: usize| Vector3::from_fn(|axis, _| axes[axis][row].state[order]);
        let is_moved = |row: usize| of(row, 1).norm() > SPEED;
        let is_gap = |pair: &&[f64]| pair[1] - pair[0] > GAP * interval;
        let within = given.windows(2).filter(is_gap).map(|pair| (pair[0], pair[1]));
        // Before the first and after the last position there is none.
        let mut gaps = vec![(f64::NEG_INFINITY, given[0] - GAP * interval)];
        gaps.extend(within);
        gaps.push((given[given.len() - 1] + GAP * interval, f64::INFINITY));
        let is_near = |time: f64| {
            let next = gaps.partition_point(|gap| gap.1 < time - NEAR);
            gaps.get(next).is_some_and(|gap| gap.0 <= time + NEAR)
        };
        let middle = (0..time.len()).map(|row| of(row, 0)).sum::<Vector3<f64>>() / time.len() as f64;
        let error = |row: usize| axes.iter().map(|axis| axis[row].error.powi(2)).sum::<f64>().sqrt();
        Some(Self {
            time: time.to_vec(),
            positions: (0..time.len()).map(|row| of(row, 0) - middle).collect(),
            accelerations: (0..time.len()).map(|row| of(row, 2)).collect(),
            angular_accelerations: angular_accelerations(time, attitudes, bandwidth)?,
            bandwidth,
            errors: (0..time.len()).map(error).collect(),
            speeds: (0..time.len()).map(|row| of(row, 1).norm()).collect(),
            moving: (0..time.len()).map(|row| tracked.moving()[row] || is_moved(row)).collect(),
            known: (0..time.len()).map(|row| tracked.known()[row] && !is_near(time[row])).collect(),
            tracked,
        })
    }

    /// What is known row by row, at a time, on the straight line between two rows.
    fn between(&self, rows: &[Vector3<f64>], time: f64) -> Vector3<f64> {
        let row = nearest(&self.time, time);
        let other = if time > self.time[row] { row + 1 } else { row.saturating_sub(1) };
        let (Some(there), true) = (self.time.get(other), other != row) else { return rows[row] };
        let share = ((time - self.time[row]) / (there - self.time[row])).clamp(0.0, 1.0);
        rows[row] + (rows[other] - rows[row]) * share
    }
}

/// Angular acceleration at each row, table axes, rad/s², from attitudes that are smoothed as positions are.
fn angular_accelerations(
    time: &[f64],
    attitudes: &[Option<Matrix3<f64>>],
    bandwidth: f64,
) -> Option<Vec<Vector3<f64>>> {
    let mut last = Quaternion::identity();
    let quaternions: Vec<Option<Quaternion<f64>>> = attitudes
        .iter()
        .map(|c| {
            let rotation = Rotation3::from_matrix_unchecked((*c)?);
            let q = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
            last = if q.dot(&last) < 0.0 { -q } else { q };
            Some(last)
        })
        .collect();
    let given: Vec<f64> =
        time.iter().zip(&quaternions).filter(|(_, q)| q.is_some()).map(|(time, _)| *time).collect();
    let interval = median(given.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    let parts: Vec<Vec<Smoothed>> = (0..4)
        .into_par_iter()
        .map(|part| {
            let position: Vec<f64> = quaternions.iter().map(|q| q.map_or(f64::NAN, |q| q[part])).collect();
            Readings { time, position: &position, interval, bandwidth }.smoothed()
        })
        .collect();
    let of = |row: usize, order: usize| {
        let part = |part: usize| parts[part][row].state[order];
        // Stored with the scalar last.
        Quaternion::new(part(3), part(0), part(1), part(2))
    };
    Some((0..time.len()).map(|row| (of(row, 0).conjugate() * of(row, 2)).vector() * 2.0).collect())
}

impl Motion for Posed {
    fn duration(&self) -> f64 {
        self.tracked.duration()
    }

    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let mut truth = self.tracked.truth_among(time, rig, recent);
        let row = recent.nearest(&self.time, time);
        truth.p_p = self.positions[row];
        let acceleration = self.between(&self.accelerations, time);
        truth.f_t += (truth.c_p_n * truth.c_t_p).tr_mul(&(truth.c_p_n * acceleration));
        if self.tracked.moving()[row] {
            let turning = self.between(&self.angular_accelerations, time);
            truth.dw_it_t = turning - truth.w_pt_t.cross(&truth.w_ie_t);
        }
        truth
    }

    fn rig(&self) -> Rig {
        self.tracked.rig()
    }

    fn place(&self) -> Place {
        self.tracked.place()
    }
}

impl Recorded for Posed {
    fn moving(&self) -> &[bool] {
        &self.moving
    }

    fn known(&self) -> &[bool] {
        &self.known
    }

    fn speeds(&self) -> Option<&[f64]> {
        Some(&self.speeds)
    }

    fn force_errors(&self) -> Option<&[f64]> {
        Some(&self.errors)
    }

    fn as_sharp(
        &self,
        samples: &[Vector3<f64>],
        usable: &[bool],
        triad: &Triad<f64>,
    ) -> Option<Vec<Vector3<f64>>> {
        let sensitivity = triad.sensitivity()?;
        let interval = median(self.time.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
        let attitude = |row: usize| self.tracked.attitude(row);
        let felt = |row: usize| {
            let used = usable.get(row).is_some_and(|usable| *usable);
            used.then(|| samples.get(row).map(|sample| attitude(row) * triad.correct(sample))).flatten()
        };
        let felt: Vec<Option<Vector3<f64>>> = (0..self.time.len()).map(felt).collect();
        let axes: Vec<Vec<Smoothed>> = [0, 1, 2]
            .into_par_iter()
            .map(|axis| {
                let position: Vec<f64> = felt.iter().map(|f| f.map_or(f64::NAN, |f| f[axis])).collect();
                Readings { time: &self.time, position: &position, interval, bandwidth: self.bandwidth }
                    .smoothed()
            })
            .collect();
        let of = |row: usize| Vector3::from_fn(|axis, _| axes[axis][row].state.x);
        let sample = |row: usize| sensitivity * attitude(row).tr_mul(&of(row)) + triad.bias;
        Some((0..self.time.len()).map(sample).collect())
    }

    fn steady(&self) -> &dyn Motion {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{
        Tumble,
        random::{Purpose, Random},
    };

    #[test]
    fn a_hand_that_moves_to_and_fro_is_felt_with_gravity() {
        let tumble = Tumble::new(5, 3);
        let time: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        let way = |t: f64| if t > 5.0 { 0.1 * (3.0 * (t - 5.0)).sin().powi(3) } else { 0.0 };
        let felt = |t: f64| {
            let (s, c) = (3.0 * (t - 5.0)).sin_cos();
            if t > 5.0 { 0.1 * 9.0 * (6.0 * s * c * c - 3.0 * s * s * s) } else { 0.0 }
        };
        let mut random = Random::new(5, Purpose::Noise);
        let positions: Vec<[f64; 3]> =
            time.iter().map(|t| [way(*t), 0.0, 1.0].map(|p| p + 2e-4 * random.normal())).collect();
        let attitude = |t: &f64| {
            let truth = tumble.truth(*t, &|_| ());
            Some(truth.c_p_n * truth.c_t_p)
        };
        let attitudes: Vec<_> = time.iter().map(attitude).collect();
        let tracked = Tracked::new(&time, &attitudes, vec![25.0; 3000], tumble.place()).unwrap();
        let posed = Posed::new(tracked, &time, &attitudes, &positions, 60.0).unwrap();
        let mut left = 0.0;
        for k in 0..1000 {
            let t = 8.0 + 0.0203 * f64::from(k);
            let (here, there) = (posed.truth(t, &|_| ()), tumble.truth(t, &|_| ()));
            let force = there.f_t + (there.c_p_n * there.c_t_p).tr_mul(&Vector3::new(felt(t), 0.0, 0.0));
            left += (here.f_t - force).norm_squared() / 1000.0;
        }
        assert!(left.sqrt() < 0.25, "{}", left.sqrt());
        assert!(posed.moving()[900] && !posed.moving()[300]);
        assert!(
            Posed::new(posed.tracked.clone(), &time, &attitudes, &vec![[f64::NAN; 3]; 3000], 60.0).is_none()
        );
    }
}
