//! Whether a cause is no more than an error of the given model.

use crate::{
    diagnosis::{finding::Cause, reference::model::Model},
    effect,
};

/// A cause is no more than what the model itself does not know of a term, given its errors.
pub fn errs_as_much(model: &Model, cause: &Cause, detectable: f64) -> bool {
    let Some(effect) = effect::find(&cause.effect) else { return false };
    let (Some(entries), [kind]) = (effect.changes, effect.sensors) else { return false };
    if !model.calibrated.contains(kind) {
        return false;
    }
    let (gain, bias) = &model.errors[*kind as usize];
    let own = entries.errors(gain, bias);
    let squares = cause.parameters.iter().zip(&own).filter_map(|(amount, own)| {
        let (value, error) = (amount.value?, amount.std_error?);
        Some(value * value / (error * error + own * own).max(f64::MIN_POSITIVE))
    });
    squares.sum::<f64>() < detectable + own.len() as f64
}
