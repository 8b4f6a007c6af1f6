//! What the fits are given: sensors of known errors and where they were taken, by formulas that host and device
//! evaluate alike (`f32`, libm by name, no platform maths).

use imucal_core::{
    observation::{Block, BlockBuilder, Durations, Moments, ShellPoint, Turn},
    rotation::exp,
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};

/// Samples of a rest.
const SAMPLES: usize = 8;
/// Turns from rest to rest.
pub const TURNS: usize = 12;
/// Blocks of a turn.
const BLOCKS: usize = 12;
/// Gyroscope samples of a block.
const BLOCK_SAMPLES: usize = 5;
/// Time between gyroscope samples, s.
const INTERVAL: f32 = 0.02;

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

    fn vector(&mut self, size: f32) -> Vector3<f32> {
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
    fn sample(&self, value: &Vector3<f32>, noise: &mut Noise) -> Vector3<f32> {
        self.truth.predict(value).unwrap_or_else(Vector3::zeros) + noise.vector(self.noise)
    }

    /// Mean of the samples of a rest.
    fn rest(&self, value: &Vector3<f32>, noise: &mut Noise) -> Vector3<f32> {
        let mut moments = Moments::default();
        for _ in 0..SAMPLES {
            moments.push(&self.sample(value, noise));
        }
        moments.mean()
    }

    /// Rests all over the sphere; `norm` is the length of what is measured.
    ///
    /// Observations are made in place: as values they would take their memory twice.
    pub fn rests(&self, points: &mut [ShellPoint<f32>], norm: f32, noise: &mut Noise) {
        let count = points.len();
        for (k, point) in points.iter_mut().enumerate() {
            point.value = self.rest(&(spiral(k, count) * norm), noise);
        }
    }

    /// Rests on the six faces in turn.
    pub fn faces(&self, points: &mut [ShellPoint<f32>], norm: f32, noise: &mut Noise) {
        for (k, point) in points.iter_mut().enumerate() {
            point.value = self.rest(&(face(k) * norm), noise);
        }
    }

    /// Single samples all over the sphere.
    pub fn cloud(&self, points: &mut [ShellPoint<f32>], norm: f32, noise: &mut Noise) {
        let count = points.len();
        for (k, point) in points.iter_mut().enumerate() {
            point.value = self.sample(&(spiral(k, count) * norm), noise);
        }
    }

    /// Turns from rest to rest, one after the other, less the bias that a rest before the first one gives: the
    /// result. `tilt` is the half-width of the error of a rest's direction, rad.
    pub fn motions(&self, motions: &mut [Motion; TURNS], tilt: f32, noise: &mut Noise) -> Vector3<f32> {
        let bias = self.rest(&Vector3::zeros(), noise);
        let mut down = Vector3::z();
        for (k, motion) in motions.iter_mut().enumerate() {
            motion.before = unit(&(down + noise.vector(tilt)));
            down = self.turn(&mut motion.blocks, k, &down, &bias, noise);
            motion.after = unit(&(down + noise.vector(tilt)));
        }
        bias
    }

    /// Turn `k`; where it takes the direction `down`.
    fn turn(
        &self,
        blocks: &mut [Block<f32>],
        k: usize,
        down: &Vector3<f32>,
        bias: &Vector3<f32>,
        noise: &mut Noise,
    ) -> Vector3<f32> {
        let mut down = *down;
        let mut builder = BlockBuilder::default();
        for (index, block) in blocks.iter_mut().enumerate() {
            for sample in 0..BLOCK_SAMPLES {
                let rate = rate(k, index * BLOCK_SAMPLES + sample);
                down = exp(&(rate * INTERVAL)).tr_mul(&down);
                builder.push(&(self.sample(&rate, noise) - bias), INTERVAL);
            }
            (*block, _) = builder.finish();
        }
        down
    }
}

/// A turn with its blocks; by default without motion.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    blocks: [Block<f32>; BLOCKS],
    before: Vector3<f32>,
    after: Vector3<f32>,
}

impl Default for Motion {
    fn default() -> Self {
        let (block, _) = BlockBuilder::default().finish();
        Self { blocks: [block; BLOCKS], before: Vector3::z(), after: Vector3::z() }
    }
}

impl Motion {
    /// As the model takes it.
    pub fn turn(&self) -> Turn<'_, f32> {
        Turn {
            blocks: &self.blocks,
            durations: Durations::Uniform(BLOCK_SAMPLES as f32 * INTERVAL),
            before: self.before,
            after: self.after,
        }
    }
}

/// Direction `index` of `count` on a Fibonacci spiral.
fn spiral(index: usize, count: usize) -> Vector3<f32> {
    const GOLDEN_ANGLE: f32 = 2.399_963_2;
    let z = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
    let radius = libm::sqrtf(1.0 - z * z);
    let azimuth = GOLDEN_ANGLE * index as f32;
    Vector3::new(radius * libm::cosf(azimuth), radius * libm::sinf(azimuth), z)
}

/// Face `index` of a cube, over and over.
fn face(index: usize) -> Vector3<f32> {
    let axis = match index % 3 {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    if index % 6 < 3 { axis } else { -axis }
}

/// Rate of sample `sample` of turn `turn`, rad/s: up and down about one axis, with a wobble across it.
fn rate(turn: usize, sample: usize) -> Vector3<f32> {
    const SAMPLES: f32 = (BLOCKS * BLOCK_SAMPLES) as f32;
    let axis = spiral(turn, TURNS);
    let across = unit(&axis.cross(&Vector3::new(0.6, -0.64, 0.48)));
    let phase = core::f32::consts::PI * (sample as f32 + 0.5) / SAMPLES;
    axis * (2.4 * libm::sinf(phase)) + across * (0.5 * libm::sinf(4.0 * phase))
}

/// A vector at unit length.
pub fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v / libm::sqrtf(v.dot(v))
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

/// Accelerometer whose axes are at right angles, nominal m/s².
pub fn square_accelerometer() -> Sensor {
    Sensor {
        truth: Triad {
            gain: Matrix3::from_diagonal(&Vector3::new(0.99, 1.015, 1.004)),
            bias: Vector3::new(-0.08, 0.27, 0.11),
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

/// Magnetometer beside iron, nominal µT.
pub fn magnetometer() -> Sensor {
    Sensor {
        truth: Triad {
            gain: Matrix3::new(1.12, 0.05, -0.03, 0.0, 0.94, 0.04, 0.0, 0.0, 1.03),
            bias: Vector3::new(18.0, -31.0, 12.5),
        },
        noise: 0.6,
    }
}
