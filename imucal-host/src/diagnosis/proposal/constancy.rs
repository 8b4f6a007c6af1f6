//! Whether a formula says all that there is to what it follows: its amplitude is the same at any time, whatever the
//! formula's value is, was before, or came from.
//!
//! ```text
//! y = … + a f + Σ_k b_k g_k      gain = ln p(y | f, g) − ln p(y | f), each with the noise that is likeliest with it
//! ```
//!
//! | what is asked | g |
//! | --- | --- |
//! | changes with time | f times half-waves of the recording's time |
//! | bends | Legendre's polynomials of f, of degree two to five |
//! | fades | f behind low-passes of the first order |
//! | remembers which way it came | play operators of f, of which any hysteresis of Prandtl and Ishlinskii is made |
//!
//! ```text
//! play: p_r(t) = max(f(t) − r, min(f(t) + r, p_r(t − 1)))
//! ```
//!
//! A formula is refused where one of them gains more than ln(n/α), n the number of questions, and is of a size that
//! matters. By Markov's inequality noise does so in no more than a share α of recordings where the formula is right.
//!
//! Sources: Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), ch. 1, of play; Ville (1939), of the bound.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{judgement::Judged, problem::Problem};
use crate::{
    diagnosis::{error::DiagnosisError, location::covariates::legendre, mixed_model::design::Signature},
    effect::user::History,
};

/// Share of right formulas that noise may refuse.
const FALSE: f64 = 0.01;
/// Half-waves of the recording's time.
const WAVES: usize = 8;
/// Highest degree of a polynomial.
const DEGREES: usize = 5;
/// Time constants, s.
const LAGS: [f64; 5] = [0.1, 0.5, 2.0, 8.0, 30.0];
/// Play, as shares of half the formula's range.
const PLAYS: [f64; 4] = [0.1, 0.2, 0.4, 0.7];

/// Values of a function on each axis, block by block.
type Values = Vec<Vector3<f64>>;

/// A question, and the functions that answer it.
struct Question {
    /// As a sentence on the formula ends.
    ending: &'static str,
    functions: Vec<Values>,
}

/// What a formula on these axes does not say, as the end of a sentence on it; `None` where it says all. What is missing
/// matters from this share of what the formula explains on.
///
/// # Errors
///
/// [`DiagnosisError`], where nothing can be scored.
pub fn missing(
    problem: &Problem<'_, '_>,
    best: &Judged,
    axes: &[usize],
    material: f64,
) -> Result<Option<&'static str>, DiagnosisError> {
    let questions = questions(problem, best)?;
    let least = (questions.len() as f64 / FALSE).ln();
    let usual = best.weighed.noise.usual(problem.kind);
    let formula = &best.columns.signatures;
    let mut surest: Option<(f64, &'static str)> = None;
    for question in questions {
        let each = question.functions.iter().flat_map(|values| axes.iter().map(move |axis| (values, *axis)));
        let further: Vec<Signature> =
            each.map(|(values, axis)| problem.column(values, axis, usual).0).collect();
        let weighed = problem.weighed(&problem.design, &[formula, &further], &best.weighed.noise)?;
        let projected = problem.projected(&weighed.normal)?;
        let every: Vec<usize> = (0..formula.len() + further.len()).collect();
        let alone = projected.explained(&every[..formula.len()]);
        let size = projected.explained(&every) - alone - further.len() as f64;
        let gain = weighed.log_evidence - best.weighed.log_evidence;
        if gain > least && size > material * alone && surest.is_none_or(|(most, _)| gain > most) {
            surest = Some((gain, question.ending));
        }
    }
    Ok(surest.map(|(_, ending)| ending))
}

fn questions(problem: &Problem<'_, '_>, best: &Judged) -> Result<[Question; 4], DiagnosisError> {
    let scene = problem.linear.scene;
    let times: Vec<f64> = scene.blocks.iter().map(|block| block.time).collect();
    let duration = scene.duration().max(1.0);
    let (mut changes, mut bends, mut fades, mut remembers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for term in best.formula.parsed().unwrap_or_default() {
        let value = problem.factors(&term, &best.formula.shapes())?;
        for order in 1..=WAVES {
            let wave = |time: &f64| libm::cos(PI * order as f64 * time / duration);
            changes.push(value.iter().zip(&times).map(|(value, time)| value * wave(time)).collect());
        }
        // An empty block's value is a convention: it is what the formula was before.
        let mut held = value;
        for at in (1..held.len()).filter(|at| scene.blocks[*at].rows.is_empty()) {
            held[at] = held[at - 1];
        }
        let axes = [0, 1, 2].map(|axis| held.iter().map(|value| value[axis]).collect::<Vec<f64>>());
        let (middles, halves): (Vec<f64>, Vec<f64>) = axes.iter().map(|values| range(values)).unzip();
        let scaled = [0, 1, 2].map(|axis| {
            let scaled = |value: &f64| (value - middles[axis]) / halves[axis].max(f64::MIN_POSITIVE);
            axes[axis].iter().map(scaled).collect::<Vec<f64>>()
        });
        let polynomials = scaled.each_ref().map(|values| legendre(values, DEGREES));
        bends
            .extend((2..=DEGREES).map(|degree| joined([0, 1, 2].map(|axis| &polynomials[axis][degree][..]))));
        for tau in LAGS {
            let lagged = scaled.each_ref().map(|values| History::Lag.of(&times, values, tau));
            fades.push(joined(lagged.each_ref().map(Vec::as_slice)));
        }
        for half in PLAYS {
            let played = scaled.each_ref().map(|values| play(values, half));
            remembers.push(joined(played.each_ref().map(Vec::as_slice)));
        }
    }
    let question = |ending, functions| Question { ending, functions };
    Ok([
        question("changes with time", changes),
        question("bends otherwise", bends),
        question("fades", fades),
        question("remembers which way it came", remembers),
    ])
}

/// The middle of some values, and half of what lies between the least and the largest.
fn range(values: &[f64]) -> (f64, f64) {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (0.5 * (least + largest), 0.5 * (largest - least))
}

/// Values that follow others only once these have moved on by more than `half`.
fn play(values: &[f64], half: f64) -> Vec<f64> {
    let mut last = values.first().copied().unwrap_or_default();
    let follow = |value: &f64| {
        last = last.clamp(value - half, value + half);
        last
    };
    values.iter().map(follow).collect()
}

/// Of the axes.
fn joined(axes: [&[f64]; 3]) -> Values {
    (0..axes[0].len()).map(|at| Vector3::from_fn(|axis, _| axes[axis][at])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn play_stays_until_its_half_width_is_used_up() {
        assert_eq!(play(&[0.0, 0.5, 2.0, 1.5, 0.0, -3.0], 1.0), [0.0, 0.0, 1.0, 1.0, 1.0, -2.0]);
    }
}
