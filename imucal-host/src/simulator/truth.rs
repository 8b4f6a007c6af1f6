//! What is true at a time: attitude, rate, specific force and field of a moving table. Knows no sensor.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};

use super::{
    gimbal::{Pose, pose},
    place::Place,
    recent::Recent,
};
use crate::{
    effect::{Machine, Swing, Truth},
    recording::{SensorKind, manifest::Rig},
};

/// A movement: a source of truth.
pub trait Motion: Sync {
    /// Its length, s.
    fn duration(&self) -> f64;

    /// The truth at a time from 0 to [`duration`](Self::duration), s, on a rig that `rig` may alter before; earlier and
    /// later, that of the nearest end.
    fn truth(&self, time: f64, rig: &dyn Fn(&mut Machine)) -> Truth {
        self.truth_among(time, rig, &mut Recent::default())
    }

    /// The same, at one of many times; what they have in common is `recent`.
    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth;

    /// Angles that exact encoders would show, rad, outermost first, not wrapped; `None` without a rig.
    fn encoders(&self, _time: f64) -> Option<[f64; 3]> {
        None
    }

    /// Whether it says what a sensor of a kind is given.
    fn gives(&self, _kind: SensorKind) -> bool {
        true
    }

    /// What turns the sensor.
    fn rig(&self) -> Rig;

    /// Where.
    fn place(&self) -> Place;
}

/// A movement that was recorded, row by row.
pub trait Recorded: Motion {
    /// Whether it moves, row by row.
    fn moving(&self) -> &[bool];

    /// Whether the recording gives the attitude, row by row.
    fn known(&self) -> &[bool];

    /// Swings of the gimbals at a row, outermost first, those of [`steady`](Self::steady); `None` without gimbals or behind the last
    /// row.
    fn swings(&self, _row: usize) -> Option<[Swing; 3]> {
        None
    }

    /// Standard error of the specific force at each row, m/s², where it is estimated; `None` where it is exact.
    fn force_errors(&self) -> Option<&[f64]> {
        None
    }

    /// Speed at each row, m/s; `None` where it is not known.
    fn speeds(&self) -> Option<&[f64]> {
        None
    }

    /// Samples of an accelerometer, one a row, those in use, without what is too brisk for the specific force to hold it, as
    /// `triad` takes them into the table's axes; `None` where it holds all of a movement.
    fn as_sharp(
        &self,
        _samples: &[Vector3<f64>],
        _usable: &[bool],
        _triad: &Triad<f64>,
    ) -> Option<Vec<Vector3<f64>>> {
        None
    }

    /// The same movement in the axes of a unit that is mounted with a small turn, `c_t_q`, where it is given in those of a
    /// simulated sensor; `None` where the table's axes are the unit's.
    fn mounted(&self, _c_t_q: &Matrix3<f64>) -> Option<Box<dyn Recorded>> {
        None
    }

    /// The same movement estimated from more readings at a time, where they are noisy: less noise row by row, and bends cut.
    fn steady(&self) -> &dyn Motion;
}

/// The truth on a three-gimbal rig.
pub fn on_rig(time: f64, machine: &Machine, place: &Place, temperature: f64, recent: &mut Recent) -> Truth {
    let c_p_n = recent.base(machine);
    at_pose(time, &pose(machine), c_p_n, machine.gimbals, place, temperature, recent)
}

/// The truth on a table in a pose, on a base that stands like `c_p_n`.
///
/// Without lever arm: the unit sits where the axes meet. The table does not travel, so that specific force is gravity.
pub fn at_pose(
    time: f64,
    pose: &Pose,
    c_p_n: Matrix3<f64>,
    gimbals: [Swing; 3],
    place: &Place,
    temperature: f64,
    recent: &mut Recent,
) -> Truth {
    let c_t_n = c_p_n * pose.c_t_p;
    let to_t = |v_n: Vector3<f64>| c_t_n.tr_mul(&v_n);
    let w_ie_t = to_t(recent.earth_rate_n(place));
    Truth {
        time,
        c_t_p: pose.c_t_p,
        c_t_o: pose.c_t_o,
        c_t_m: pose.c_t_m,
        c_p_n,
        p_p: Vector3::zeros(),
        gimbals,
        w_pt_t: pose.w_pt_t,
        w_ie_t,
        w_it_t: pose.w_pt_t + w_ie_t,
        // Earth's rotation is fixed in n and turns the other way in t.
        dw_it_t: pose.dw_pt_t - pose.w_pt_t.cross(&w_ie_t),
        gravity: place.gravity,
        f_t: to_t(Vector3::new(0.0, 0.0, -place.gravity)),
        b_t: to_t(place.field_n),
        temperature,
    }
}

/// The truth of something without gimbals: base level, outer and middle gimbal resting in it.
pub fn in_the_open(
    time: f64,
    c_t_n: &Matrix3<f64>,
    w_nt_t: Vector3<f64>,
    dw_nt_t: Vector3<f64>,
    place: &Place,
    recent: &mut Recent,
) -> Truth {
    let pose = Pose { c_t_p: *c_t_n, c_t_o: *c_t_n, c_t_m: *c_t_n, w_pt_t: w_nt_t, dw_pt_t: dw_nt_t };
    at_pose(time, &pose, Matrix3::identity(), [Swing::default(); 3], place, 25.0, recent)
}

#[cfg(test)]
mod tests {
    use super::{super::place::EARTH_RATE, *};

    #[test]
    fn at_rest_there_is_gravity_and_earth_s_rotation_and_nothing_else() {
        let place = Place::ankara();
        let mut machine = Machine::exact([Vector3::z(), Vector3::x(), Vector3::y()]);
        machine.tilt = [2e-3, -1e-3];
        for k in 0..50 {
            let angle = 0.37 * f64::from(k);
            machine.gimbals = [angle, 1.7 * angle, -2.3 * angle].map(Swing::still);
            let truth = on_rig(0.0, &machine, &place, 25.0, &mut Recent::default());
            // Angles to 40 rad, of which each doubling beyond one costs a bit.
            assert!((truth.f_t.norm() - place.gravity).abs() < 1e-12);
            assert!((truth.w_it_t.norm() - EARTH_RATE).abs() < 1e-18);
            // Up and Earth's axis: sine of the latitude.
            let sine = truth.f_t.dot(&truth.w_it_t) / (place.gravity * EARTH_RATE);
            assert!((sine - place.latitude_deg.to_radians().sin()).abs() < 1e-13);
        }
    }

    #[test]
    fn a_unit_aligned_with_n_reads_minus_g_down() {
        let machine = Machine::exact([Vector3::z(), Vector3::y(), Vector3::x()]);
        let truth = on_rig(0.0, &machine, &Place::ankara(), 25.0, &mut Recent::default());
        assert_eq!(truth.f_t, Vector3::new(0.0, 0.0, -9.7997));
        assert_eq!(truth.b_t, Vector3::new(25.3, 2.6, 40.1));
    }
}
