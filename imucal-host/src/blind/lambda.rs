//! How large an effect is in a recording: the whitened squared size of its signal, the baseline projected out.
//!
//! ```text
//! λ = min over c of (s − A c)ᵀ Σ⁻¹ (s − A c)      Σ = σ² / n · I + drift covariance of block centres
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | s | means over 1 s of what the effect changes in a run without noise, one sensor, three axes |
//! | A | what the baseline changes: bias and K of each axis, tilt and heading of the base for all axes |
//! | σ, n | white noise of a sample, samples in a block |
//!
//! K's columns are spanned by the outputs of the run without effects, and those of tilt and heading are the simulator's
//! difference quotients. Each sensor has a tilt and a heading of its own. Written apart from the diagnosis, which has
//! blocks, noise and derivatives of its own. Left out of Σ: the scatter of rests, rounding, drift within a block.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::{
    effect,
    recording::SensorKind,
    simulator::{Dose, OutputError, Simulation, SimulationError},
};

/// Length of a block, s.
const BLOCK: f64 = 1.0;
/// Rate of the runs without noise, Hz: effects vary within tenths of a second.
const RATE: f64 = 25.0;
/// Terms of the rig in the baseline, their parameters and a small value, rad.
const RIG: [(&str, usize); 3] = [("rig.level_tilt", 0), ("rig.level_tilt", 1), ("rig.heading", 0)];
const SMALL: f64 = 1e-4;
/// A column of which less than this share is left once the others are fitted is in their span.
const LEFT: f64 = 1e-5;

/// Block means of each sensor, by [`SensorKind::ALL`].
pub type Signal = [Vec<Vector3<f64>>; 3];

/// What one signal has and another has not.
pub fn difference(with: &Signal, without: &Signal) -> Signal {
    std::array::from_fn(|k| with[k].iter().zip(&without[k]).map(|(a, b)| a - b).collect())
}

/// The measure of effects in a recording.
#[derive(Clone, Debug)]
pub struct Lambda {
    simulation: Simulation,
    /// The run without effects.
    pub healthy: Signal,
    /// What small values of the rig's terms change in it.
    rig: Vec<Signal>,
    sensors: Vec<Measure>,
}

/// Whitens the block means of one sensor.
#[derive(Clone, Debug)]
struct Measure(Cholesky<f64, Dyn>);

/// What the baseline may change in the output of one sensor.
#[derive(Clone, Debug)]
struct Baseline<'a> {
    measure: &'a Measure,
    /// Orthonormal columns of one axis, whitened.
    axis: Vec<DVector<f64>>,
    /// Orthonormal columns of all axes, whitened.
    all: Vec<DVector<f64>>,
}

impl Lambda {
    /// For a recording without its effects.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when it cannot be simulated.
    pub fn new(simulation: &Simulation) -> Result<Self, SimulationError> {
        let unit = simulation.unit_under_test();
        let samples = (simulation.rate * BLOCK).max(1.0);
        let mut lambda = Self {
            simulation: Simulation {
                rate: RATE,
                noise: false,
                counts: false,
                doses: Vec::new(),
                ..simulation.clone()
            },
            healthy: Default::default(),
            rig: Vec::new(),
            sensors: Vec::new(),
        };
        lambda.healthy = lambda.run(&[])?;
        for (id, parameter) in RIG {
            let Some(effect) = effect::find(id) else { continue };
            let altered = |by: f64| {
                let mut values = effect.neutral(0.0);
                values.iter_mut().skip(parameter).take(1).for_each(|value| *value = by);
                lambda.run(&[Dose { effect, values }])
            };
            // To both sides: what is of second order is along the field itself, and would stand for K.
            let change = difference(&altered(SMALL)?, &altered(-SMALL)?);
            lambda.rig.push(change);
        }
        for kind in SensorKind::ALL {
            let triad = unit.triad(kind);
            let white = triad.noise * triad.noise / samples;
            let covariance = |one: f64, other: f64| triad.drift.covariance(one, other);
            let measure = Measure::new(lambda.healthy[kind as usize].len(), white, covariance);
            lambda.sensors.push(measure.ok_or(OutputError::Singular { sensor: kind })?);
        }
        Ok(lambda)
    }

    /// Block means of a run without noise, with effects.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when an effect is beyond reason.
    pub fn run(&self, doses: &[Dose]) -> Result<Signal, SimulationError> {
        let recording = Simulation { doses: doses.to_vec(), ..self.simulation.clone() }.record("")?;
        let rows = (RATE * BLOCK) as usize;
        Ok(SensorKind::ALL.map(|kind| {
            let values = recording.sensor(kind).map(|triple| triple.values.as_slice()).unwrap_or_default();
            let mean = |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>() / rows.len() as f64;
            values.chunks_exact(rows).map(mean).collect()
        }))
    }

    /// Length of the recording, s.
    pub fn duration(&self) -> f64 {
        BLOCK * self.healthy[0].len() as f64
    }

    /// λ of a signal by sensor, with what the signals `others` span projected out as well.
    pub fn of(&self, signal: &Signal, others: &[Signal]) -> [f64; 3] {
        self.squared(signal, &self.healthy, others)
    }

    /// λ of what is left of a run where another explains it and the baseline is fitted again: K acts on the other run's
    /// output, so that what an effect shares with the baseline may stand in either.
    pub fn remainder(&self, run: &Signal, explanation: &Signal) -> [f64; 3] {
        self.squared(run, explanation, &[])
    }

    fn squared(&self, signal: &Signal, output: &Signal, others: &[Signal]) -> [f64; 3] {
        std::array::from_fn(|k| {
            let Some(measure) = self.sensors.get(k) else { return 0.0 };
            let rig: Vec<&[Vector3<f64>]> = self.rig.iter().map(|signal| signal[k].as_slice()).collect();
            let others: Vec<&[Vector3<f64>]> = others.iter().map(|signal| signal[k].as_slice()).collect();
            measure.baseline(&output[k], &rig).squared(&signal[k], &others)
        })
    }
}

impl Measure {
    /// `None` where the noise has no variance.
    fn new(blocks: usize, white: f64, covariance: impl Fn(f64, f64) -> f64) -> Option<Self> {
        let centre = |k: usize| BLOCK * (k as f64 + 0.5);
        let sigma = DMatrix::from_fn(blocks, blocks, |i, j| {
            covariance(centre(i), centre(j)) + if i == j { white } else { 0.0 }
        });
        Some(Self(sigma.cholesky()?))
    }

    fn whitened(&self, column: &DVector<f64>) -> DVector<f64> {
        self.0.l_dirty().solve_lower_triangular(column).unwrap_or_else(|| DVector::zeros(column.len()))
    }

    /// K and b change each axis by any combination of the outputs and a constant, the rig all axes together.
    fn baseline<'a>(&'a self, output: &[Vector3<f64>], rig: &[&[Vector3<f64>]]) -> Baseline<'a> {
        let mut baseline = Baseline { measure: self, axis: Vec::new(), all: Vec::new() };
        let constant = DVector::from_element(output.len(), 1.0);
        for column in std::iter::once(constant).chain((0..3).map(|axis| column(output, axis))) {
            add_orthonormal(&mut baseline.axis, self.whitened(&column));
        }
        for signal in rig {
            let column = baseline.projected(signal);
            add_orthonormal(&mut baseline.all, column);
        }
        baseline
    }
}

impl Baseline<'_> {
    /// All axes, whitened, less bias and K.
    fn projected(&self, signal: &[Vector3<f64>]) -> DVector<f64> {
        let mut stacked = DVector::zeros(3 * signal.len());
        for axis in 0..3 {
            let mut whitened = self.measure.whitened(&column(signal, axis));
            project(&mut whitened, &self.axis);
            stacked.rows_mut(axis * signal.len(), signal.len()).copy_from(&whitened);
        }
        stacked
    }

    fn squared(&self, signal: &[Vector3<f64>], others: &[&[Vector3<f64>]]) -> f64 {
        let mut columns = self.all.clone();
        for signal in others {
            add_orthonormal(&mut columns, self.projected(signal));
        }
        let mut left = self.projected(signal);
        project(&mut left, &columns);
        left.norm_squared()
    }
}

fn column(signal: &[Vector3<f64>], axis: usize) -> DVector<f64> {
    DVector::from_iterator(signal.len(), signal.iter().map(|value| value[axis]))
}

/// Takes out of a vector what orthonormal columns span; twice, against rounding.
fn project(vector: &mut DVector<f64>, columns: &[DVector<f64>]) {
    for _ in 0..2 {
        for column in columns {
            let share = column.dot(vector);
            vector.axpy(-share, column, 1.0);
        }
    }
}

fn add_orthonormal(columns: &mut Vec<DVector<f64>>, mut column: DVector<f64>) {
    let before = column.norm();
    project(&mut column, columns);
    let left = column.norm();
    if left > LEFT * before {
        columns.push(column / left);
    }
}

/// The largest over the sensors.
pub fn largest(lambda: &[f64; 3]) -> f64 {
    lambda.iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Conditions, NoiseLevel, Programme};

    fn quiet_drift(programme: Programme) -> Simulation {
        let noise = [NoiseLevel { drift: 0.0, ..NoiseLevel::default() }; 3];
        let conditions = Conditions { noise, ..Conditions::default() };
        Simulation { programme, conditions, duration: Some(200.0), ..Simulation::default() }
    }

    fn dose(id: &str, values: &[f64]) -> Dose {
        Dose { effect: effect::find(id).unwrap(), values: values.to_vec() }
    }

    fn of(lambda: &Lambda, doses: &[Dose]) -> [f64; 3] {
        lambda.of(&difference(&lambda.run(doses).unwrap(), &lambda.healthy), &[])
    }

    #[test]
    fn a_step_under_white_noise_has_the_size_of_the_closed_form() {
        // Of c on N₁ blocks of N nothing but the mean is lost where the outputs, as here, hardly correlate with it.
        let simulation = quiet_drift(Programme::Mixed);
        let lambda = Lambda::new(&simulation).unwrap();
        let c = [0.01, -0.02, 0.03];
        let step = dose("acc.bias_step", &[c[0], c[1], c[2], 50.0, 150.0]);
        let found = of(&lambda, &[step]);
        let sigma = simulation.unit_under_test().acc.noise;
        let whole = (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) * simulation.rate / (sigma * sigma);
        let bound = whole * 100.0 * (1.0 - 0.5);
        assert!(found[0] <= bound * (1.0 + 1e-9) && found[0] > 0.7 * bound, "{found:?} {bound}");
        assert!(found[1] < 1e-12 && found[2] < 1e-12, "{found:?}");
    }

    #[test]
    fn the_closed_form_of_one_column_and_a_constant_holds() {
        let white = 0.25;
        let signal: Vec<Vector3<f64>> = (0..40).map(|k| Vector3::new(f64::from(k), 0.0, 0.0)).collect();
        let flat = vec![Vector3::zeros(); 40];
        let measure = Measure::new(40, white, |_, _| 0.0).unwrap();
        let measure = measure.baseline(&flat, &[]);
        // Σ (k − mean)² = N (N² − 1) / 12
        let expected = 40.0 * (40.0 * 40.0 - 1.0) / 12.0 / white;
        assert!((measure.squared(&signal, &[]) / expected - 1.0).abs() < 1e-12);
        // A constant offset common to all times that drifts as one is no information at all.
        let loose = Measure::new(40, white, |_, _| 1e6).unwrap();
        assert!((loose.baseline(&flat, &[]).squared(&signal, &[]) / expected - 1.0).abs() < 1e-6);
        assert!(measure.squared(&signal, &[&signal]) < 1e-9);
    }

    #[test]
    fn what_the_baseline_takes_up_has_no_size() {
        let lambda = Lambda::new(&quiet_drift(Programme::Mixed)).unwrap();
        for (id, values) in [
            ("acc.bias", vec![0.3, 0.2, -0.1]),
            ("gyr.scale", vec![0.01, 0.02, -0.01]),
            ("mag.misalignment", vec![0.01, 0.02, -0.01, 0.02, 0.01, 0.02]),
            ("acc.gravity_error", vec![1e-3]),
            ("mag.hard_iron", vec![1.0, 2.0, 3.0]),
        ] {
            let effect = effect::find(id).unwrap();
            assert_eq!(values.len(), effect.parameters.len(), "{id}");
            let signal = difference(&lambda.run(&[dose(id, &values)]).unwrap(), &lambda.healthy);
            let raw: f64 = signal.iter().flatten().map(|v| v.norm_squared()).sum();
            assert!(largest(&lambda.of(&signal, &[])) < 1e-6 * raw / 1e-4, "{id}");
        }
        let tilted = of(&lambda, &[dose("rig.level_tilt", &[1e-4, -2e-4])]);
        assert!(largest(&tilted) < 0.01, "{tilted:?}");
    }

    #[test]
    fn a_source_equals_another_up_to_what_the_baseline_takes_up() {
        let simulation = quiet_drift(Programme::Mixed);
        let lambda = Lambda::new(&simulation).unwrap();
        let run = |d: [f64; 3]| lambda.run(&[dose("mag.gimbal_hard_iron_middle", &d)]).unwrap();
        // The part along the inner axis, x, turns with the table.
        let (truth, explanation) = (run([0.5, 1.0, -1.0]), run([-1.5, 1.0, -1.0]));
        let whole = largest(&lambda.of(&difference(&truth, &lambda.healthy), &[]));
        assert!(largest(&lambda.remainder(&truth, &explanation)) < 1e-6 * whole);
        let half = largest(&lambda.remainder(&truth, &run([0.0, 0.5, -0.5])));
        assert!((half / whole - 0.25).abs() < 0.01, "{half} {whole}");
    }

    #[test]
    fn twice_the_effect_is_four_times_the_size_and_drift_makes_it_smaller() {
        let simulation = quiet_drift(Programme::Mixed);
        let lambda = Lambda::new(&simulation).unwrap();
        let at = |lambda: &Lambda, c: f64| of(lambda, &[dose("gyr.bias_drift", &[c, 0.0, 0.0])])[1];
        assert!((at(&lambda, 2e-6) / at(&lambda, 1e-6) - 4.0).abs() < 1e-3);
        let drifting = Simulation { conditions: Conditions::default(), ..simulation };
        assert!(at(&Lambda::new(&drifting).unwrap(), 1e-6) < 0.8 * at(&lambda, 1e-6));
    }
}
