//! Motions: the gyroscope's samples between attitudes that something else knows, compressed to blocks.
//!
//! The attitudes are those of the table, from a rig's encoders or from an optical reference. A motion on a rig goes
//! from inside one still stretch to inside the next: standing still, an encoder's clock does not matter.

use std::ops::Range;

use imucal_core::{
    model::rig::{GimbalPose, Pose, RigAxes},
    observation::{Block, Compared, Durations, Motion},
    rotation::{exp, log, matrix, quaternion, quaternion_log},
};
use nalgebra::{Matrix3, Quaternion, Vector3};

use super::{
    compression,
    compression::Sample,
    turn::{TurnGap, measured},
};
use crate::{
    noise::Span,
    recording::{Recording, Series},
};

/// A block lasts about this long, s: five samples at 100 Hz.
const BLOCK: f64 = 0.05;
/// Samples of a block at the most: what is faster than that is tapped or shaken, of which two orders say less.
const MOST_SAMPLES: f64 = 10.0;
/// A quaternion whose length is further from one is none.
const UNIT: f64 = 0.1;

/// What is known of the table at each row: `C_t_p`, or nothing.
pub type Attitudes = Vec<Option<Matrix3<f64>>>;

/// Attitudes that encoders show.
pub fn of_encoders(gimbal: &[[f64; 3]], axes: &RigAxes) -> Attitudes {
    gimbal.iter().map(|angles| of_angles(&Vector3::from(*angles), axes)).collect()
}

/// `C_t_p` at encoder angles, rad; `None` where one is missing.
pub fn of_angles(angles: &Vector3<f64>, axes: &RigAxes) -> Option<Matrix3<f64>> {
    let pose = GimbalPose::new(Vector3::zeros(), angles);
    angles.iter().all(|angle| angle.is_finite()).then(|| pose.rotations(axes).c_p_t.transpose())
}

/// Attitudes along a recording's reference, where no rig's encoders are there to prefer; what is wrong with a reference
/// that gives none is said once.
pub fn along_reference(recording: &Recording, warnings: &mut Vec<String>) -> Option<Attitudes> {
    let reference = recording.reference.as_deref().filter(|_| recording.gimbal.is_none())?;
    let attitudes = of_reference(reference);
    if attitudes.iter().any(Option::is_some) {
        return Some(attitudes);
    }
    let warning = format!(
        "the reference attitude is not used: none of {} rows holds a unit quaternion in ref_qw, ref_qx, ref_qy, \
         ref_qz; export it again, or leave these columns out",
        reference.len()
    );
    if !warnings.contains(&warning) {
        warnings.push(warning);
    }
    None
}

/// Attitudes of reference quaternions, w first; a row that holds no rotation is left out.
pub fn of_reference(reference: &[[f64; 4]]) -> Attitudes {
    reference
        .iter()
        .map(|[w, x, y, z]| {
            let q = Quaternion::new(*w, *x, *y, *z);
            ((q.norm() - 1.0).abs() < UNIT).then(|| matrix(&q))
        })
        .collect()
}

/// Attitudes as a sensor that lags by `lag`, s, shows them: at each row, that of `lag` before, on the way between two
/// rows; `None` where either of them has none.
pub fn later(time: &[f64], attitudes: &[Option<Matrix3<f64>>], lag: f64) -> Attitudes {
    time.iter()
        .map(|now| {
            let then = now - lag;
            let next = time.partition_point(|t| *t <= then);
            let (before, after) = (next.checked_sub(1)?, attitudes.get(next)?.as_ref()?);
            let from = attitudes.get(before)?.as_ref()?;
            let share = (then - time[before]) / (time[next] - time[before]);
            Some(from * exp(&(log(&from.tr_mul(after)) * share)))
        })
        .collect()
}

/// The gyroscope's samples and what else is known.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// Its rates.
    pub rates: Series<'a>,
    /// The table's attitude at each row.
    pub attitudes: &'a [Option<Matrix3<f64>>],
    /// Earth's rotation in p, rad/s; zero where the latitude is not known.
    pub earth_p: Vector3<f64>,
    /// Specific force of something at rest in p, m/s².
    pub force_p: Vector3<f64>,
}

/// One motion, owned, with the attitude before it and the one after.
#[derive(Clone, Debug)]
pub struct MotionData {
    /// Rows whose rates were integrated.
    pub rows: Range<usize>,
    /// When, s.
    pub span: Span,
    /// Samples, their rates less the wander.
    pub samples: Vec<Sample>,
    blocks: Vec<Block<f64>>,
    durations: Vec<f64>,
    earth: Vec<Vector3<f64>>,
    force: Vec<Vector3<f64>>,
    start: Quaternion<f64>,
    end: [Quaternion<f64>; 1],
    after: [u32; 1],
}

impl MotionData {
    /// How long it lasts, s.
    pub fn duration(&self) -> f64 {
        self.span.end - self.span.start
    }

    /// The same motion with its rates, `bias` taken off, multiplied by a matrix.
    #[must_use]
    pub fn stretched(mut self, stretch: &Matrix3<f64>, bias: &Vector3<f64>) -> Self {
        for (block, duration) in self.blocks.iter_mut().zip(&self.durations) {
            let still = compression::shifted(block, &-bias, *duration);
            *block = compression::shifted(&compression::stretched(&still, stretch), bias, *duration);
        }
        self.samples.iter_mut().for_each(|sample| sample.rate = stretch * (sample.rate - bias) + bias);
        self
    }

    /// The same motion with each of its rates altered.
    #[must_use]
    pub fn altered(&self, rate: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Self {
        let size = self.samples.iter().take_while(|sample| sample.block == 0).count();
        let samples = self.samples.iter().map(|sample| (rate(&sample.rate), sample.held));
        let (blocks, _) = compression::blocks(samples, size as u16, |_| ());
        Self { blocks, ..self.clone() }
    }

    /// The motion as the model takes it.
    pub fn motion(&self) -> Motion<'_, f64> {
        Motion {
            blocks: &self.blocks,
            durations: Durations::Each(&self.durations),
            earth: &self.earth,
            force: &self.force,
            start: self.start,
            references: &self.end,
            compared: Compared::After(&self.after),
        }
    }

    /// Attitudes before and after, `C_t_p`.
    pub fn ends(&self) -> [Quaternion<f64>; 2] {
        [self.start, self.end[0]]
    }

    /// Earth's rotation, rad/s, and specific force, m/s², over a block, table axes.
    pub fn surroundings(&self, block: usize) -> (Vector3<f64>, Vector3<f64>) {
        let at = |all: &[Vector3<f64>]| all.get(block).copied().unwrap_or_default();
        (at(&self.earth), at(&self.force))
    }

    /// The motion as a device holds it.
    pub fn narrow(&self) -> NarrowMotion {
        let narrow = |all: &[Vector3<f64>]| all.iter().map(|v| v.cast()).collect();
        NarrowMotion {
            blocks: self
                .blocks
                .iter()
                .map(|b| Block { s0: b.s0.cast(), s1: b.s1.cast(), c: b.c.cast() })
                .collect(),
            durations: self.durations.iter().map(|d| *d as f32).collect(),
            earth: narrow(&self.earth),
            force: narrow(&self.force),
            ends: self.ends().map(|q| q.cast()),
            after: self.after,
        }
    }

    /// Rotation vector from the attitude before to the one after, table axes, rad, the shorter way round.
    pub fn turned(&self) -> Vector3<f64> {
        quaternion_log(&(self.start.conjugate() * self.end[0]))
    }
}

/// A motion in single precision.
#[derive(Clone, Debug)]
pub struct NarrowMotion {
    blocks: Vec<Block<f32>>,
    durations: Vec<f32>,
    earth: Vec<Vector3<f32>>,
    force: Vec<Vector3<f32>>,
    ends: [Quaternion<f32>; 2],
    after: [u32; 1],
}

impl NarrowMotion {
    /// The motion as the model takes it.
    pub fn motion(&self) -> Motion<'_, f32> {
        Motion {
            blocks: &self.blocks,
            durations: Durations::Each(&self.durations),
            earth: &self.earth,
            force: &self.force,
            start: self.ends[0],
            references: &self.ends[1..],
            compared: Compared::After(&self.after),
        }
    }
}

impl MotionInput<'_> {
    /// The motion over some rows (two at the least) from one attitude to another. Rates are taken less
    /// `wander(time)`, and each is held from half-way to the sample before it to half-way to the one after.
    ///
    /// # Errors
    /// [`TurnGap`], with the row, where rates or attitudes are missing or time jumps.
    pub fn compress(
        &self,
        rows: Range<usize>,
        ends: [&Matrix3<f64>; 2],
        wander: &dyn Fn(f64) -> Vector3<f64>,
    ) -> Result<MotionData, TurnGap> {
        let Series { time, values, interval, .. } = self.rates;
        let all = measured(self.rates, &rows)?;
        let size = (BLOCK / interval).round().clamp(1.0, MOST_SAMPLES) as u16;
        let rate = |k: usize| values[k] - wander(time[k]);
        let mut samples = Vec::with_capacity(all.len());
        let compressed = compression::compress(time, &all, size, rate, |sample| samples.push(sample));
        let at = |rows: &Range<usize>| {
            self.attitude_near(rows.clone()).ok_or(TurnGap::NoAttitude { row: rows.start })
        };
        let attitudes = compressed.rows.iter().map(at).collect::<Result<Vec<_>, _>>()?;
        let [start, end] = ends.map(quaternion);
        Ok(MotionData {
            span: time[rows.start]..time[rows.end - 1],
            rows,
            samples,
            after: [u32::try_from(compressed.blocks.len()).unwrap_or(u32::MAX)],
            blocks: compressed.blocks,
            durations: compressed.durations,
            earth: attitudes.iter().map(|c_t_p| c_t_p.tr_mul(&self.earth_p)).collect(),
            force: attitudes.iter().map(|c_t_p| c_t_p.tr_mul(&self.force_p)).collect(),
            start,
            end: [end],
        })
    }

    /// A block's attitude: of its middle row, or of the first other row that has one within a block to either side.
    fn attitude_near(&self, rows: Range<usize>) -> Option<Matrix3<f64>> {
        let (middle, reach) = ((rows.start + rows.end - 1) / 2, rows.len());
        let near = rows.start.saturating_sub(reach)..(rows.end + reach).min(self.attitudes.len());
        self.attitudes[middle].or_else(|| self.attitudes[near].iter().flatten().next().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imucal_core::{
        model::{attitude::AttitudeModel, parameterisation::FULL},
        triad::Triad,
    };

    #[test]
    fn a_perfect_gyroscope_arrives_where_the_encoders_do() {
        let time: Vec<f64> = (0..301).map(|k| f64::from(k) * 0.01).collect();
        let earth_p = Vector3::new(5e-3, 0.0, -5e-3);
        let attitudes: Attitudes = time.iter().map(|t| Some(exp(&(Vector3::z() * 0.5 * *t)))).collect();
        let rates: Vec<_> =
            attitudes.iter().flatten().map(|c| Vector3::z() * 0.5 + c.tr_mul(&earth_p)).collect();
        let input = MotionInput {
            rates: Series { time: &time, values: &rates, usable: &vec![true; 301], interval: 0.01 },
            attitudes: &attitudes,
            earth_p,
            force_p: Vector3::zeros(),
        };
        let ends = [&attitudes[0].unwrap(), &attitudes[300].unwrap()];
        let data = input.compress(0..301, ends, &|_| Vector3::zeros()).unwrap();
        let motions = [data.motion()];
        let model = AttitudeModel { motions: &motions, form: FULL };
        let error = imucal_core::model::Cost::cost(&model, &FULL.theta(&Triad::identity())).sqrt();
        assert!(error < 1e-5, "{error}");
        assert!((data.turned() - Vector3::z() * 1.5).norm() < 1e-12);
    }

    #[test]
    fn a_sensor_that_lags_shows_the_attitude_of_before() {
        let time: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.01).collect();
        let at = |t: f64| exp(&(Vector3::new(1.0, -2.0, 0.5) * t));
        let attitudes: Attitudes = time.iter().map(|t| Some(at(*t))).collect();
        let late = later(&time, &attitudes, 0.004);
        assert!(late[0].is_none());
        assert!((late[20].unwrap() - at(0.196)).norm() < 1e-12);
        assert!((later(&time, &attitudes, -0.004)[20].unwrap() - at(0.204)).norm() < 1e-12);
    }

    #[test]
    fn a_quaternion_that_is_no_rotation_gives_no_attitude() {
        let rows = of_reference(&[[1.0, 0.0, 0.0, 0.0], [f64::NAN; 4], [0.0; 4], [2.0, 0.0, 0.0, 0.0]]);
        assert_eq!(rows.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, false, false]);
    }
}
