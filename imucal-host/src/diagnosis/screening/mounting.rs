//! How a unit is mounted against the sensor that a simulator's stream is of: a small turn that all its triads share.
//!
//! ```text
//! y_k ≈ K_k x_k + b_k                   each triad's samples, as its calibration corrects them, against the stream
//! θ_k = vee(K_kᵀ − K_k) / 2             C_k = σ_k² (tr(V_k⁻¹) I − V_k⁻¹) / 4 + τ² I
//! θ = (Σ C_k⁻¹)⁻¹ Σ C_k⁻¹ θ_k           x_q = exp(−[θ]×) x_p
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | V_k | Σ (x − x̄)(x − x̄)ᵀ over the rows of triad k |
//! | σ_k | scatter of the samples about the line |
//! | τ | how far the triads of a unit are turned against one another |
//! | p, q | axes of the simulated sensor, and of the unit |
//!
//! Gain and misalignment take up a small turn of each triad's own input, but not that of what an axis senses by way of another
//! triad: a product of force and rate is in the unit's axes. Not modelled: turns too large for K to be near to the identity.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};

use super::conventions::pairs::Pairs;
use crate::{
    diagnosis::reference::moments::Moments,
    effect::Truth,
    recording::{Recording, SensorKind, check::integrity::Integrity},
    simulator::Motion,
};

/// Rows that are compared, at most.
const ROWS: usize = 20_000;
/// A triad whose K is further than this from the identity is not one that is merely turned.
const NEAR: f64 = 0.4;
/// τ, rad.
const APART: f64 = 1e-2;
/// A turn counts where its square is so many times what noise gives on average, in each direction.
const SURE: f64 = 6.0;

/// θ, rad, of a unit against a movement that is given in a simulated sensor's axes; of the triads whose rows are usable and
/// which the movement gives. `None` where no turn is beyond noise.
pub fn mounting(
    recording: &Recording,
    integrity: &Integrity,
    motion: &dyn Motion,
    triads: &[Triad<f64>; 3],
    usable: &[Vec<bool>; 3],
) -> Option<Vector3<f64>> {
    let stride = recording.rows().div_ceil(ROWS).max(1);
    let rows: Vec<usize> = (stride / 2..recording.rows()).step_by(stride).collect();
    let truth: Vec<Truth> = rows.iter().map(|row| motion.truth(recording.time[*row], &|_| ())).collect();
    let of = |kind: SensorKind| {
        let is_used = |at: &usize| usable[kind as usize].get(rows[*at]).copied().unwrap_or(false);
        let used: Vec<usize> = (0..rows.len()).filter(is_used).collect();
        let (rows, truth): (Vec<usize>, Vec<Truth>) = used.iter().map(|at| (rows[*at], truth[*at])).unzip();
        let pairs = Pairs::of(recording, integrity, kind, &rows, &truth)?.trusted();
        turned(&pairs.moments(), &triads[kind as usize].gain)
    };
    let known = |kind: &SensorKind| motion.gives(*kind);
    joined(SensorKind::ALL.into_iter().filter(known).filter_map(of))
}

/// θ_k and C_k⁻¹ of a triad; `None` where it is not merely turned.
fn turned(moments: &Moments, gain: &Matrix3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let k = gain * moments.sensitivity();
    if (k - Matrix3::identity()).amax() > NEAR {
        return None;
    }
    let turn = Vector3::new(k.m23 - k.m32, k.m31 - k.m13, k.m12 - k.m21) * 0.5;
    let variance = moments.unexplained() * moments.output * gain.norm_squared() / (9.0 * moments.rows);
    let inverse = moments.input.try_inverse()?;
    let own = (Matrix3::identity() * inverse.trace() - inverse) * (0.25 * variance);
    Some((turn, (own + Matrix3::identity() * (APART * APART)).try_inverse()?))
}

/// The turn that some triads share.
fn joined(triads: impl Iterator<Item = (Vector3<f64>, Matrix3<f64>)>) -> Option<Vector3<f64>> {
    let (mut information, mut score) = (Matrix3::zeros(), Vector3::zeros());
    for (turn, precision) in triads {
        information += precision;
        score += precision * turn;
    }
    let turn = information.try_inverse()? * score;
    (turn.dot(&score) > 3.0 * SURE).then_some(turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        recording::{Stream, check::integrity::inspect},
        simulator::{
            StreamClock, Streamed,
            robot::{RobotKind, RobotScene},
        },
    };

    /// What is found of a robot's unit that is mounted with this turn.
    fn found(kind: RobotKind, turn: Vector3<f64>, seed: u64) -> Option<Vector3<f64>> {
        let scene = RobotScene { kind, duration: 90.0, mounting: turn, seed, ..RobotScene::default() };
        let pair = scene.record("mounted").unwrap();
        let stream = Stream::of(&pair.simulated).unwrap();
        let real = &pair.real;
        let (clock, place) = (StreamClock::default(), scene.place);
        let motion = Streamed::new(&stream, clock, &real.time, vec![25.0; real.rows()], place).unwrap();
        let integrity = inspect(real);
        let usable = SensorKind::ALL.map(|kind| integrity.sensor(kind).unwrap().usable.clone());
        mounting(real, &integrity, &motion, &[Triad::identity(); 3], &usable)
    }

    #[test]
    fn a_unit_s_mounting_is_found_to_what_its_triads_are_turned_against_one_another() {
        for (seed, kind) in [RobotKind::Legged, RobotKind::Wheeled, RobotKind::Flying].into_iter().enumerate()
        {
            for turn in [Vector3::zeros(), Vector3::new(0.02, -0.035, 0.05), Vector3::new(-0.1, 0.08, -0.03)]
            {
                let found = found(kind, turn, seed as u64).unwrap_or_default();
                assert!((found - turn).amax() < 2.0 * APART, "{kind:?}: {turn} {found}");
            }
        }
    }

    #[test]
    fn a_triad_with_swapped_axes_does_not_count() {
        let samples = |k: Matrix3<f64>| Moments {
            rows: 1000.0,
            cross: k * 500.0,
            output: 1500.0 * k.norm_squared() / 3.0 + 1e-3,
            input: Matrix3::identity() * 500.0,
        };
        let swap = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        assert!(turned(&samples(swap), &Matrix3::identity()).is_none());
        let small = imucal_core::rotation::exp(&Vector3::new(0.0, 0.0, -0.1));
        let (turn, _) = turned(&samples(small), &Matrix3::identity()).unwrap();
        assert!((turn - Vector3::new(0.0, 0.0, 0.1)).norm() < 1e-3, "{turn}");
    }
}
