//! Samples clipped below full scale: `P.saturation`.
//!
//! The stretches are those that the recording's own check found at a value that is not the declared full scale; here it
//! is asked whether an axis could have stayed there by chance, given how often it repeats itself elsewhere, or have come
//! there so often, given how often it came near.

use super::{Conventions, Finding, SURE};
use crate::recording::{
    Triple,
    check::{
        integrity::SensorIntegrity,
        saturation::{Saturation, pile_chance},
    },
    median,
};

/// Looks at one sensor.
pub(crate) fn check(triple: &Triple, sensor: &SensorIntegrity, found: &mut Conventions) {
    let own: Vec<_> = sensor.saturated.iter().filter(|stretch| !stretch.declared).collect();
    let Some(limit) = median(own.iter().map(|stretch| stretch.value.abs()).collect()) else { return };
    let stays = |stretch: &Saturation| chance(triple, stretch.axis, stretch.rows.len());
    let piles = |stretch: &Saturation| {
        let values: Vec<f64> = triple.values.iter().map(|value| value[stretch.axis]).collect();
        pile_chance(&values, stretch.value)
    };
    let staying = own.iter().map(|stretch| stays(stretch)).fold(1.0, f64::min);
    let mut limits: Vec<&Saturation> = Vec::new();
    for stretch in &own {
        if !limits.iter().any(|known| known.axis == stretch.axis && known.value == stretch.value) {
            limits.push(stretch);
        }
    }
    let p_value = limits.into_iter().map(piles).fold(staying, f64::min);
    if p_value > SURE || limit == 0.0 {
        return;
    }
    let rows: usize = own.iter().map(|stretch| stretch.rows.len()).sum();
    let kind = sensor.sensor;
    let Some(full_scale) = triple.full_scale_si() else {
        found.remarks.push(format!(
            "{kind} clips at {limit:.4} {} in {rows} samples; [ranges] {kind} is not given, so that its shortfall is \
             not known",
            crate::recording::Unit::of(kind).first().map(ToString::to_string).unwrap_or_default()
        ));
        return;
    };
    // All that is known of the limit is that it is rounded, or known from neighbours, to a step.
    let step = 1.0 / triple.nominal.per_unit.abs() / 12f64.sqrt();
    let std_error =
        if triple.unit == crate::recording::Unit::Counts { full_scale / limit / limit * step } else { 0.0 };
    let values = [(Some(full_scale / limit - 1.0), Some(std_error))];
    found.findings.extend(Finding::new(&format!("{kind}.saturation"), &values, p_value));
}

/// Probability that an axis repeats itself so long anywhere, by how often it does so from row to row.
fn chance(triple: &Triple, axis: usize, length: usize) -> f64 {
    let pairs = triple.values.windows(2);
    let low = triple.values.iter().map(|value| value[axis]).fold(f64::INFINITY, f64::min);
    let high = triple.values.iter().map(|value| value[axis]).fold(f64::NEG_INFINITY, f64::max);
    let inner: Vec<bool> = pairs
        .filter(|pair| pair[0][axis] > low && pair[0][axis] < high)
        .map(|pair| pair[0][axis] == pair[1][axis])
        .collect();
    // One more of each: what has not been seen may happen.
    let repeats = inner.iter().filter(|repeats| **repeats).count() as f64 + 1.0;
    let each = repeats / (inner.len() as f64 + 2.0);
    (triple.values.len() as f64 * each.powf(length as f64 - 1.0)).min(1.0)
}
