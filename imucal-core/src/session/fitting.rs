//! Fits of a session, by slices: one iteration of Levenberg–Marquardt, or one judgement.
//!
//! The accelerometer comes first, since its directions at rest are what the gyroscope is fitted to. Gross outliers are left out in
//! up to two rounds, each of which begins where the last one ended.

use heapless::Vec;
use nalgebra::{Matrix3, SVector, Vector3};

use super::{
    Session,
    bias::{MeanRate, RestBias},
    evidence::{Cloud, Rests, Turns, Used},
};
use crate::{
    accept::{Limits, outlier},
    model::{
        Model, Parameterisation, SquaredSum,
        parameterisation::{FULL_GAIN, UPPER_TRIANGULAR},
    },
    observation::Moments,
    observer::cloud::Slot,
    record::Sensor,
    solver::{LevenbergMarquardt, triangular::Triangular},
    triad::Triad,
};

/// Rounds in which outliers are left out.
const ROUNDS: u8 = 2;
/// Turns at least.
pub(super) const LEAST_TURNS: usize = 8;

/// A fit under way.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) sensor: Sensor,
    pub(super) solver: LevenbergMarquardt<f32, 9>,
    pub(super) used: Used,
    rounds: u8,
    /// Length that the vectors have.
    pub(super) norm: f32,
    /// The gyroscope's bias.
    pub(super) bias: Option<RestBias<f32>>,
    /// The cloud's radius, raw unit.
    radius: f32,
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// One slice of what is to be done; false where there is nothing.
    pub fn work(&mut self) -> bool {
        if core::mem::take(&mut self.sense_due) {
            self.end_gyroscope();
            return true;
        }
        let Some(fit) = self.fit.take() else { return self.begin() };
        self.go_on(fit);
        true
    }

    fn is_due(&mut self, sensor: Sensor) -> bool {
        self.due.get_mut(sensor as usize).is_some_and(core::mem::take)
    }

    /// Begins the fit that is due.
    #[inline(never)]
    fn begin(&mut self) -> bool {
        self.fit = if self.is_due(Sensor::Accelerometer) {
            self.mark(Sensor::Gyroscope);
            self.begin_accelerometer().or_else(|| self.without(Sensor::Accelerometer))
        } else if self.is_due(Sensor::Gyroscope) {
            self.begin_gyroscope().or_else(|| self.without(Sensor::Gyroscope))
        } else if self.is_due(Sensor::Magnetometer) {
            self.new_points = 0;
            self.begin_magnetometer()
        } else {
            return false;
        };
        true
    }

    /// What an estimate was made from is no longer there: it does not stand, and there is no fit.
    fn without(&mut self, sensor: Sensor) -> Option<Fit> {
        if let Some(estimate) = self.estimates.get_mut(sensor as usize) {
            *estimate = None;
        }
        None
    }

    fn begin_accelerometer(&self) -> Option<Fit> {
        let limits = acc_limits();
        (self.poses.list().len() >= limits.observations).then(|| {
            self.from(Sensor::Accelerometer, UPPER_TRIANGULAR, &Triad::identity(), self.settings.gravity)
        })
    }

    fn begin_gyroscope(&self) -> Option<Fit> {
        self.estimate(Sensor::Accelerometer).filter(|acc| acc.verdict.is_ok())?;
        let turns = self.poses.list().iter().filter(|pose| pose.has_turn()).count();
        let rates = self.poses.list().iter().filter(|pose| pose.gyr.x.is_finite());
        let bias = RestBias::of(rates.map(|pose| MeanRate {
            mean: pose.gyr,
            variance: Vector3::repeat(pose.rate_variance),
            count: pose.samples,
        }));
        (turns >= LEAST_TURNS)
            .then(|| Fit { bias, ..self.from(Sensor::Gyroscope, FULL_GAIN, &Triad::identity(), 1.0) })
    }

    /// From a sphere through the cloud, in whose gauge it stays where the field is not known.
    pub(super) fn begin_magnetometer(&self) -> Option<Fit> {
        let (centre, radius) = sphere(self.cloud.slots())?;
        let norm = self.settings.field.unwrap_or(radius);
        let gain = Matrix3::from_diagonal_element(norm / radius);
        let start = Triad { gain, bias: centre };
        (self.cloud.slots().len() >= acc_limits().observations)
            .then(|| Fit { radius, ..self.from(Sensor::Magnetometer, UPPER_TRIANGULAR, &start, norm) })
    }

    fn from(&self, sensor: Sensor, form: Parameterisation<9>, start: &Triad<f32>, norm: f32) -> Fit {
        let solver = LevenbergMarquardt::new(form.theta(start), Default::default());
        Fit { sensor, solver, used: Used::ALL, rounds: 0, norm, bias: None, radius: norm }
    }

    fn go_on(&mut self, mut fit: Fit) {
        match self.advance(&mut fit) {
            Some(true) => self.judge(&fit),
            Some(false) => self.fit = Some(fit),
            None => {}
        }
    }

    /// One iteration; where the solver has stopped, outliers are left out, or the fit is at its end: whether it is. `None` where
    /// there is nothing to fit.
    #[inline(never)]
    pub(super) fn advance(&self, fit: &mut Fit) -> Option<bool> {
        let stopped = match fit.sensor {
            Sensor::Accelerometer => fit.solver.step(&self.rests(fit)).is_some(),
            Sensor::Gyroscope => fit.solver.step(&self.turns(fit)?).is_some(),
            Sensor::Magnetometer => fit.solver.step(&self.points_of(fit)).is_some(),
        };
        Some(stopped && !self.refine(fit))
    }

    pub(super) fn rests(&self, fit: &Fit) -> Rests<'_, N, B> {
        Rests { poses: &self.poses, used: fit.used, gravity: fit.norm }
    }

    pub(super) fn turns(&self, fit: &Fit) -> Option<Turns<'_, N, B>> {
        let acc = &self.estimate(Sensor::Accelerometer)?.triad;
        let bias = fit.bias.filter(|bias| !bias.wanders()).map(|bias| bias.mean);
        Some(Turns { poses: &self.poses, used: fit.used, acc, bias })
    }

    pub(super) fn points_of(&self, fit: &Fit) -> Cloud<'_> {
        Cloud { slots: self.cloud.slots(), used: fit.used, norm: fit.norm, radius: fit.radius }
    }

    /// Prepares another round, if there is to be one.
    #[inline(never)]
    fn refine(&self, fit: &mut Fit) -> bool {
        let theta = *fit.solver.theta();
        let again = |fit: &mut Fit| fit.solver = LevenbergMarquardt::new(theta, Default::default());
        if fit.rounds >= ROUNDS {
            return false;
        }
        fit.rounds += 1;
        let left = self.without_outliers(fit);
        if left == fit.used {
            return false;
        }
        fit.used = left;
        again(fit);
        true
    }

    /// Observations of a fit that are no gross outliers.
    fn without_outliers(&self, fit: &Fit) -> Used {
        let (mut sizes, mut places): (Vec<f32, 64>, Vec<usize, 64>) = (Vec::new(), Vec::new());
        let count = match fit.sensor {
            Sensor::Magnetometer => self.cloud.slots().len(),
            _ => self.poses.list().len(),
        };
        for at in (0..count).filter(|at| fit.used.has(*at)) {
            if let Some(size) = self.size(fit, at) {
                let _room = (sizes.push(size), places.push(at));
            }
        }
        let mut left = fit.used;
        if let Some(limit) = outlier::gross(&sizes) {
            let within = |size: &f32| *size <= limit;
            let beyond = sizes.iter().zip(&places).filter(|(size, _)| !within(size));
            beyond.for_each(|(_, at)| left.leave_out(*at));
        }
        left
    }

    /// Length of the residual of one observation; `None` where there is none.
    fn size(&self, fit: &Fit, at: usize) -> Option<f32> {
        let used = Used::only(at);
        match fit.sensor {
            Sensor::Accelerometer => length(&Rests { used, ..self.rests(fit) }, &fit.solver),
            Sensor::Gyroscope => length(&Turns { used, ..self.turns(fit)? }, &fit.solver),
            Sensor::Magnetometer => length(&Cloud { used, ..self.points_of(fit) }, &fit.solver),
        }
    }
}

#[inline]
pub(super) fn acc_limits() -> Limits {
    Limits::for_norm(9, 10)
}

/// Length of all residuals of a model at a solver's parameters; `None` without any.
fn length(model: &impl Model<f32, 9>, solver: &LevenbergMarquardt<f32, 9>) -> Option<f32> {
    let mut sum = SquaredSum(0.0);
    model.rows(solver.theta(), &mut sum);
    (model.independent_rows() > 0).then(|| libm::sqrtf(sum.0))
}

/// Centre and radius of the sphere nearest to a cloud: `|x|² = 2 c·x + k` by least squares, about the mean.
#[inline]
fn sphere(slots: &[Slot<f32>]) -> Option<(Vector3<f32>, f32)> {
    let mut moments = Moments::default();
    slots.iter().for_each(|slot| moments.push(&slot.mean));
    let spread = moments.variance().sum();
    if slots.len() < 5 || spread <= 0.0 {
        return None;
    }
    // In units of the cloud's own size, so that single precision does.
    let size = libm::sqrtf(spread);
    let mut rows = Triangular::<f32, 4>::default();
    for slot in slots {
        let x = (slot.mean - moments.mean()) / size;
        rows.push(-x.norm_squared(), &SVector::from([2.0 * x.x, 2.0 * x.y, 2.0 * x.z, 1.0]));
    }
    let found = rows.damped_step(0.0, &SVector::repeat(1.0))?;
    let centre = found.xyz();
    let squared = found.w + centre.norm_squared();
    (squared > 0.0).then(|| (moments.mean() + centre * size, libm::sqrtf(squared) * size))
}
