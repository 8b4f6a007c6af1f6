//! A recorded attitude: what an optical reference said, as a source of truth.
//!
//! About each row the turn from its attitude is a cubic in time, by least squares over rows some hundredths of
//! a second away:
//!
//! ```text
//! Log(C_kᵀ C_j) ≈ c₀ + c₁ τ + c₂ τ² + c₃ τ³      C = C_k Exp(c₀),  w = c₁,  ẇ = 2 c₂      τ = t_j − t_k
//! ```
//!
//! which is exact to first order in c₀, a reading's noise. Rows without an attitude turn evenly from the one before to the
//! one after and are not known. The reference's frame is a base p that may be tilted against the vertical and turned
//! from north, like a rig's. Not modelled: a reference that lags, that slips on the sensor, or that travels.

use imucal_core::rotation::{exp, log};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use rayon::prelude::*;

use super::{
    gimbal::{Pose, direction},
    place::Place,
    recent::Recent,
    truth::{Motion, Recorded, at_pose},
};
use crate::{
    effect::{Machine, Swing, Truth},
    recording::{
        manifest::{Axis, Rig, RigKind},
        median,
    },
};

/// Attitudes within this time of a row give its rate, s: short against a hand's swings.
const REACH: f64 = 0.045;
/// Where it hardly moves, so many times as long.
const SLOW: usize = 6;
/// At least this many rows to each side.
const FEWEST: usize = 2;
/// It moves if its attitude changes over twice this time, s,
const WINDOW: f64 = 0.1;
/// by more than this rate would make it, rad/s: an optical reference trembles where an encoder does not,
const CREEP: f64 = 0.02;
/// and by more than this many standard deviations of an attitude's noise.
const NOISES: f64 = 8.0;
/// It has not come to rest before, nor is it at rest still, so long about a movement, s: a hand trembles.
const TREMBLING: f64 = 0.25;

/// Attitude, rate and angular acceleration of the table at a row, against the base.
#[derive(Clone, Copy, Debug)]
struct State {
    c_t_p: Matrix3<f64>,
    w_pt_t: Vector3<f64>,
    dw_pt_t: Vector3<f64>,
}

/// The movement that a reference has followed.
#[derive(Clone, Debug)]
pub struct Tracked {
    time: Vec<f64>,
    states: Vec<State>,
    moving: Vec<bool>,
    known: Vec<bool>,
    temperature: Vec<f64>,
    place: Place,
}

impl Tracked {
    /// The movement that attitudes table → base give, one a row, `None` where there is none. `temperature` in °C, one a
    /// row. Times strictly increase. `None` where no row has an attitude.
    pub fn new(
        time: &[f64],
        attitudes: &[Option<Matrix3<f64>>],
        temperature: Vec<f64>,
        place: Place,
    ) -> Option<Self> {
        let filled = filled(time, attitudes)?;
        let interval = (time.last()? - time.first()?) / (time.len().max(2) - 1) as f64;
        let reach = ((REACH / interval).floor() as usize).max(FEWEST);
        let moving = moving(time, &filled);
        let states = (0..time.len())
            .into_par_iter()
            .map(|row| {
                let near = state(time, &filled, row, reach);
                if moving[row] {
                    return near;
                }
                // A reference drifts by more than its noise: a slow turn is estimated over a longer time.
                let slow = state(time, &filled, row, SLOW * reach);
                State { w_pt_t: slow.w_pt_t, dw_pt_t: Vector3::zeros(), ..near }
            })
            .collect();
        let known = (0..time.len())
            .map(|row| {
                let about = row.saturating_sub(reach)..(row + reach + 1).min(time.len());
                attitudes[about].iter().all(Option::is_some)
            })
            .collect();
        Some(Self { time: time.to_vec(), states, moving, known, temperature, place })
    }

    /// Attitude at a row, table to base.
    pub(super) fn attitude(&self, row: usize) -> Matrix3<f64> {
        self.states[row].c_t_p
    }
}

impl Motion for Tracked {
    fn duration(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Of the rig, heading and levelling tilt act; there are no gimbals.
    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let row = recent.nearest(&self.time, time);
        let since = time - self.time.get(row).copied().unwrap_or(time);
        let still = State { c_t_p: Matrix3::identity(), w_pt_t: Vector3::zeros(), dw_pt_t: Vector3::zeros() };
        let State { c_t_p, w_pt_t, dw_pt_t } = self.states.get(row).copied().unwrap_or(still);
        let mut machine = Machine::exact([Axis::Z, Axis::Y, Axis::X].map(direction));
        rig(&mut machine);
        let c_p_n = recent.base(&machine);
        let c_t_p = c_t_p * exp(&((w_pt_t + dw_pt_t * (0.5 * since)) * since));
        let pose = Pose { c_t_p, c_t_o: c_t_p, c_t_m: c_t_p, w_pt_t: w_pt_t + dw_pt_t * since, dw_pt_t };
        let temperature = self.temperature.get(row).copied().unwrap_or_default();
        at_pose(time, &pose, c_p_n, [Swing::default(); 3], &self.place, temperature, recent)
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::Optical, axes: None }
    }

    fn place(&self) -> Place {
        self.place
    }
}

impl Recorded for Tracked {
    fn moving(&self) -> &[bool] {
        &self.moving
    }

    fn known(&self) -> &[bool] {
        &self.known
    }

    fn steady(&self) -> &dyn Motion {
        self
    }
}

/// Attitudes with the missing ones filled in.
fn filled(time: &[f64], attitudes: &[Option<Matrix3<f64>>]) -> Option<Vec<Matrix3<f64>>> {
    let known: Vec<(usize, Matrix3<f64>)> =
        attitudes.iter().enumerate().filter_map(|(row, c)| Some((row, (*c)?))).collect();
    let (first, last) = (*known.first()?, *known.last()?);
    let mut filled = vec![first.1; time.len()];
    filled[last.0..].fill(last.1);
    for pair in known.windows(2) {
        let [(from, start), (to, end)] = *pair else { continue };
        let turn = log(&start.tr_mul(&end));
        filled[from] = start;
        for row in from + 1..to {
            let share = (time[row] - time[from]) / (time[to] - time[from]);
            filled[row] = start * exp(&(turn * share));
        }
    }
    Some(filled)
}

/// Rows at which it moves.
fn moving(time: &[f64], attitudes: &[Matrix3<f64>]) -> Vec<bool> {
    let turn = |from: usize, to: usize| log(&attitudes[from].tr_mul(&attitudes[to]));
    let bends = (1..time.len().saturating_sub(1)).map(|k| (turn(k, k + 1) - turn(k - 1, k)).norm()).collect();
    // The median length of three normal numbers is 1.54; a bend has the deviation of an attitude, times √6.
    let noise = median(bends).unwrap_or(0.0) / (1.54 * libm::sqrt(6.0));
    let (mut before, mut after) = (0, 0);
    let turns: Vec<bool> = (0..time.len())
        .map(|row| {
            while time[before] < time[row] - WINDOW {
                before += 1;
            }
            while after + 1 < time.len() && time[after] < time[row] + WINDOW {
                after += 1;
            }
            turn(before, after).norm() > CREEP * (time[after] - time[before]) + NOISES * noise
        })
        .collect();
    let mut moving = vec![false; time.len()];
    for run in (0..time.len()).filter(|row| turns[*row]).collect::<Vec<_>>().chunk_by(|a, b| a + 1 == *b) {
        let [first, .., last] = *run else { continue };
        let from = time.partition_point(|t| *t < time[first] - TREMBLING);
        let to = time.partition_point(|t| *t <= time[last] + TREMBLING);
        moving[from..to].fill(true);
    }
    moving
}

/// The cubic through the attitudes about a row.
fn state(time: &[f64], attitudes: &[Matrix3<f64>], row: usize, reach: usize) -> State {
    let from = row.saturating_sub(reach).min(time.len().saturating_sub(2 * reach + 1));
    let to = (from + 2 * reach + 1).min(time.len());
    let scale = 1.0 / (time[to - 1] - time[from]).max(f64::MIN_POSITIVE);
    let mut normal = Matrix4::zeros();
    let mut right = nalgebra::SMatrix::<f64, 4, 3>::zeros();
    for k in from..to {
        let s = (time[k] - time[row]) * scale;
        let powers = Vector4::new(1.0, s, s * s, s * s * s);
        normal += powers * powers.transpose();
        right += powers * log(&attitudes[row].tr_mul(&attitudes[k])).transpose();
    }
    let cubic = normal.try_inverse().unwrap_or_else(Matrix4::zeros) * right;
    let power = |order: usize| cubic.row(order).transpose();
    State {
        c_t_p: attitudes[row] * exp(&power(0)),
        w_pt_t: power(1) * scale,
        dw_pt_t: power(2) * (2.0 * scale * scale),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::Tumble;

    /// The attitudes of a tumbling hand, some of them missing.
    fn tracked(missing: std::ops::Range<usize>) -> (Tumble, Tracked) {
        let tumble = Tumble::new(5, 3);
        let time: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        let attitude = |(row, t): (usize, &f64)| {
            let truth = tumble.truth(*t, &|_| ());
            (!missing.contains(&row)).then_some(truth.c_p_n * truth.c_t_p)
        };
        let attitudes: Vec<_> = time.iter().enumerate().map(attitude).collect();
        let tracked = Tracked::new(&time, &attitudes, vec![25.0; 3000], tumble.place()).unwrap();
        (tumble, tracked)
    }

    #[test]
    fn attitude_rate_and_acceleration_are_those_of_the_hand() {
        let (tumble, tracked) = tracked(0..0);
        for k in 0..400 {
            let t = 10.5 + 0.037 * f64::from(k);
            let (here, there) = (tracked.truth(t, &|_| ()), tumble.truth(t, &|_| ()));
            assert!((here.f_t - there.f_t).norm() < 0.02, "{t}");
            assert!((here.w_it_t - there.w_it_t).norm() < 0.02, "{t}");
        }
        let turning = 11.0;
        let (here, there) = (tracked.truth(turning, &|_| ()), tumble.truth(turning, &|_| ()));
        assert!((here.dw_it_t - there.dw_it_t).norm() < 0.05 * (1.0 + there.dw_it_t.norm()));
    }

    #[test]
    fn rows_without_an_attitude_are_bridged_and_not_known() {
        let (tumble, tracked) = tracked(1100..1105);
        assert!(!tracked.known()[1102] && !tracked.known()[1097] && tracked.known()[1200]);
        let (here, there) = (tracked.truth(11.02, &|_| ()), tumble.truth(11.02, &|_| ()));
        assert!((here.f_t - there.f_t).norm() < 0.05);
    }

    #[test]
    fn a_hand_at_rest_does_not_move() {
        let (_, tracked) = tracked(0..0);
        assert!(tracked.moving()[..960].iter().all(|moves| !moves));
        assert!(tracked.moving()[1050..1150].iter().all(|moves| *moves));
        assert!(tracked.truth(5.0, &|_| ()).w_pt_t.norm() < 1e-9);
    }
}
