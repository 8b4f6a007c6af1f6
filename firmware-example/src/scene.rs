//! What the fits are given: sensors of known errors and where they were taken, by formulas that host and device
//! evaluate alike (`f32`, libm by name, no platform maths).

use imucal_core::{observation::Moments, triad::Triad};
use nalgebra::{Matrix3, Vector3};

/// Samples of a rest.
const SAMPLES: usize = 8;

/// Numbers without a pattern: the linear congruential generator of *Numerical Recipes*.
#[derive(Clone, Copy, Debug)]
pub struct Noise(pub u32);

impl Noise {
    /// Uniform on ±`size`, unit of `size`.
    fn next(&mut self, size: f32) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let high = i32::from((self.0 >> 16) as u16) - 32_768;
        high as f32 / 32_768.0 * size
    }

    /// Three of them.
    pub fn vector(&mut self, size: f32) -> Vector3<f32> {
        let (x, y, z) = (self.next(size), self.next(size), self.next(size));
        Vector3::new(x, y, z)
    }
}

/// A sensor and what it puts out.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    /// The calibration that undoes its errors.
    pub truth: Triad<f32>,
    /// Half-width of its samples' uniform noise, nominal SI.
    pub noise: f32,
}

impl Sensor {
    /// One sample, nominal SI, of the calibrated `value`; a sensor of singular gain puts out zeros.
    pub fn sample(&self, value: &Vector3<f32>, noise: &mut Noise) -> Vector3<f32> {
        self.truth.predict(value).unwrap_or_else(Vector3::zeros) + noise.vector(self.noise)
    }

    /// Mean of the samples of a rest.
    pub fn rest(&self, value: &Vector3<f32>, noise: &mut Noise) -> Vector3<f32> {
        let mut moments = Moments::default();
        for _ in 0..SAMPLES {
            moments.push(&self.sample(value, noise));
        }
        moments.mean()
    }
}

/// A vector at unit length.
pub fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v / libm::sqrtf(v.dot(v))
}

/// Direction `index` of `count` on a Fibonacci spiral.
pub fn spiral(index: usize, count: usize) -> Vector3<f32> {
    const GOLDEN_ANGLE: f32 = 2.399_963_2;
    let z = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
    let radius = libm::sqrtf(1.0 - z * z);
    let azimuth = GOLDEN_ANGLE * index as f32;
    Vector3::new(radius * libm::cosf(azimuth), radius * libm::sinf(azimuth), z)
}

/// Rate of sample `sample` of turn `turn` of `turns`, rad/s: up and down about one axis, with a wobble across it.
pub fn rate(turn: usize, turns: usize, sample: usize) -> Vector3<f32> {
    const SAMPLES: f32 = 60.0;
    let axis = spiral(turn, turns);
    let across = unit(&axis.cross(&Vector3::new(0.6, -0.64, 0.48)));
    let phase = core::f32::consts::PI * (sample as f32 + 0.5) / SAMPLES;
    axis * (2.4 * libm::sinf(phase)) + across * (0.5 * libm::sinf(4.0 * phase))
}

/// Accelerometer, nominal m/s².
pub fn accelerometer() -> Sensor {
    Sensor {
        truth: Triad {
            gain: Matrix3::new(1.02, -0.011, 0.006, 0.0, 0.985, 0.009, 0.0, 0.0, 1.013),
            bias: Vector3::new(0.21, -0.13, 0.34),
        },
        noise: 0.02,
    }
}

/// Gyroscope, nominal rad/s.
pub fn gyroscope() -> Sensor {
    Sensor {
        truth: Triad {
            gain: Matrix3::new(1.03, 0.012, -0.008, -0.006, 0.98, 0.015, 0.009, -0.011, 1.01),
            bias: Vector3::new(0.02, -0.035, 0.011),
        },
        noise: 0.002,
    }
}

/// Magnetometer near iron, nominal µT.
pub fn magnetometer() -> Sensor {
    Sensor {
        truth: Triad {
            gain: Matrix3::new(1.12, 0.05, -0.03, 0.0, 0.94, 0.04, 0.0, 0.0, 1.03),
            bias: Vector3::new(18.0, -31.0, 12.5),
        },
        noise: 0.6,
    }
}
