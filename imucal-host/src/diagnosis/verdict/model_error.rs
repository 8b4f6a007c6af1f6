//! Whether a cause is no more than an error of the given model.

use crate::diagnosis::{finding::Cause, reference::model::Model};

/// A cause is no more than what the model itself does not know of a term, given its errors.
pub fn errs_as_much(model: &Model, cause: &Cause, detectable: f64) -> bool {
    let Some((prefix, term)) = cause.effect.split_once('.') else { return false };
    let Some(kind) = model.calibrated.iter().find(|kind| kind.prefix() == prefix) else { return false };
    let (gain, bias) = &model.errors[*kind as usize];
    let pair = |(row, column)| gain[(row, column)].max(gain[(column, row)]);
    let own: Vec<f64> = match term {
        "bias" | "hard_iron" => bias.iter().copied().collect(),
        "scale" => gain.diagonal().iter().copied().collect(),
        // One of a pair may be held by the form of the calibration: then the other has the error of both.
        "misalignment" => [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)].map(pair).to_vec(),
        "soft_iron" => [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(pair).to_vec(),
        _ => return false,
    };
    let squares = cause.parameters.iter().zip(&own).filter_map(|(amount, own)| {
        let (value, error) = (amount.value?, amount.std_error?);
        Some(value * value / (error * error + own * own).max(f64::MIN_POSITIVE))
    });
    squares.sum::<f64>() < detectable + own.len() as f64
}
