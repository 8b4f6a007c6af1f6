//! The movement of a hand, as the sensors themselves show it.
//!
//! At rest the accelerometer gives the direction of gravity; between two rests the gyroscope gives the turn, and where it
//! misses the next direction, the miss is spread over the turn. The table's axes are those in which the accelerometer
//! responds without a rotation:
//!
//! ```text
//! K = S R      S symmetric, R a rotation;      f_t = R · gain · (raw − bias)
//! ```
//!
//! Heading is not known, so that Earth's rotation stays out of the movement: it is below what a hand's turns show.

use std::ops::Range;

use imucal_core::{
    accept::{Quantity, Refusal},
    rotation::exp,
    triad::Triad,
};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::model::Model;
use crate::{
    calibrate,
    calibrate::{Calibration, SensorOutcome, fit::outlier::outliers},
    effect::{Machine, Truth},
    recording::{
        Recording, SensorKind,
        check::integrity::Integrity,
        manifest::{Rig, RigKind},
    },
    simulator::{Motion, Place, Recorded, Tracked, recent::Recent},
};

/// Fewer rests than this cannot distinguish an effect from the attitudes' own freedom.
const LEAST: usize = 8;
/// A turn begins so long before its first rest ends and ends so long after its second has begun, s.
const MARGIN: f64 = 0.25;

/// Rests of a sensor in a hand and the turns between them.
#[derive(Clone, Debug)]
pub struct RestToRest {
    tracked: Tracked,
    moving: Vec<bool>,
    known: Vec<bool>,
    /// Rows of each rest.
    pub rests: Vec<Range<usize>>,
    /// Attitude of each, table to a base with its third axis down.
    pub attitudes: Vec<Matrix3<f64>>,
    /// The turn to each from the one before is known from the gyroscope.
    pub turned: Vec<bool>,
    /// Accelerometer and gyroscope, nominal SI to SI in the table's axes.
    pub triads: [Triad<f64>; 2],
    /// The gyroscope's triad is known.
    pub with_gyroscope: bool,
}

impl RestToRest {
    /// From the rests of a recording; its sensors are corrected by the model where it holds them, else by a calibration of
    /// the recording itself.
    ///
    /// # Errors
    ///
    /// What the recording lacks, for a reader.
    pub fn new(
        recording: &Recording,
        integrity: &Integrity,
        model: &Model,
        temperature: Vec<f64>,
        place: Place,
    ) -> Result<Self, String> {
        let acc = recording.acc.as_ref().ok_or_else(|| NO_REST.to_owned())?;
        let options = calibrate::Options { skip: vec![SensorKind::Mag], ..Default::default() };
        let calibration = calibrate::calibrate(recording, &options, &|_| ());
        let own = |kind: SensorKind| own_triad(kind, model, &calibration);
        if !model.calibrated.contains(&SensorKind::Gyr)
            && let Some(why) = calibration.sensor(SensorKind::Gyr).and_then(misread)
        {
            return Err(why);
        }
        let acc_triad = own(SensorKind::Acc).map_err(|why| {
            format!("{NO_REST}; and its rests do not give the attitude: the accelerometer's calibration is refused, {why}")
        })?;
        let rests = calibration.segmentation.as_ref().map(|cut| cut.rests.clone()).unwrap_or_default();
        let usable = |kind: SensorKind| integrity.sensor(kind).map(|sensor| sensor.usable.as_slice());
        let acc_usable = usable(SensorKind::Acc).unwrap_or_default();
        let turn = rotation_of(&acc_triad.gain).ok_or("the accelerometer's calibration is singular")?;
        let in_table = |triad: Triad<f64>| Triad { gain: turn * triad.gain, ..triad };
        let acc_triad = in_table(acc_triad);
        let forces: Vec<Vector3<f64>> =
            rests.iter().map(|rows| acc_triad.correct(&mean(&acc.values, acc_usable, rows))).collect();
        // Against a calibration of its own, a rest that was knocked is no part of the question.
        let (rests, forces) = match model.calibrated.contains(&SensorKind::Acc) {
            true => (rests, forces),
            false => without_knocks(rests, forces, place.gravity),
        };
        if rests.len() < LEAST {
            return Err(format!(
                "{NO_REST}; gravity gives the attitude at rests, of which {LEAST} are needed; there are {}",
                rests.len()
            ));
        }
        let gyr_triad = recording.gyr.as_ref().and_then(|_| own(SensorKind::Gyr).ok()).map(in_table);
        let along: Vec<Vector3<f64>> = forces.iter().map(|f| f.normalize()).collect();
        let path = path(recording, &rests, &along, gyr_triad.as_ref(), usable(SensorKind::Gyr));
        let tracked = Tracked::new(&recording.time, &path.attitudes, temperature, place)
            .ok_or_else(|| NO_REST.to_owned())?;
        let mut moving = vec![true; recording.rows()];
        rests.iter().for_each(|rows| moving[rows.clone()].fill(false));
        let gyr = gyr_triad.unwrap_or_else(Triad::identity);
        Ok(Self {
            tracked,
            moving,
            known: vec![true; recording.rows()],
            rests,
            attitudes: path.at_rest,
            turned: path.turned,
            triads: [acc_triad, gyr],
            with_gyroscope: gyr_triad.is_some(),
        })
    }
}

/// A sensor's triad: that of the model, or of the recording's own calibration; or why there is none.
fn own_triad(kind: SensorKind, model: &Model, calibration: &Calibration) -> Result<Triad<f64>, String> {
    if model.calibrated.contains(&kind) {
        return Ok(model.triads[kind as usize]);
    }
    let outcome = calibration.sensor(kind).ok_or_else(|| NO_REST.to_owned())?;
    match (&outcome.verdict, &outcome.fit) {
        (Ok(()), Some(fit)) => Ok(fit.triad),
        (Err(_), _) => Err(outcome.detail().unwrap_or_default()),
        (Ok(()), None) => Err(NO_REST.to_owned()),
    }
}

/// Mean of the usable samples of some rows.
fn mean(values: &[Vector3<f64>], usable: &[bool], rows: &Range<usize>) -> Vector3<f64> {
    let rows = rows.clone().filter(|row| usable[*row]);
    let (sum, count) = rows.fold((Vector3::zeros(), 0.0), |(s, n), row| (s + values[row], n + 1.0));
    sum / f64::max(count, 1.0)
}

/// Rests and their forces, m/s², without those whose force is an outlier against gravity, m/s².
fn without_knocks(
    rests: Vec<Range<usize>>,
    forces: Vec<Vector3<f64>>,
    gravity: f64,
) -> (Vec<Range<usize>>, Vec<Vector3<f64>>) {
    let errors: Vec<f64> = forces.iter().map(|f| f.norm() - gravity).collect();
    let knocked: Vec<usize> = outliers(&errors).into_iter().map(|(rest, _)| rest).collect();
    let all = rests.into_iter().zip(forces).enumerate();
    all.filter_map(|(at, rest)| (!knocked.contains(&at)).then_some(rest)).unzip()
}

/// The attitudes from rest to rest, by the direction of gravity at each and, where there is one, by the gyroscope between.
fn path(
    recording: &Recording,
    rests: &[Range<usize>],
    along: &[Vector3<f64>],
    gyr_triad: Option<&Triad<f64>>,
    usable: Option<&[bool]>,
) -> Path {
    let mut path = Path { attitudes: vec![None; recording.rows()], at_rest: Vec::new(), turned: Vec::new() };
    for (at, rows) in rests.iter().enumerate() {
        let Some(before) = at.checked_sub(1) else {
            path.begin(rows, &along[0]);
            continue;
        };
        let rates = gyr_triad.zip(recording.gyr.as_ref()).zip(usable);
        let turn = rates.and_then(|((triad, gyr), usable)| {
            let means = [before, at].map(|rest| mean(&gyr.values, usable, &rests[rest]));
            turn_between(&recording.time, &gyr.values, usable, [&rests[before], rows], means, &triad.gain)
        });
        path.go_on(&recording.time, [&rests[before], rows], turn, &along[at]);
    }
    path
}

/// Why a gyroscope is refused whose columns are not what they are said to be: nothing follows what it turns by.
fn misread(outcome: &SensorOutcome) -> Option<String> {
    let refused = outcome.verdict.as_ref().err()?;
    match refused.refusal {
        Refusal::Implausible { what: Quantity::Axes, value: 0.0, .. } => None,
        Refusal::Implausible { what: Quantity::Axes | Quantity::Gain, .. } => Some(refused.advice.clone()),
        _ => None,
    }
}

const NO_REST: &str = "there are neither encoder columns (gimbal_outer, gimbal_middle, gimbal_inner) nor a reference \
                       attitude (ref_qw, ref_qx, ref_qy, ref_qz): the simulator cannot be given the movement";

/// R of K = S R, the inverse of a gain.
fn rotation_of(gain: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = gain.try_inverse()?.svd(true, true);
    Some(svd.u? * svd.v_t?)
}

/// Rows of a turn and its attitude at each against the rest before, by the gyroscope alone.
type Turn = Vec<(usize, Matrix3<f64>)>;

/// The turn between two rests; `None` where rates are missing. `means` are the rates at both: between them the bias wanders
/// evenly.
fn turn_between(
    time: &[f64],
    rates: &[Vector3<f64>],
    usable: &[bool],
    [before, after]: [&Range<usize>; 2],
    means: [Vector3<f64>; 2],
    gain: &Matrix3<f64>,
) -> Option<Turn> {
    let from =
        time[before.start..before.end].partition_point(|t| *t < time[before.end - 1] - MARGIN) + before.start;
    let to = time[after.start..after.end].partition_point(|t| *t < time[after.start] + MARGIN) + after.start;
    let [start, end] = [before, after].map(|rows| 0.5 * (time[rows.start] + time[rows.end - 1]));
    let mut attitude = Matrix3::identity();
    let mut turn = vec![(from, attitude)];
    let rate = |row: usize| {
        let share = ((time[row] - start) / (end - start)).clamp(0.0, 1.0);
        gain * (rates[row] - means[0] * (1.0 - share) - means[1] * share)
    };
    let mut last = from;
    for row in from + 1..=to.min(time.len() - 1) {
        if !usable[row] {
            continue;
        }
        if time[row] - time[last] > LONGEST_GAP {
            return None;
        }
        attitude *= exp(&((rate(last) + rate(row)) * (0.5 * (time[row] - time[last]))));
        turn.push((row, attitude));
        last = row;
    }
    Some(turn)
}

/// Rates may be missing for so long, s.
const LONGEST_GAP: f64 = 0.05;

/// Attitudes on the way.
struct Path {
    attitudes: Vec<Option<Matrix3<f64>>>,
    at_rest: Vec<Matrix3<f64>>,
    turned: Vec<bool>,
}

impl Path {
    /// The first rest, with specific force along a direction: up, where the base has its third axis down.
    fn begin(&mut self, rows: &Range<usize>, along: &Vector3<f64>) {
        let attitude = carrying(along, &-Vector3::z());
        self.attitudes[rows.clone()].fill(Some(attitude));
        self.at_rest.push(attitude);
        self.turned.push(false);
    }

    /// The next rest, by a turn that misses the direction a little, or else by the shortest one.
    fn go_on(
        &mut self,
        time: &[f64],
        [before, rows]: [&Range<usize>; 2],
        turn: Option<Turn>,
        along: &Vector3<f64>,
    ) {
        let Some(start) = self.at_rest.last().copied() else { return };
        let known = turn.is_some();
        let ends = [before.end - 1, rows.start];
        let turn = turn.unwrap_or_else(|| ends.map(|row| (row, Matrix3::identity())).to_vec());
        let Some((_, whole)) = turn.last().copied() else { return };
        let [from, to] = ends.map(|row| time[row]);
        let shown = (start * whole).tr_mul(&-Vector3::z());
        // What carries the direction of the accelerometer to that which the gyroscope arrives at.
        let miss = Rotation3::from_matrix_unchecked(carrying(along, &shown)).scaled_axis();
        let end = start * whole * exp(&miss);
        self.attitudes[rows.clone()].fill(Some(end));
        for (row, relative) in turn {
            // All of it between the rests, where the rates are looked at.
            let share = ((time[row] - from) / (to - from).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            self.attitudes[row] = Some(start * relative * exp(&(miss * share)));
        }
        self.at_rest.push(end);
        self.turned.push(known);
    }
}

/// The shortest rotation that carries one direction to another.
fn carrying(from: &Vector3<f64>, to: &Vector3<f64>) -> Matrix3<f64> {
    let about_x = || Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Rotation3::rotation_between(from, to).unwrap_or_else(about_x).into_inner()
}

impl Motion for RestToRest {
    fn duration(&self) -> f64 {
        self.tracked.duration()
    }

    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let truth = self.tracked.truth_among(time, rig, recent);
        let earth = truth.w_ie_t;
        Truth {
            w_ie_t: Vector3::zeros(),
            w_it_t: truth.w_pt_t,
            dw_it_t: truth.dw_it_t + truth.w_pt_t.cross(&earth),
            ..truth
        }
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::Hand, axes: None }
    }

    fn place(&self) -> Place {
        self.tracked.place()
    }
}

impl Recorded for RestToRest {
    /// Outside of rests.
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
