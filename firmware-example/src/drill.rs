//! Observations of the sensors of [`crate::scene`] for every model that a device fits, one at a time, by formulas that
//! host and device evaluate alike.

use imucal_core::{
    link::{FitModel, FitTask, Observation},
    model::{
        rig::{Axis, GimbalPose, Pose, RigAxes},
        unified::UnifiedParameters,
    },
    observation::BlockBuilder,
    record::RawUnit,
    rotation::{exp, sin_cos},
};
use nalgebra::{Matrix3, Vector3};

use crate::scene::{self, Noise, Sensor, rate, spiral, unit};

/// Local gravity, m/s².
pub const GRAVITY: f32 = 9.80665;
/// Magnitude of the local field, µT.
pub const FIELD: f32 = 48.0;
/// Levelling of the rig's base, rad.
const TILT: [f32; 2] = [2e-3, -1e-3];
/// Half-width of the error of a rest's direction, rad.
const WAVER: f32 = 1e-3;
/// Blocks of a turn.
pub const BLOCKS: usize = 12;
/// Gyroscope samples of a block.
const BLOCK_SAMPLES: usize = 5;
/// Time between gyroscope samples, s.
const INTERVAL: f32 = 0.02;

/// The task of a model.
pub fn task(model: FitModel) -> FitTask {
    let (norm, unit_in) = match model {
        FitModel::E9 => (FIELD, RawUnit::MicroTesla),
        FitModel::K12 => (1.0, RawUnit::RadianPerSecond),
        _ => (GRAVITY, RawUnit::MetrePerSecondSquared),
    };
    FitTask {
        model,
        norm,
        axes: [2, 1, 0],
        bias: [0.0; 3],
        unit_in,
        offset: 0.0,
        per_unit: 1.0,
        search: None,
    }
}

/// The sensor that a model is fitted to.
pub fn sensor(model: FitModel) -> Sensor {
    match model {
        FitModel::E9 => scene::magnetometer(),
        FitModel::K12 => scene::gyroscope(),
        _ => scene::accelerometer(),
    }
}

/// Gives `count` rests, poses, samples or turns of a model's sensor to `take`.
pub fn observe(model: FitModel, count: usize, noise: &mut Noise, mut take: impl FnMut(Observation)) {
    let sensor = sensor(model);
    match model {
        FitModel::E9 => {
            for k in 0..count {
                take(Observation::Point(sensor.sample(&(spiral(k, count) * FIELD), noise).into(), 0.0));
            }
        }
        FitModel::K12 => turns(&sensor, count, noise, &mut take),
        FitModel::I14 => poses(&sensor, count, noise, &mut take),
        _ => {
            for k in 0..count {
                take(Observation::Point(sensor.rest(&(spiral(k, count) * GRAVITY), noise).into(), 0.0));
            }
        }
    }
}

/// Rests on a rig whose base is not level.
fn poses(sensor: &Sensor, count: usize, noise: &mut Noise, take: &mut impl FnMut(Observation)) {
    let level = UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -GRAVITY));
    let rig = UnifiedParameters { tilt: TILT, ..level };
    for k in 0..count {
        let k = k as f32;
        // Angles without a pattern, within 3 rad.
        let angles =
            Vector3::new(1.7 * k, 2.3 * k + 0.5, 3.1 * k).map(|a| a - 6.0 * libm::floorf(a / 6.0) - 3.0);
        let (sin, cos) = (angles.map(|a| sin_cos(a).0), angles.map(|a| sin_cos(a).1));
        let pose = GimbalPose::turned(Vector3::zeros(), sin, cos);
        let force = rig.predict(&pose.rotations(&RigAxes([Axis::Z, Axis::Y, Axis::X])));
        take(Observation::Pose(sensor.rest(&force, noise).into(), sin.into(), cos.into()));
    }
}

/// Turns from rest to rest, one after the other.
fn turns(sensor: &Sensor, count: usize, noise: &mut Noise, take: &mut impl FnMut(Observation)) {
    let mut down = Vector3::z();
    for k in 0..count {
        // The end of a turn is known before its blocks are given: the rate is the scene's, without noise.
        let turn: Matrix3<f32> = (0..BLOCKS * BLOCK_SAMPLES)
            .fold(Matrix3::identity(), |turn, sample| turn * exp(&(rate(k, count, sample) * INTERVAL)));
        let after = turn.tr_mul(&down);
        let seen =
            |direction: &Vector3<f32>, noise: &mut Noise| unit(&(direction + noise.vector(WAVER))).into();
        let ends = (seen(&down, noise), seen(&after, noise));
        take(Observation::Turn(ends.0, ends.1));
        let mut builder = BlockBuilder::default();
        for block in 0..BLOCKS {
            for sample in 0..BLOCK_SAMPLES {
                let rate = rate(k, count, block * BLOCK_SAMPLES + sample);
                builder.push(&sensor.sample(&rate, noise), INTERVAL);
            }
            let (block, duration) = builder.finish();
            take(Observation::block(&block, duration));
        }
        down = after;
    }
}
