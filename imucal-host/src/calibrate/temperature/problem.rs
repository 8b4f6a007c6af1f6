//! A triad's model at the temperatures of its observations: what is fitted by the core, with some groups of terms or with
//! none.

use imucal_core::{
    model::{
        Model,
        thermal::{Side, THERMAL, ThermalForm, ThermalModel, UNIT},
    },
    solver::{SolveReport, gauge::bit},
};
use nalgebra::{DMatrix, DVector, SVector, Vector3};

use super::groups::{Group, Groups};
use crate::calibrate::fit::{
    least_squares,
    rows::{Residuals, Rows},
};

/// How large the noise of estimates is that follow linearly from rows: of residuals, their derivatives, and influence.
pub type Covariance<'a> =
    dyn Fn(&DVector<f64>, &DMatrix<f64>, &DMatrix<f64>) -> Option<DMatrix<f64>> + Sync + 'a;

/// Observations of a triad at several temperatures.
pub struct Problem<'a, F, const S: usize, const P: usize> {
    /// The model of one observation alone.
    pub of: F,
    /// What may be estimated.
    pub form: ThermalForm<S, P>,
    /// δ of each observation.
    pub changes: Vec<f64>,
    /// Time of each, between −1 and 1.
    pub times: Vec<f64>,
    /// Rows of each.
    pub each: usize,
    /// Independent ones of them.
    pub independent: usize,
    /// Where to start, without terms of temperature.
    pub start: SVector<f64, S>,
    /// Noise of estimates.
    pub noise: Box<Covariance<'a>>,
}

/// A fit with some groups of terms.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The groups.
    pub groups: Groups,
    /// All parameters; zero where a term is held.
    pub theta: DVector<f64>,
    /// The solver's report.
    pub report: SolveReport<f64>,
}

/// Rows at a fit: residuals and derivatives by all parameters, held ones as well.
#[derive(Clone, Debug)]
pub struct FittedRows {
    /// Residuals.
    pub residuals: DVector<f64>,
    /// Derivatives.
    pub jacobian: DMatrix<f64>,
}

/// What a ladder of temperature terms asks of a problem, whatever its model.
pub trait ThermalProblem: Sync {
    /// Observations.
    fn count(&self) -> usize;

    /// δ of each.
    fn changes(&self) -> &[f64];

    /// Rows of each.
    fn each(&self) -> usize;

    /// Independent ones of them.
    fn independent(&self) -> usize;

    /// Groups that may be estimated.
    fn offered(&self) -> Groups;

    /// Parameters that are free with some groups: positions in `theta`.
    fn free(&self, groups: Groups) -> Vec<usize>;

    /// Fits some observations with some groups; `None` where the solver does not end at a minimum.
    fn fit(&self, groups: Groups, used: &[usize], from: Option<&Fitted>) -> Option<Fitted>;

    /// Rows of all observations at a fit.
    fn rows(&self, at: &Fitted) -> FittedRows;

    /// Sum of squared residuals of some observations at a fit.
    fn squared(&self, at: &Fitted, of: &[usize]) -> f64;

    /// Columns of terms that are linear in time instead of temperature.
    fn drift(&self, at: &Fitted, groups: Groups) -> DMatrix<f64>;

    /// Noise of estimates; see [`Covariance`].
    fn covariance(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>>;

    /// Term by term of a group, three axes; zero where it is not offered.
    fn term(&self, values: &DVector<f64>, group: Group) -> Vector3<f64>;

    /// Position of a group's first axis, where it is offered.
    fn position(&self, group: Group) -> Option<usize>;
}

impl<M, F, const S: usize, const P: usize> Problem<'_, F, S, P>
where
    M: Model<f64, S>,
    F: Fn(usize) -> Option<M> + Sync,
{
    fn group(&self, k: usize) -> Option<Group> {
        let term = usize::from(self.form.entries()[k]).checked_sub(S).filter(|term| *term < THERMAL)?;
        Some(Group::ALL[term / 3])
    }

    fn held(&self, groups: Groups) -> u32 {
        let held = |k: &usize| self.group(*k).is_some_and(|group| !groups.has(group));
        (0..P).filter(held).map(bit).fold(0, |all, one| all | one)
    }

    fn at(&self, fitted: &Fitted) -> SVector<f64, P> {
        SVector::from_column_slice(fitted.theta.as_slice())
    }
}

impl<M, F, const S: usize, const P: usize> ThermalProblem for Problem<'_, F, S, P>
where
    M: Model<f64, S>,
    F: Fn(usize) -> Option<M> + Sync,
{
    fn count(&self) -> usize {
        self.changes.len()
    }

    fn changes(&self) -> &[f64] {
        &self.changes
    }

    fn each(&self) -> usize {
        self.each
    }

    fn independent(&self) -> usize {
        self.independent
    }

    fn offered(&self) -> Groups {
        (0..P).filter_map(|k| self.group(k)).fold(Groups::NONE, Groups::with)
    }

    fn free(&self, groups: Groups) -> Vec<usize> {
        let held = self.held(groups);
        (0..P).filter(|k| held & bit(*k) == 0).collect()
    }

    fn fit(&self, groups: Groups, used: &[usize], from: Option<&Fitted>) -> Option<Fitted> {
        let held = self.held(groups);
        let changes: Vec<f64> = used.iter().map(|k| self.changes[*k]).collect();
        let of = |k: usize| (self.of)(*used.get(k)?);
        let model = ThermalModel { changes: &changes, of, form: self.form, held };
        let mut start = from.map_or_else(|| self.form.theta(&self.start), |from| self.at(from));
        (0..P).filter(|k| held & bit(*k) != 0).for_each(|k| start[k] = 0.0);
        let solver = least_squares::solve(&model, start);
        let report = solver.report();
        let mut theta = DVector::from_column_slice(solver.theta().as_slice());
        // Held is zero, and not what rounding leaves of it.
        (0..P).filter(|k| held & bit(*k) != 0).for_each(|k| theta[k] = 0.0);
        report.termination.was_successful().then_some(Fitted { groups, theta, report })
    }

    fn rows(&self, at: &Fitted) -> FittedRows {
        let model = ThermalModel { changes: &self.changes, of: &self.of, form: self.form, held: 0 };
        let rows = Rows::of(&model, &self.at(at));
        let count = rows.residuals.len();
        FittedRows {
            residuals: DVector::from_column_slice(&rows.residuals),
            jacobian: rows.derivatives(count, &Vec::from_iter(0..P)),
        }
    }

    fn squared(&self, at: &Fitted, of: &[usize]) -> f64 {
        let changes: Vec<f64> = of.iter().map(|k| self.changes[*k]).collect();
        let one = |k: usize| (self.of)(*of.get(k)?);
        let model = ThermalModel { changes: &changes, of: one, form: self.form, held: 0 };
        Residuals::of(&model, &self.at(at)).iter().map(|r| r * r).sum()
    }

    fn drift(&self, at: &Fitted, groups: Groups) -> DMatrix<f64> {
        // As terms of a temperature that is the time, at the triad of the reference.
        let none = self.form.theta(&self.form.cold(&self.at(at)));
        let model = ThermalModel { changes: &self.times, of: &self.of, form: self.form, held: 0 };
        let rows = Rows::of(&model, &none);
        let linear = |k: &usize| match self.group(*k) {
            Some(Group::Bias) => groups.has(Group::Bias) || groups.has(Group::BiasQuadratic),
            Some(Group::Scale) => groups.has(Group::Scale) || groups.has(Group::ScaleQuadratic),
            _ => false,
        };
        let columns: Vec<usize> = (0..P).filter(linear).collect();
        rows.derivatives(rows.residuals.len(), &columns)
    }

    fn covariance(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        (self.noise)(residuals, jacobian, influence)
    }

    fn term(&self, values: &DVector<f64>, group: Group) -> Vector3<f64> {
        self.position(group).map_or_else(Vector3::zeros, |from| {
            Vector3::from_fn(|axis, _| values.get(from + axis).copied().unwrap_or(0.0))
        })
    }

    fn position(&self, group: Group) -> Option<usize> {
        (0..P).find(|k| self.group(*k) == Some(group))
    }
}

/// Entries of a form: some of a model of `S`, then all terms of the groups named.
pub const fn entries<const P: usize>(model: &[u8], size: u8, groups: &[Group]) -> [u8; P] {
    let mut entries = [u8::MAX; P];
    let mut k = 0;
    while k < P {
        entries[k] = if k < model.len() {
            model[k]
        } else {
            let term = k - model.len();
            size + 3 * groups[term / 3] as u8 + (term % 3) as u8
        };
        k += 1;
    }
    entries
}

/// A form of a model and the groups named.
pub const fn form<const S: usize, const P: usize>(
    model: &[u8],
    groups: &[Group],
    side: Side,
) -> ThermalForm<S, P> {
    ThermalForm::new(entries::<P>(model, S as u8, groups), side)
}

/// Times, s, as shares of their span, −1 to 1.
pub fn shares(times: &[f64]) -> Vec<f64> {
    let (first, last) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0));
    times.iter().map(|t| 2.0 * (t - first) / (last - first) - 1.0).collect()
}

/// δ of temperatures, °C.
pub fn changes(temperatures: impl Iterator<Item = f64>, reference: f64) -> Vec<f64> {
    temperatures.map(|temperature| (temperature - reference) / UNIT).collect()
}
