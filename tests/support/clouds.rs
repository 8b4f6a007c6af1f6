//! Random magnetometer clouds with a known truth.

use imucal_core::triad::Triad;
use imucal_host::recording::{Nominal, Triple, Unit};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform, UnitSphere};

/// A cloud over a spherical cap.
#[derive(Clone, Debug)]
pub struct CapCloud {
    /// Share of the sphere that its directions fill, 0 to 1.
    pub coverage: f64,
    /// Noise as a share of the radius; zero for a clean one.
    pub noise: f64,
    /// The samples.
    pub sensor: Triple,
    /// Length of the field, calibrated unit.
    pub field: f64,
    /// What a calibration ought to find, raw unit in; gain upper triangular.
    pub truth: Triad<f64>,
}

impl CapCloud {
    /// A cloud drawn from a seed: 10 to 100 % of the sphere, 100 to 2000 points, noise of 0.2 to 1 % of the radius
    /// or (every other seed) none, soft iron of ±15 %, offsets of up to two radii, any unit.
    ///
    /// # Panics
    ///
    /// Never: the soft iron is too weak to make the gain singular.
    pub fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let uniform = |low: f64, high: f64, rng: &mut ChaCha8Rng| {
            Uniform::new_inclusive(low, high).expect("a range").sample(rng)
        };
        let count = uniform(100f64.ln(), 2000f64.ln(), &mut rng).exp().round() as usize;
        let coverage = uniform(0.1, 1.0, &mut rng);
        let level = uniform(0.002, 0.01, &mut rng);
        let noise = if seed.is_multiple_of(2) { 0.0 } else { level };
        let iron = Matrix3::identity() + Matrix3::from_fn(|_, _| uniform(-0.15, 0.15, &mut rng));
        // The upper triangular gain with the same |A x|.
        let upper = iron.tr_mul(&iron).cholesky().expect("regular").l().transpose();
        let bias = Vector3::from(UnitSphere.sample(&mut rng)) * uniform(0.0, 2.0, &mut rng);
        let axis = Vector3::from(UnitSphere.sample(&mut rng));
        let inverse = upper.try_inverse().expect("regular");
        // Units: of the SI side, of the calibrated side, and of the file.
        let (radius, field) =
            (10f64.powf(uniform(-2.0, 4.0, &mut rng)), 10f64.powf(uniform(-2.0, 4.0, &mut rng)));
        let nominal = Nominal {
            offset: uniform(-1e3, 1e3, &mut rng),
            per_unit: 10f64.powf(uniform(-2.0, 2.0, &mut rng)),
        };
        let values = (0..count)
            .map(|_| {
                let u = on_cap(&axis, coverage, &mut rng);
                let n = Vector3::from_fn(|_, _| {
                    let draw: f64 = StandardNormal.sample(&mut rng);
                    draw * noise
                });
                (inverse * u + bias + n) * radius
            })
            .collect();
        let nominal_truth = Triad { gain: upper * (field / radius), bias: bias * radius };
        Self {
            coverage,
            noise,
            sensor: Triple { values, unit: Unit::Counts, nominal, full_scale: None, single: false },
            field,
            truth: nominal_truth.in_unit(nominal.offset, nominal.per_unit),
        }
    }
}

/// A direction of the cap around `axis` that holds this share of the sphere.
fn on_cap(axis: &Vector3<f64>, coverage: f64, rng: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let u = Vector3::from(UnitSphere.sample(rng));
        if u.dot(axis) >= 1.0 - 2.0 * coverage {
            return u;
        }
    }
}
