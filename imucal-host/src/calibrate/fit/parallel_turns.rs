//! Turns whose rows are worked out on all cores.
//!
//! The rows are those of [`TurnModel`], in its order: a fit has the same bits on any number of cores.

use imucal_core::{
    model::{Model, RowSink, turn::TurnModel},
    observation::Turn,
};
use nalgebra::SVector;
use rayon::prelude::*;

use super::rows::{Residuals, Rows};

/// Turns that one core works out at a time.
const TOGETHER: usize = 32;

/// A model of turns.
#[derive(Clone, Copy, Debug)]
pub struct ParallelTurns<'a, const P: usize>(pub TurnModel<'a, f64, P>);

impl<const P: usize> Model<f64, P> for ParallelTurns<'_, P> {
    fn rows<S: RowSink<f64, P>>(&self, theta: &SVector<f64, P>, sink: &mut S) {
        let Self(TurnModel { turns, form }) = *self;
        let part = |turns: &[Turn<'_, f64>]| {
            let model = TurnModel { turns, form };
            match S::JACOBIAN {
                true => Rows::of(&model, theta),
                false => Rows { residuals: Residuals::of(&model, theta), jacobian: Vec::new() },
            }
        };
        let parts: Vec<Rows<P>> = turns.par_chunks(TOGETHER).map(part).collect();
        let none = SVector::zeros();
        for part in &parts {
            for (row, residual) in part.residuals.iter().enumerate() {
                sink.row(*residual, part.jacobian.get(row).unwrap_or(&none));
            }
        }
    }

    fn independent_rows(&self) -> usize {
        Model::<f64, P>::independent_rows(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::{
        model::parameterisation::FULL_GAIN,
        observation::{Block, Durations},
        triad::Triad,
    };
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn rows_are_those_of_the_model_in_its_order() {
        let rate = |k: usize| Vector3::new((k as f64).sin(), 0.3, (0.7 * k as f64).cos());
        let block = |k: usize| Block { s0: rate(k), s1: rate(k + 1) * 0.1, c: rate(k + 2) * 0.01 };
        let blocks: Vec<_> = (0..3 * TOGETHER).map(block).collect();
        let turn = |k: usize| Turn {
            blocks: &blocks[k..k + 3],
            durations: Durations::Each(&[0.05; 3]),
            before: rate(k).normalize(),
            after: rate(k + 1).normalize(),
        };
        let turns: Vec<_> = (0..2 * TOGETHER + 5).map(turn).collect();
        let model = TurnModel { turns: &turns, form: FULL_GAIN };
        let theta = FULL_GAIN.theta(&Triad::identity());
        let (one, all) = (Rows::of(&model, &theta), Rows::of(&ParallelTurns(model), &theta));
        assert_eq!((one.residuals, one.jacobian), (all.residuals, all.jacobian));
        assert_eq!(Residuals::of(&model, &theta), Residuals::of(&ParallelTurns(model), &theta));
    }
}
