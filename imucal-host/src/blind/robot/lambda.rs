//! How large an effect is in a robot's recording: the whitened squared size of its signal, with bias, K and mounting of each
//! triad, the clock and other effects projected out.
//!
//! ```text
//! λ = min over c of (s − A c)ᵀ Σ⁻¹ (s − A c),   Σ = D + Z C Zᵀ
//! Σ⁻¹ = D⁻¹ − D⁻¹ Z (C⁻¹ + Zᵀ D⁻¹ Z)⁻¹ Zᵀ D⁻¹
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | s | means over some 20 ms of what the effect changes in a recording without noise, all sensors |
//! | A | outputs of the triad and a constant for each axis; the clock's offset and rate for all sensors at once |
//! | D | white noise, rounding and vibration of a mean, which grows with the robot's effort, and the square of what a mean of the simulator's stream is off between its samples |
//! | C, Z | covariance of the drift at knots some seconds apart, and straight lines between them |
//!
//! Written apart from the diagnosis. Left out: lost rows, and that a ring of the vibration is not white.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::{
    blind::lambda::{Signal, difference},
    recording::{SensorKind, Stream},
    simulator::{
        Dose, Motion, OutputError, SimulationError, StreamClock, Streamed,
        robot::{RobotScene, mismatch::MismatchKind},
        unit::Drift,
    },
};

/// Length of a block, s.
const BLOCK: f64 = 0.02;
/// Distance of the drift's knots, s: less than its shortest memory, and at most so many knots.
const KNOT: f64 = 4.0;
/// Small changes of the clock: s, and a share.
const CLOCK: (f64, f64) = (1e-4, 1e-6);
/// A column of which less than this share is left once the others are fitted is in their span.
const LEFT: f64 = 1e-5;
/// Share of the drift's variance that keeps its covariance regular.
const RIDGE: f64 = 1e-6;

/// The measure of effects in a pair.
#[derive(Clone, Debug)]
pub struct RobotLambda {
    scene: RobotScene,
    /// The recording without effects.
    pub healthy: Signal,
    metrics: [Metric; 3],
    /// Of each sensor, orthonormal: a constant and the outputs.
    triads: [Vec<Column>; 3],
    /// Of all sensors, orthonormal: the clock.
    clock: Vec<[Column; 9]>,
}

/// A column of one axis, and Σ⁻¹ times it.
#[derive(Clone, Debug)]
struct Column {
    values: DVector<f64>,
    weighted: DVector<f64>,
}

/// Σ⁻¹ of one axis of a sensor.
#[derive(Clone, Debug)]
struct Metric {
    /// 1 / D.
    weights: DVector<f64>,
    /// For each block the knot before it, and how far it is on the way to the next; empty without drift.
    between: Vec<(usize, f64)>,
    inner: Option<Cholesky<f64, Dyn>>,
}

impl RobotLambda {
    /// For a pair without its effects.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when it cannot be simulated.
    pub fn new(scene: &RobotScene) -> Result<Self, SimulationError> {
        let bare = RobotScene {
            noise: false,
            counts: false,
            dropped: 0.0,
            doses: Vec::new(),
            mismatch: None,
            ..scene.clone()
        };
        let healthy = run(&bare)?;
        let metrics = metrics(scene, healthy[0].len())?;
        let triads = SensorKind::ALL.map(|kind| {
            let (metric, output) = (&metrics[kind as usize], &healthy[kind as usize]);
            let constant = DVector::from_element(output.len(), 1.0);
            let mut columns = Vec::new();
            for values in std::iter::once(constant).chain((0..3).map(|axis| axis_of(output, axis))) {
                add(&mut columns, values, metric);
            }
            columns
        });
        let mut lambda = Self { scene: bare, healthy, metrics, triads, clock: Vec::new() };
        let (offset, rate) = CLOCK;
        for (offset, rate) in [(offset, 0.0), (0.0, rate)] {
            let altered = RobotScene {
                clock_offset: lambda.scene.clock_offset + offset,
                clock_rate_error: lambda.scene.clock_rate_error + rate,
                ..lambda.scene.clone()
            };
            let change = difference(&run(&altered)?, &lambda.healthy);
            let columns = std::mem::take(&mut lambda.clock);
            lambda.clock = lambda.with(columns, &change);
        }
        Ok(lambda)
    }

    /// Block means of the recording without noise, with effects.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when an effect is beyond reason.
    pub fn run(&self, doses: &[Dose]) -> Result<Signal, SimulationError> {
        run(&RobotScene { doses: doses.to_vec(), ..self.scene.clone() })
    }

    /// Likewise, of a robot that moves otherwise than its simulator says.
    ///
    /// # Errors
    ///
    /// As [`Self::run`].
    pub fn run_otherwise(&self, mismatch: (MismatchKind, f64)) -> Result<Signal, SimulationError> {
        run(&RobotScene { mismatch: Some(mismatch), ..self.scene.clone() })
    }

    /// λ of a signal, with what the signals `others` span projected out as well.
    pub fn of(&self, signal: &Signal, others: &[Signal]) -> f64 {
        let columns = others.iter().fold(self.clock.clone(), |columns, other| self.with(columns, other));
        self.projected(signal, &columns).iter().map(Column::squared).sum()
    }

    /// Orthonormal columns of all axes, and what a signal adds to them.
    fn with(&self, mut columns: Vec<[Column; 9]>, signal: &Signal) -> Vec<[Column; 9]> {
        let whole: f64 = self.projected(signal, &[]).iter().map(Column::squared).sum();
        let left = self.projected(signal, &columns);
        let square: f64 = left.iter().map(Column::squared).sum();
        if square > LEFT * LEFT * whole {
            let norm = libm::sqrt(square);
            columns.push(
                left.map(|column| Column { values: column.values / norm, weighted: column.weighted / norm }),
            );
        }
        columns
    }

    /// A signal less what the triads' terms and some columns of all axes span.
    fn projected(&self, signal: &Signal, columns: &[[Column; 9]]) -> [Column; 9] {
        let mut left: [Column; 9] = std::array::from_fn(|at| {
            let metric = &self.metrics[at / 3];
            let mut values = axis_of(&signal[at / 3], at % 3);
            take(&mut values, &self.triads[at / 3]);
            Column::new(values, metric)
        });
        // Twice, against rounding.
        for column in columns.iter().chain(columns) {
            let share: f64 = left.iter().zip(column).map(|(l, c)| l.values.dot(&c.weighted)).sum();
            for (left, column) in left.iter_mut().zip(column) {
                left.values.axpy(-share, &column.values, 1.0);
                left.weighted.axpy(-share, &column.weighted, 1.0);
            }
        }
        left
    }
}

impl Column {
    fn new(values: DVector<f64>, metric: &Metric) -> Self {
        Self { weighted: metric.weighted(&values), values }
    }

    fn squared(&self) -> f64 {
        self.values.dot(&self.weighted)
    }
}

impl Metric {
    fn weighted(&self, values: &DVector<f64>) -> DVector<f64> {
        let mut weighted = values.component_mul(&self.weights);
        let Some(inner) = &self.inner else { return weighted };
        let mut knots = DVector::zeros(inner.l_dirty().nrows());
        for (value, (knot, share)) in weighted.iter().zip(&self.between) {
            knots[*knot] += value * (1.0 - share);
            knots[knot + 1] += value * share;
        }
        let knots = inner.solve(&knots);
        for ((value, weight), (knot, share)) in
            weighted.iter_mut().zip(self.weights.iter()).zip(&self.between)
        {
            *value -= weight * (knots[*knot] * (1.0 - share) + knots[knot + 1] * share);
        }
        weighted
    }

    /// `None` where the drift's covariance cannot be inverted.
    fn new(variances: &[f64], drift: &Drift, duration: f64) -> Option<Self> {
        let weights = DVector::from_iterator(variances.len(), variances.iter().map(|v| 1.0 / v));
        if drift.sigma == 0.0 {
            return Some(Self { weights, between: Vec::new(), inner: None });
        }
        let spans = (duration / KNOT).ceil().max(1.0) as usize;
        let step = duration / spans as f64;
        let between: Vec<(usize, f64)> = (0..variances.len())
            .map(|block| {
                let at = duration * (block as f64 + 0.5) / variances.len() as f64 / step;
                let knot = (at as usize).min(spans - 1);
                (knot, at - knot as f64)
            })
            .collect();
        let ridge = RIDGE * drift.sigma * drift.sigma;
        let covariance = DMatrix::from_fn(spans + 1, spans + 1, |i, j| {
            drift.covariance(step * i as f64, step * j as f64) + if i == j { ridge } else { 0.0 }
        });
        let mut inner = covariance.cholesky()?.inverse();
        for (weight, (knot, share)) in weights.iter().zip(&between) {
            let (a, b) = (1.0 - share, *share);
            inner[(*knot, *knot)] += weight * a * a;
            inner[(knot + 1, knot + 1)] += weight * b * b;
            inner[(*knot, knot + 1)] += weight * a * b;
            inner[(knot + 1, *knot)] += weight * a * b;
        }
        Some(Self { weights, between, inner: Some(inner.cholesky()?) })
    }
}

fn add(columns: &mut Vec<Column>, mut values: DVector<f64>, metric: &Metric) {
    let before = Column::new(values.clone(), metric).squared();
    take(&mut values, columns);
    let left = Column::new(values, metric);
    let square = left.squared();
    if square > LEFT * LEFT * before {
        let norm = libm::sqrt(square);
        columns.push(Column { values: left.values / norm, weighted: left.weighted / norm });
    }
}

/// Takes out of values what orthonormal columns span; twice, against rounding.
fn take(values: &mut DVector<f64>, columns: &[Column]) {
    for column in columns.iter().chain(columns) {
        let share = column.weighted.dot(values);
        values.axpy(-share, &column.values, 1.0);
    }
}

fn axis_of(signal: &[Vector3<f64>], axis: usize) -> DVector<f64> {
    DVector::from_iterator(signal.len(), signal.iter().map(|value| value[axis]))
}

/// Rows of a block.
fn rows(scene: &RobotScene) -> usize {
    (BLOCK * scene.real_rate).round().max(1.0) as usize
}

fn run(scene: &RobotScene) -> Result<Signal, SimulationError> {
    let recording = scene.real("")?;
    Ok(SensorKind::ALL.map(|kind| {
        let values = recording.sensor(kind).map(|triple| triple.values.as_slice()).unwrap_or_default();
        let mean = |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>() / rows.len() as f64;
        values.chunks_exact(rows(scene)).map(mean).collect()
    }))
}

fn metrics(scene: &RobotScene, blocks: usize) -> Result<[Metric; 3], SimulationError> {
    let (unit, shaking, motion) = (scene.unit_under_test(), scene.shaking(), scene.planned()?);
    let rows = rows(scene) as f64;
    let length = rows / scene.real_rate;
    let effort = |block: usize| motion.trajectory.effort(scene.shown((block as f64 + 0.5) * length));
    let efforts: Vec<f64> = (0..blocks).map(effort).collect();
    let unresolved = unresolved(scene, blocks)?;
    let of = |kind: SensorKind| {
        let triad = unit.triad(kind);
        let step = 1.0 / triad.counts.per_unit;
        let still = triad.noise * triad.noise + step * step / 12.0;
        let variance = |(effort, unresolved): (&f64, &f64)| {
            let shaken = shaking.size[kind as usize] * effort;
            (still + shaken * shaken) / rows + unresolved
        };
        let variances: Vec<f64> = efforts.iter().zip(&unresolved[kind as usize]).map(variance).collect();
        Metric::new(&variances, &triad.drift, blocks as f64 * length)
            .ok_or(SimulationError::Output(OutputError::Singular { sensor: kind }))
    };
    Ok([of(SensorKind::Acc)?, of(SensorKind::Gyr)?, of(SensorKind::Mag)?])
}

/// Mean square over the axes of what a block's mean of the stream, read between its samples, is off, by sensor: what no one
/// can know who has the stream alone.
fn unresolved(scene: &RobotScene, blocks: usize) -> Result<[Vec<f64>; 3], SimulationError> {
    let (motion, rows) = (scene.planned()?, rows(scene));
    let time: Vec<f64> = (0..blocks * rows).map(|row| row as f64 / scene.real_rate).collect();
    let clock = StreamClock::even(scene.clock_offset, scene.clock_rate_error);
    let stream = Stream::of(&scene.simulated("")?);
    let streamed =
        stream.and_then(|stream| Streamed::new(&stream, clock, &time, vec![0.0; time.len()], scene.place));
    let Some(streamed) = streamed else { return Ok(std::array::from_fn(|_| vec![0.0; blocks])) };
    let off = |time: &f64| {
        let [read, true_] = [streamed.truth(*time, &|_| ()), motion.truth(scene.shown(*time), &|_| ())];
        [read.f_t - true_.f_t, read.w_it_t - true_.w_it_t, read.b_t - true_.b_t]
    };
    let of_block = |times: &[f64]| {
        let sum =
            times.iter().map(off).fold([Vector3::zeros(); 3], |sum, off| [0, 1, 2].map(|k| sum[k] + off[k]));
        sum.map(|sum| sum.norm_squared() / (3 * rows * rows) as f64)
    };
    let squares: Vec<[f64; 3]> = time.chunks_exact(rows).map(of_block).collect();
    Ok([0, 1, 2].map(|kind| squares.iter().map(|square| square[kind]).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect,
        simulator::{DriftKind, NoiseLevel, robot::RobotKind},
    };

    fn scene(drift: f64) -> RobotScene {
        let levels = [NoiseLevel { drift, kind: DriftKind::Slow, ..NoiseLevel::default() }; 3];
        RobotScene {
            kind: RobotKind::Wheeled,
            duration: 60.0,
            vibration: 0.0,
            levels,
            ..RobotScene::default()
        }
    }

    fn signal(lambda: &RobotLambda, id: &str, values: &[f64]) -> Signal {
        let dose = Dose { effect: effect::find(id).unwrap(), values: values.to_vec() };
        difference(&lambda.run(&[dose]).unwrap(), &lambda.healthy)
    }

    #[test]
    fn what_bias_gain_mount_and_clock_change_has_no_size() {
        let lambda = RobotLambda::new(&scene(0.0)).unwrap();
        for (id, values) in [
            ("acc.bias", vec![0.3, 0.2, -0.1]),
            ("gyr.scale", vec![0.01, 0.02, -0.01]),
            ("mag.misalignment", vec![0.01, 0.02, -0.01, 0.02, 0.01, 0.02]),
            ("clk.time_offset", vec![1e-5]),
            ("clk.rate_error", vec![1e-7]),
        ] {
            let signal = signal(&lambda, id, &values);
            let bare: f64 = (0..9)
                .map(|at| Column::new(axis_of(&signal[at / 3], at % 3), &lambda.metrics[at / 3]).squared())
                .sum();
            let left = lambda.of(&signal, &[]);
            assert!(left < 1e-4 * bare, "{id}: {left} of {bare}");
        }
    }

    #[test]
    fn a_step_under_white_noise_has_the_size_of_the_closed_form_and_drift_makes_it_smaller() {
        let step = |drift: f64| {
            let lambda = RobotLambda::new(&scene(drift)).unwrap();
            lambda.of(&signal(&lambda, "acc.bias_step", &[0.01, 0.0, 0.0, 15.0, 45.0]), &[])
        };
        let unit = scene(0.0).unit_under_test();
        let quantum = 1.0 / unit.acc.counts.per_unit;
        let variance = unit.acc.noise * unit.acc.noise + quantum * quantum / 12.0;
        // Half of the time up, half down; of a constant a half is lost, and the outputs follow it little.
        let bound = 0.01 * 0.01 * 200.0 / variance * 30.0 * 0.5;
        let found = step(0.0);
        assert!(found <= bound * (1.0 + 1e-9) && found > 0.6 * bound, "{found} {bound}");
        assert!(step(3.0) < 0.9 * found);
    }

    #[test]
    fn another_effect_of_the_same_signal_leaves_nothing_and_twice_as_much_is_four_times_the_size() {
        let lambda = RobotLambda::new(&scene(1.0)).unwrap();
        let of = |size: f64| {
            signal(&lambda, "gyr.g_sensitivity", &[size, 0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, 0.0])
        };
        let (one, two) = (of(1e-4), of(2e-4));
        let ratio = lambda.of(&two, &[]) / lambda.of(&one, &[]);
        assert!((ratio - 4.0).abs() < 1e-6, "{ratio}");
        assert!(lambda.of(&one, std::slice::from_ref(&two)) < 1e-6 * lambda.of(&one, &[]));
        assert!(lambda.of(&one, &[]) > 0.0);
    }
}
