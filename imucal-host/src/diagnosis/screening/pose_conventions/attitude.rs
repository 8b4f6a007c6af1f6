//! Quaternions that are inverse or in another order.
//!
//! Rates of the attitudes are compared with the gyroscope's: y ≈ s R w + b with any mount R and scale s. Another reading
//! is named where it leaves far less than the one that was given. Left-handed attitudes do not show: they are those of
//! axes that are turned by half a turn; positions show them.

use imucal_core::rotation::log;
use nalgebra::{Matrix3, Vector3};

use crate::{
    diagnosis::reference::pose::Pose,
    observe::motion,
    recording::{Recording, SensorKind, check::integrity::Integrity},
};

/// The gyroscope does not follow what leaves more than this share of its variance,
const LOST: f64 = 0.02;
/// and another reading is the right one where it leaves less than this share of that.
const BETTER: f64 = 0.2;
/// Readings that leave as much within this ratio are not distinguished.
const ALIKE: f64 = 1.5;
/// Rows that are compared.
const ROWS: usize = 4000;
/// Rates are those between attitudes this far apart, s.
const STEP: f64 = 0.04;
/// The weakest direction of a movement shows a hand from this share of the strongest on.
const SHOWN: f64 = 0.01;
/// Fewer rows than this say nothing.
const FEWEST: usize = 100;

/// Samples and what the reference says that they were given.
pub type Given = Vec<(Vector3<f64>, Vector3<f64>)>;

/// A quaternion, scalar first, of four columns.
type Reading = fn(&[f64; 4]) -> [f64; 4];

/// What is wrong with the attitudes, for a reader; `None` where nothing shows.
pub fn wrong(recording: &Recording, integrity: &Integrity, pose: &Pose) -> Option<String> {
    let time = &recording.time;
    let share = |attitudes: &motion::Attitudes| {
        let given = rates(recording, integrity, time, attitudes);
        Some(turned(&given)?.left)
    };
    let as_read = share(&pose.attitudes)?;
    if as_read < LOST {
        return None;
    }
    let quaternions = recording.reference.as_deref()?;
    let readings: [(&str, Reading); 3] = [
        (
            "inverse: from north, east, down to the body's axes; negate ref_qx, ref_qy and ref_qz",
            |[w, x, y, z]| [*w, -x, -y, -z],
        ),
        ("in the order x, y, z, w; put the scalar first, in ref_qw", |[x, y, z, w]| [*w, *x, *y, *z]),
        (
            "in the order x, y, z, w, and inverse; put the scalar first, in ref_qw, and negate the others",
            |[x, y, z, w]| [*w, -x, -y, -z],
        ),
    ];
    let left = readings.iter().filter_map(|(words, read)| {
        let other: Vec<[f64; 4]> = quaternions.iter().map(read).collect();
        Some((share(&motion::of_reference(&other))?, *words))
    });
    let left: Vec<(f64, &str)> = left.collect();
    let least = left.iter().map(|(left, _)| *left).fold(f64::INFINITY, f64::min);
    let alike = left.iter().filter(|(left, _)| *left <= ALIKE * least).map(|(_, words)| *words);
    (least < BETTER * as_read).then(|| {
        format!(
            "the reference attitudes are {}: as they are read, {:.1} % of the gyroscope's variance do not follow them, and \
             read so, {:.1} %",
            alike.collect::<Vec<_>>().join("; or else "),
            100.0 * as_read,
            100.0 * least
        )
    })
}

/// Rates of the attitudes next to those of the gyroscope.
pub fn rates(
    recording: &Recording,
    integrity: &Integrity,
    time: &[f64],
    attitudes: &motion::Attitudes,
) -> Given {
    let (Some(gyr), Some(sensor)) = (&recording.gyr, integrity.sensor(SensorKind::Gyr)) else {
        return Vec::new();
    };
    let stride = recording.rows().div_ceil(ROWS).max(1);
    let rate = |row: usize| {
        let from = time.partition_point(|t| *t < time[row] - 0.5 * STEP);
        let to = time.partition_point(|t| *t <= time[row] + 0.5 * STEP).checked_sub(1)?;
        let turn = log(&attitudes[from]?.tr_mul(&attitudes[to]?));
        let span = time[to] - time[from];
        let samples = gyr.values.get(from..=to)?.iter().zip(&sensor.usable[from..=to]);
        let samples: Vec<&Vector3<f64>> =
            samples.filter(|(_, usable)| **usable).map(|(value, _)| value).collect();
        (span > 0.25 * STEP && !samples.is_empty())
            .then(|| (samples.iter().copied().sum::<Vector3<f64>>() / samples.len() as f64, turn / span))
    };
    (0..recording.rows()).step_by(stride).filter_map(rate).collect()
}

/// How samples follow what they were given, turned and scaled.
pub struct Turned {
    /// Share of the samples' variance that is left.
    pub left: f64,
    /// Size of the weakest direction against the strongest.
    pub weakest: f64,
    /// The turn.
    pub turn: Matrix3<f64>,
}

/// The turn that leaves least; `None` where hardly anything varies.
pub fn turned(given: &Given) -> Option<Turned> {
    let count = given.len() as f64;
    let mean_y = given.iter().map(|(y, _)| y).sum::<Vector3<f64>>() / count;
    let mean_v = given.iter().map(|(_, v)| v).sum::<Vector3<f64>>() / count;
    let (mut cross, mut input, mut output) = (Matrix3::zeros(), 0.0, 0.0);
    for (y, v) in given {
        let (y, v) = (y - mean_y, v - mean_v);
        cross += y * v.transpose();
        input += v.norm_squared();
        output += y.norm_squared();
    }
    if given.len() < FEWEST || input <= 0.0 || output <= 0.0 {
        return None;
    }
    let svd = cross.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sizes = svd.singular_values;
    let weakest = sizes.imin();
    let handed = (u * v_t).determinant().signum();
    let along = sizes.sum() - sizes[weakest] + handed * sizes[weakest];
    let mut sign = Matrix3::identity();
    sign[(weakest, weakest)] = handed;
    Some(Turned {
        left: (1.0 - along * along / (input * output)).max(0.0),
        weakest: sizes[weakest] / sizes.max(),
        turn: u * sign * v_t,
    })
}

/// How the sensor sits on the body, where the rates show it: components of the body into those of the sensor.
pub fn mount(given: &Given) -> Option<Matrix3<f64>> {
    let fit = turned(given)?;
    (fit.left < 5.0 * LOST && fit.weakest > SHOWN).then_some(fit.turn)
}
