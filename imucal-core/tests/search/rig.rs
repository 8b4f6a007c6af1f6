//! A three-axis rig in motion, and a gyroscope on it. Attitudes come first and rates from them, so that the encoders
//! and the sensor always tell of the same motion.

use imucal_core::{
    observation::{Block, BlockBuilder, Compared, Durations, Motion},
    rotation::{exp, log, quaternion},
    scalar::Scalar,
    triad::Triad,
};
use nalgebra::{Matrix3, Quaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Interval of the samples, s.
pub const DT: f64 = 0.01;
/// Samples of 100 s.
pub const SAMPLES: usize = 10_000;
/// Rest before the first slew, s.
pub const STILL: f64 = 10.0;
/// Earth rate, rad/s.
pub const EARTH: f64 = 7.292_115e-5;
/// Latitude of the rig: Ankara, degrees.
const LATITUDE: f64 = 39.9;
/// Slew and rest that follow one another, s.
const SLEW: f64 = 3.0;
const REST: f64 = 1.5;

/// A number in `from..to`.
pub fn within(rng: &mut impl Rng, reach: f64) -> f64 {
    reach * (2.0 * rng.random::<f64>() - 1.0)
}

/// A normal deviate (Box & Muller).
fn normal(rng: &mut impl Rng) -> f64 {
    let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// What the encoders and an ideal sensor see.
pub struct Recording {
    /// `C_r_p` before each sample, and after the last.
    pub attitudes: Vec<Matrix3<f64>>,
    /// Mean rate of the table against the base during each sample, table axes, rad/s.
    pub rates: Vec<Vector3<f64>>,
    /// Mean Earth rate during each sample, table axes, rad/s.
    pub earth: Vec<Vector3<f64>>,
    /// Mean specific force during each sample, table axes, m/s².
    pub force: Vec<Vector3<f64>>,
}

impl Recording {
    /// From the attitude at each time, s.
    pub fn of(samples: usize, attitude: impl Fn(f64) -> Matrix3<f64>) -> Self {
        let attitudes: Vec<_> = (0..=samples).map(|k| attitude(k as f64 * DT)).collect();
        let (sin, cos) = LATITUDE.to_radians().sin_cos();
        let fixed =
            |v: Vector3<f64>| (0..samples).map(|k| attitude((k as f64 + 0.5) * DT).tr_mul(&v)).collect();
        Self {
            rates: attitudes.windows(2).map(|c| log(&c[0].tr_mul(&c[1])) / DT).collect(),
            earth: fixed(Vector3::new(cos, 0.0, -sin) * EARTH),
            force: fixed(Vector3::new(0.0, 0.0, -9.799)),
            attitudes,
        }
    }

    /// 100 s: a rest of 10 s, then slews of up to 150° on all three gimbals at once with rests between.
    pub fn slews(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut poses = vec![Vector3::zeros()];
        for k in 0..21 {
            poses.push(
                Vector3::from_fn(|_, _| within(&mut rng, 75f64.to_radians())) + poses[0] * f64::from(k),
            );
        }
        Self::of(SAMPLES, move |time| {
            let since = (time - STILL).max(0.0);
            let leg = (since / (SLEW + REST)).floor();
            let share = ((since - leg * (SLEW + REST)) / SLEW).min(1.0);
            let eased = share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share);
            let (from, to) = (poses[leg as usize], poses[leg as usize + 1]);
            let angles = from + (to - from) * eased;
            exp(&(Vector3::z() * angles.z))
                * exp(&(Vector3::y() * angles.y))
                * exp(&(Vector3::x() * angles.x))
        })
    }

    /// What a sensor puts out, `K (ω + e) + b + G f + n`, K = gain⁻¹, `noise` in rad/s a sample.
    pub fn measured(&self, truth: &Sensor, noise: f64, rng: &mut impl Rng) -> Vec<Vector3<f64>> {
        let sensitivity = truth.triad.sensitivity().unwrap();
        let ideal = self.rates.iter().zip(&self.earth).zip(&self.force);
        ideal
            .map(|((rate, earth), force)| {
                let n = Vector3::from_fn(|_, _| normal(rng) * noise);
                sensitivity * (rate + earth) + truth.triad.bias + truth.sensitivity * force + n
            })
            .collect()
    }

    /// The attitude at the end by the product over samples, and at each block's end on the way.
    pub fn exact(&self, raw: &[Vector3<f64>], triad: &Triad<f64>) -> Vec<Matrix3<f64>> {
        let mut c = self.attitudes[0];
        raw.iter()
            .zip(&self.earth)
            .map(|(rate, earth)| {
                c *= exp(&((triad.correct(rate) - earth) * DT));
                c
            })
            .collect()
    }

    /// Blocks of `size` samples, compared after every `every` blocks.
    pub fn compress<T: Scalar>(&self, raw: &[Vector3<f64>], size: usize, every: u32) -> Compressed<T> {
        let blocks = raw.chunks_exact(size).map(|samples| {
            let mut builder = BlockBuilder::default();
            samples.iter().for_each(|rate| builder.push(&rate.map(T::of), T::of(DT)));
            builder.finish().0
        });
        let mean = |values: &[Vector3<f64>]| {
            let means = values.chunks_exact(size).map(|v| v.iter().sum::<Vector3<f64>>() / size as f64);
            means.map(|v| v.map(T::of)).collect()
        };
        let narrow = |c: &Matrix3<f64>| Quaternion::from_vector(quaternion(c).coords.map(T::of));
        Compressed {
            blocks: blocks.collect(),
            duration: T::of(DT * size as f64),
            earth: mean(&self.earth),
            force: mean(&self.force),
            start: narrow(&self.attitudes[0]),
            references: self.attitudes.iter().step_by(size * every as usize).skip(1).map(narrow).collect(),
            every,
        }
    }
}

/// A gyroscope's true parameters.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    pub triad: Triad<f64>,
    /// G, rad/s per m/s².
    pub sensitivity: Matrix3<f64>,
}

impl Sensor {
    /// Changes nothing.
    pub fn ideal() -> Self {
        Self { triad: Triad::identity(), sensitivity: Matrix3::zeros() }
    }

    /// Scale wrong by up to `scale` on each axis, axes askew by up to half as much, bias up to `bias`, rad/s.
    pub fn drawn(rng: &mut impl Rng, scale: f64, bias: f64) -> Self {
        let k =
            Matrix3::from_fn(|i, j| if i == j { 1.0 + within(rng, scale) } else { within(rng, 0.5 * scale) });
        let bias = Vector3::from_fn(|_, _| within(rng, bias));
        Self { triad: Triad { gain: k.try_inverse().unwrap(), bias }, sensitivity: Matrix3::zeros() }
    }
}

/// A recording as a device holds it.
pub struct Compressed<T: Scalar> {
    pub blocks: Vec<Block<T>>,
    pub duration: T,
    pub earth: Vec<Vector3<T>>,
    pub force: Vec<Vector3<T>>,
    pub start: Quaternion<T>,
    pub references: Vec<Quaternion<T>>,
    pub every: u32,
}

impl<T: Scalar> Compressed<T> {
    pub fn motion(&self) -> Motion<'_, T> {
        Motion {
            blocks: &self.blocks,
            durations: Durations::Uniform(self.duration),
            earth: &self.earth,
            force: &self.force,
            start: self.start,
            references: &self.references,
            compared: Compared::Every(self.every),
        }
    }
}
