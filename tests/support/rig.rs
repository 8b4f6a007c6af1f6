//! Poses on a rig, made directly from the model, and figures of many trials.

use imucal_core::model::{
    rig::{Axis, GimbalPose, Pose, RigAxes},
    unified::UnifiedParameters,
};
use imucal_host::observe::pose::Poses;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

/// The rig's axes where a test does not ask for others.
pub const ZYX: RigAxes = RigAxes([Axis::Z, Axis::Y, Axis::X]);

/// Seeded random numbers.
#[derive(Clone, Debug)]
pub struct Draw(ChaCha8Rng);

impl Draw {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Normal, of standard deviation one.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Three of them.
    pub fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// Uniform within ±`largest`.
    ///
    /// # Panics
    ///
    /// Where that is no range.
    pub fn within(&mut self, largest: f64) -> f64 {
        Uniform::new_inclusive(-largest, largest).expect("a range").sample(&mut self.0)
    }

    /// A direction.
    pub fn direction(&mut self) -> Vector3<f64> {
        self.normals().normalize()
    }

    /// An attitude, all alike.
    pub fn attitude(&mut self) -> Rotation3<f64> {
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            self.normal(),
            self.normal(),
            self.normal(),
            self.normal(),
        ))
        .to_rotation_matrix()
    }

    /// A triad with gains, axes and bias off: K within 3 % of identity, the bias within ±`bias`.
    pub fn triad(&mut self, vector_n: Vector3<f64>, bias: f64) -> UnifiedParameters<f64> {
        let mut parameters = UnifiedParameters::nominal(vector_n);
        parameters.sensitivity += Matrix3::from_fn(|_, _| self.within(0.03));
        parameters.bias = Vector3::from_fn(|_, _| self.within(bias));
        parameters
    }
}

/// The 24 rotations that bring a cube onto itself.
pub fn cube() -> Vec<Rotation3<f64>> {
    let axes = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
    axes.into_iter()
        .flat_map(|a| axes.into_iter().map(move |b| (a, b)))
        .filter(|(a, b)| a.dot(b) == 0.0)
        .map(|(a, b)| Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[a, b, a.cross(&b)])))
        .collect()
}

/// The encoders' angles of an attitude C_t_p of [`ZYX`].
pub fn angles(attitude: &Rotation3<f64>) -> Vector3<f64> {
    let (inner, middle, outer) = attitude.euler_angles();
    Vector3::new(outer, middle, inner)
}

/// What a sensor of these parameters puts out at encoder angles, with white noise.
pub fn poses(
    parameters: &UnifiedParameters<f64>,
    axes: RigAxes,
    angles: &[Vector3<f64>],
    sigma: f64,
    draw: &mut Draw,
) -> Poses {
    let poses = angles.iter().map(|angles| {
        let clean = parameters.predict(&GimbalPose::new(Vector3::zeros(), angles).rotations(&axes));
        GimbalPose::new(clean + draw.normals() * sigma, angles)
    });
    let spans = (0..angles.len()).map(|k| 6.0 * k as f64).map(|from| from..from + 4.0).collect();
    Poses { poses: poses.collect(), axes, spans, density: None }
}

/// Mean and standard deviation.
pub fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
