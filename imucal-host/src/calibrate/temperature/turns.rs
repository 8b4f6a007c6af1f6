//! A gyroscope's turns at several temperatures: gain and the scale's terms.

use imucal_core::{
    model::{
        Model, RowSink,
        parameterisation::FULL,
        thermal::{Side, ThermalForm},
        turn::TurnModel,
    },
    observation::Turn,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};

use super::{
    finding::{Part, TemperatureFinding},
    groups::Group,
    ladder::{self, Climbed},
    problem::{Problem, form, shares},
    rests::Kept,
    terms::Terms,
};
use crate::calibrate::{
    fit::directions::Directions,
    gyr::turn_errors::{self, Between, RateNoise, TurnCovariance},
};

/// Full gain and the scale's terms.
const FORM: ThermalForm<12, 15> =
    form(&[0, 1, 2, 3, 4, 5, 6, 7, 8], &[Group::Scale, Group::ScaleQuadratic], Side::Gain);

/// Of one turn the two rows across its direction: the third is of second order.
struct Across<'a>(Turn<'a, f64>);

/// Passes on three rows as two.
struct Projected<'a, S> {
    sink: &'a mut S,
    across: nalgebra::MatrixXx3<f64>,
    rows: [(f64, SVector<f64, 12>); 2],
    seen: usize,
}

impl<S: RowSink<f64, 12>> RowSink<f64, 12> for Projected<'_, S> {
    const JACOBIAN: bool = S::JACOBIAN;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, 12>) {
        for (k, row) in self.rows.iter_mut().enumerate() {
            let share = self.across[(k, self.seen)];
            row.0 += share * residual;
            row.1 += jacobian * share;
        }
        self.seen += 1;
        if self.seen == 3 {
            self.rows.iter().for_each(|(residual, jacobian)| self.sink.row(*residual, jacobian));
        }
    }
}

impl Model<f64, 12> for Across<'_> {
    fn rows<S: RowSink<f64, 12>>(&self, theta: &SVector<f64, 12>, sink: &mut S) {
        let turns = [self.0];
        let model = TurnModel { turns: &turns, form: FULL };
        let across = turn_errors::across(&self.0.after);
        model.rows(theta, &mut Projected { sink, across, rows: [(0.0, SVector::zeros()); 2], seen: 0 });
    }

    fn independent_rows(&self) -> usize {
        2
    }
}

/// Turns of a gyroscope.
#[derive(Clone, Copy, Debug)]
pub struct WarmTurns<'a> {
    /// The turns, and the rests they are between.
    pub turns: &'a [Between<'a>],
    /// Middle of each, s.
    pub times: &'a [f64],
    /// Its temperature, °C.
    pub temperatures: &'a [f64],
    /// How directions err.
    pub directions: &'a Directions,
    /// How rates err.
    pub rates: &'a RateNoise,
}

/// Adds what became of the scale's terms; these, where some are kept. Temperatures of rests have been checked, and those
/// of turns are theirs. `near` is the gain by a fit without terms.
pub fn estimate(
    turns: &WarmTurns<'_>,
    near: &Matrix3<f64>,
    finding: &mut TemperatureFinding,
) -> Option<Kept> {
    let reference = finding.reference;
    let climbed =
        ladder::climb(turns.turns.len(), |used| Box::new(problem(turns, used, near, reference))).ok()?;
    finding.parts.push(Part::of(&climbed, "turns", "rad"));
    let Climbed { fit: Some(fit), left_out, .. } = climbed else { return None };
    let all = problem(turns, &fit.used, near, reference);
    let (terms, std) =
        (Terms::of(&all, &fit.fitted.theta, reference), Terms::of(&all, &fit.std(), reference));
    finding.add_scale(terms, std);
    Some(Kept { terms, fit, left_out, temperatures: turns.temperatures.to_vec() })
}

fn problem<'a>(
    turns: &WarmTurns<'a>,
    used: &[usize],
    near: &Matrix3<f64>,
    reference: f64,
) -> Problem<'a, impl Fn(usize) -> Option<Across<'a>> + Sync + use<'a>, 12, 15> {
    let chosen: Vec<Between<'a>> = used.iter().map(|k| turns.turns[*k]).collect();
    let noise = TurnCovariance::of(&chosen, near, turns.directions, turns.rates);
    Problem {
        of: move |k| chosen.get(k).map(|between: &Between<'a>| Across(between.turn)),
        form: FORM,
        changes: super::problem::changes(used.iter().map(|k| turns.temperatures[*k]), reference),
        times: shares(&used.iter().map(|k| turns.times[*k]).collect::<Vec<_>>()),
        each: 2,
        independent: 2 * used.len(),
        start: FULL.theta(&Triad { gain: *near, bias: Vector3::zeros() }),
        noise: Box::new(
            move |residuals: &DVector<f64>, jacobian: &DMatrix<f64>, influence: &DMatrix<f64>| {
                Some(noise.errors(residuals, jacobian, influence)?.covariance)
            },
        ),
    }
}
