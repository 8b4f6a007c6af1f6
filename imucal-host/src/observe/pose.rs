//! Poses: on a rig, rests during which the encoders stood still; along a reference, samples whose attitude it gives.

use std::ops::Range;

use imucal_core::{
    model::rig::{Axis, GimbalPose, Pose, ReferencePose, RigAxes},
    observation::Moments,
    rotation::quaternion,
};
use nalgebra::{Matrix3, Vector3};

use super::cloud::cloud;
use crate::{
    noise::{Span, white::RestMeans},
    recording::{
        Recording, Triple,
        manifest::{Axis as FileAxis, Rig},
    },
};

/// Encoders that move more than this during a rest belong to no pose, rad (0.1°).
const STILL: f64 = 1.7e-3;

/// Outer and inner axis are one within this angle, rad (1°).
const LOCKED: f64 = 0.0175;

/// A pose lasts at least this long, s.
const SHORTEST: f64 = 0.75;
/// The table settles for this long after it stops, s.
const SETTLING: f64 = 0.5;
/// It has been on its way for up to this long before it shows, s: to a gyroscope, 0.1° in the mean over 4 s is a rate of
/// 0.025 °/s, and more than its noise.
const STARTING: f64 = 0.25;

/// Encoders that do not wrap may count a turn; no gimbal shows more, rad.
const LARGEST: f64 = 6.6;

/// Why a recording gives no poses.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoPoses {
    /// No encoder columns.
    #[error("the recording has no encoder columns gimbal_outer, gimbal_middle and gimbal_inner")]
    NoEncoders,
    /// The manifest does not name three axes.
    #[error(
        "the manifest's [rig] axes must name three axes, outermost first, for example [\"z\", \"y\", \"x\"]"
    )]
    NoAxes,
    /// Angles that no encoder in radians shows.
    #[error(
        "encoder angles reach {largest:.1}, expected −π to π: the file is in degrees; say [units] gimbal = \"deg\""
    )]
    Degrees {
        /// Largest angle, rad as the file claims.
        largest: f64,
    },
    /// Encoder columns without a reading.
    #[error(
        "no row holds all three encoder angles, expected them in gimbal_outer, gimbal_middle and gimbal_inner; export \
         them again, or leave these columns out"
    )]
    Missing,
    /// Two neighbouring axes are the same: the rig cannot turn about a third.
    #[error("the manifest's [rig] axes repeat a neighbour, which no three-gimbal rig does")]
    RepeatedAxis,
}

/// Poses of one sensor.
#[derive(Clone, Debug)]
pub struct Poses {
    /// Mean output and encoder angles.
    pub poses: Vec<GimbalPose<f64>>,
    /// The rig's axes.
    pub axes: RigAxes,
    /// When each was held.
    pub spans: Vec<Span>,
    /// White noise within them, nominal unit²·s, where they are long enough to show it.
    pub density: Option<Vector3<f64>>,
}

/// The distinct usable samples of a sensor at which the table's attitude `C_t_p` is known, and their rows.
pub fn along_reference(
    values: &[Vector3<f64>],
    usable: &[bool],
    attitudes: &[Option<Matrix3<f64>>],
) -> (Vec<ReferencePose<f64>>, Vec<usize>) {
    let cloud = cloud(values, usable);
    let known = cloud.points.iter().zip(&cloud.rows).filter_map(|(point, row)| {
        let attitude = quaternion(attitudes.get(*row)?.as_ref()?);
        Some((ReferencePose { value: point.value, attitude }, *row))
    });
    known.unzip()
}

/// The rig's axes, of three gimbals.
///
/// # Errors
/// [`NoPoses`] where the manifest does not say them, or says axes that no rig has.
pub fn rig_axes(rig: Option<&Rig>) -> Result<RigAxes, NoPoses> {
    let named = rig.and_then(|rig| rig.axes.as_deref()).ok_or(NoPoses::NoAxes)?;
    let [outer, middle, inner]: [FileAxis; 3] = named.try_into().map_err(|_| NoPoses::NoAxes)?;
    if outer == middle || middle == inner {
        return Err(NoPoses::RepeatedAxis);
    }
    let axis = |axis| match axis {
        FileAxis::X => Axis::X,
        FileAxis::Y => Axis::Y,
        FileAxis::Z => Axis::Z,
    };
    Ok(RigAxes([axis(outer), axis(middle), axis(inner)]))
}

/// The rig's axes and the encoders' readings.
///
/// # Errors
/// [`NoPoses`] where there are no encoders, the manifest does not name the rig's axes, or angles are in degrees.
pub fn axes_and_encoders(recording: &Recording) -> Result<(RigAxes, &[[f64; 3]]), NoPoses> {
    let gimbal = recording.gimbal.as_deref().ok_or(NoPoses::NoEncoders)?;
    let axes = rig_axes(recording.manifest.rig.as_ref())?;
    if !gimbal.iter().any(|angles| angles.iter().all(|angle| angle.is_finite())) {
        return Err(NoPoses::Missing);
    }
    let largest = gimbal.iter().flatten().filter(|a| a.is_finite()).fold(0.0f64, |most, a| most.max(a.abs()));
    if largest > LARGEST {
        return Err(NoPoses::Degrees { largest });
    }
    Ok((axes, gimbal))
}

/// Stretches in which all encoders stand still, as half-open row ranges; how the table settles and starts is left out.
pub fn still_stretches(time: &[f64], gimbal: &[[f64; 3]]) -> Vec<Range<usize>> {
    let mut stretches = Vec::new();
    let mut from = 0;
    for k in 1..=gimbal.len() {
        let still = gimbal.get(k).is_some_and(|angles| turned(angles, &gimbal[from]).amax() <= STILL);
        if !still {
            let settled = from + time[from..k].partition_point(|t| *t < time[from] + SETTLING);
            let end = from + time[from..k].partition_point(|t| *t <= time[k - 1] - STARTING);
            if settled < end && time[end - 1] - time[settled] >= SHORTEST {
                stretches.push(settled..end);
            }
            from = k;
        }
    }
    stretches
}

/// From one reading of the encoders to another, through the wrap; NaN where either is missing.
fn turned(to: &[f64; 3], from: &[f64; 3]) -> Vector3<f64> {
    // `amax` passes over NaN, which must count as having moved.
    Vector3::from_fn(|axis, _| wrapped(to[axis] - from[axis]))
        .map(|a| if a.is_nan() { f64::INFINITY } else { a })
}

/// The poses of a sensor: the means over stretches in which the encoders stand still.
///
/// # Errors
/// [`NoPoses`] where there are no encoders or the manifest does not name the rig's axes.
pub fn poses(recording: &Recording, sensor: &Triple, usable: &[bool]) -> Result<Poses, NoPoses> {
    let (axes, gimbal) = axes_and_encoders(recording)?;
    let stretches = still_stretches(&recording.time, gimbal);
    let density = RestMeans::of(&recording.time, &sensor.values, usable, &stretches).density();
    let (mut poses, mut spans) = (Vec::new(), Vec::new());
    for rows in stretches {
        let Some(angles) = mean_angles(&gimbal[rows.clone()]) else { continue };
        let mut moments = Moments::default();
        let span = recording.time[rows.start]..recording.time[rows.end - 1];
        rows.filter(|k| usable[*k]).for_each(|k| moments.push(&sensor.values[k]));
        if moments.count() > 0 {
            poses.push(GimbalPose::new(moments.mean(), &angles));
            spans.push(span);
        }
    }
    Ok(Poses { poses, axes, spans, density })
}

impl Poses {
    /// Some of them.
    pub fn of_those(&self, poses: &[usize]) -> Self {
        Self {
            poses: poses.iter().map(|k| self.poses[*k]).collect(),
            spans: poses.iter().map(|k| self.spans[*k].clone()).collect(),
            ..*self
        }
    }

    /// Poses in which the outer and the inner gimbal turn about one axis.
    pub fn in_gimbal_lock(&self) -> usize {
        let axis = |axis: Axis| Vector3::ith(axis as usize, 1.0);
        let [outer, _, inner] = self.axes.0.map(axis);
        let locked = |pose: &&GimbalPose<f64>| {
            (pose.rotations(&self.axes).c_o_t * outer).cross(&inner).norm() < LOCKED
        };
        self.poses.iter().filter(locked).count()
    }
}

/// Mean encoder angles of a stretch, through the wrap at ±π; `None` where none is measured.
pub fn mean_angles(rows: &[[f64; 3]]) -> Option<Vector3<f64>> {
    let first = rows.first()?;
    let sum: Vector3<f64> = rows.iter().map(|row| turned(row, first)).sum();
    let mean = Vector3::from(*first) + sum / rows.len() as f64;
    mean.iter().all(|angle| angle.is_finite()).then_some(mean)
}

/// An angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_on_both_sides_of_the_wrap_have_their_mean_there() {
        let pi = std::f64::consts::PI;
        let rows = [[pi - 1e-4, 0.0, 1.0], [-pi + 1e-4, 0.0, 1.0]];
        let mean = mean_angles(&rows).unwrap();
        assert!((wrapped(mean.x - pi)).abs() < 1e-12, "{mean}");
    }

    #[test]
    fn a_stretch_ends_where_an_encoder_moves_or_is_missing() {
        let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
        let mut gimbal = vec![[0.5, 0.0, 0.0]; 1000];
        gimbal[400..].fill([0.9, 0.0, 0.0]);
        gimbal[700] = [f64::NAN; 3];
        // Half a second of settling is left out of each, and a quarter before the next movement.
        assert_eq!(still_stretches(&time, &gimbal), [50..375, 450..675, 751..975]);
    }
}
