//! Score tests of a gyroscope's turns between rests, and what else speaks against them.

use imucal_core::{model::parameterisation::FULL_GAIN, triad::Triad};
use nalgebra::Vector3;

use super::{
    examine::{CHANCE_OF_EXCESS, SLOWER, Scene, entry_of},
    gyr_residual,
    gyr_residual::Columns,
    tested::{Tested, judged},
};
use crate::{
    calibrate::{
        fit::score_test::{Score, ScoreTest, upper_tail},
        outcome::{FitSummary, KnownTurn, entry_name},
        suspicion::{Follows, Suspicion},
    },
    recording::{SensorKind, unit::STANDARD_GRAVITY},
};

/// Standard errors of the bias by which it may differ in motion from that at rest.
const BIAS_ERRORS: f64 = 3.0;
/// Earth's rotation, which a bias from rests takes for one direction, rad/s.
const EARTH_RATE: f64 = 7.29e-5;

impl Scene<'_> {
    pub(super) fn of_turns(
        &self,
        turns: &[KnownTurn],
        fit: &FitSummary,
        accelerometer_rms: Option<f64>,
    ) -> Vec<Suspicion> {
        let theta = FULL_GAIN.theta(&Triad { gain: fit.triad.gain, bias: Vector3::zeros() });
        let Some(rates) = self.recording.series(SensorKind::Gyr, self.usable(SensorKind::Gyr)) else {
            return Vec::new();
        };
        let rows = gyr_residual::rows(turns, &theta);
        let count = rows.residuals.len();
        let all: Vec<usize> = (0..9).collect();
        let independent = (2 * turns.len()).saturating_sub(fit.parameters.saturating_sub(9));
        let Some(test) = ScoreTest::new(&rows.residuals, rows.derivatives(count, &all), independent) else {
            return Vec::new();
        };
        let at: Vec<usize> =
            turns.iter().map(|turn| turn.data.rows.start.midpoint(turn.data.rows.end)).collect();
        let columns = gyr_residual::columns(turns, rates, &theta, &rows, &self.courses(&at));
        let at_rest = self.bias_errors(fit);
        let scores: Vec<(&Columns, Score)> =
            columns.iter().filter_map(|columns| Some((columns, test.test(&columns.values, 3)?))).collect();
        // What the bias' own error explains, other columns explain in part.
        let explained = scores.iter().find(|(columns, score)| {
            columns.name == gyr_residual::MOTION
                && (0..3).all(|axis| score.coefficients[axis].abs() < BIAS_ERRORS * at_rest[axis])
        });
        let most = explained.map_or(1.0, |(_, score)| score.p);
        let mut tests: Vec<Tested> = scores
            .iter()
            .filter(|(columns, score)| {
                explained.is_none() || (columns.name != gyr_residual::MOTION && score.p < most)
            })
            .map(|(columns, score)| Tested::of(columns, score.clone()))
            .collect();
        let name = |k: usize| format!("the turn at {:.0} s", self.recording.time[at[k]]);
        // A direction has two residuals though its chord has three.
        tests.extend(Tested::alone(&test, 3, 2, count, &name));
        let std: Vec<f64> =
            FULL_GAIN.entries().iter().map(|entry| entry_of(&fit.gain_std, &fit.bias_std, *entry)).collect();
        let excess = self.excess_of_turns(turns, fit, &rows.residuals, accelerometer_rms);
        let turning =
            self.turning(STANDARD_GRAVITY).and_then(|turning| turning.of_gyroscope(fit.bias_std.min()));
        judged(tests, FULL_GAIN.entries(), &std, entry_name)
            .into_iter()
            .chain(excess)
            .chain(turning)
            .collect()
    }

    /// How well rests determine the bias: no better than a step of the converter allows, rad/s.
    fn bias_errors(&self, fit: &FitSummary) -> Vector3<f64> {
        let noise = self.at_rest(SensorKind::Gyr);
        let of_mean = noise.map_or_else(Vector3::zeros, |noise| noise.with_slower(1.0));
        fit.bias_std
            .zip_map(&of_mean, |std, variance| (std * std + variance + EARTH_RATE * EARTH_RATE).sqrt())
    }

    /// Against the noise of the rates over each turn, the wander of the bias, and the directions of the rests.
    fn excess_of_turns(
        &self,
        turns: &[KnownTurn],
        fit: &FitSummary,
        residuals: &[f64],
        accelerometer_rms: Option<f64>,
    ) -> Option<Suspicion> {
        let (acc, gyr) = (self.at_rest(SensorKind::Acc)?, self.at_rest(SensorKind::Gyr)?);
        let [of_mean, of_rate] = [acc, gyr].map(|at_rest| at_rest.with_slower(1.0));
        let g = STANDARD_GRAVITY;
        let direction = of_mean.mean().max(accelerometer_rms.unwrap_or(0.0).powi(2)) / (g * g);
        let long = self.rests.iter().map(|r| self.duration(r)).sum::<f64>() / self.rests.len() as f64;
        let wander = fit.bias_wander.map_or(0.0, |wander| wander.spread.norm_squared() / 3.0);
        // A rate's mean over a rest has its noise over the rest's duration; an angle has it times its own.
        let expected = turns.iter().map(|turn| {
            let t = self.duration(&turn.data.rows);
            2.0 * direction + of_rate.mean() * long * t + (wander + EARTH_RATE * EARTH_RATE) * t * t
        });
        let expected = expected.sum::<f64>() / turns.len() as f64;
        let freedom = 2.0 * turns.len() as f64 - 9.0;
        let square = residuals.iter().map(|r| r * r).sum::<f64>() / freedom;
        let chance = upper_tail(square / (SLOWER * expected), freedom, 2.0 * acc.count as f64)?;
        (chance < CHANCE_OF_EXCESS).then(|| Suspicion {
            follows: Follows::Excess,
            detail: format!(
                "its turns end {:.3}° off where noise of rates and directions explains {:.3}°",
                square.sqrt().to_degrees(),
                expected.sqrt().to_degrees()
            ),
        })
    }
}
