//! The ladder of a gyroscope whose attitudes are known, each rung scored on the same motions.
//!
//! | rung | estimated from |
//! | --- | --- |
//! | – | nothing: the data sheet's values |
//! | B3 | bias, gain nominal |
//! | K9 | gain from gravity's direction before and after turns, bias from rests: the field form, which knows no attitude |
//! | G12 | gain and bias from the attitudes |
//! | G21 | and g-sensitivity |
//!
//! The second half of the motions is scored by a fit to the first half. K9 has no residual of motions left out in turn:
//! it is not fitted to them.

use imucal_core::{
    model::parameterisation::{FULL, FULL_WITH_SENSITIVITY},
    triad::Triad,
};
use nalgebra::SVector;

use super::{
    motions::Observations,
    rig::{G12, G21, check, fit},
    turns,
};
use crate::{
    calibrate::fit::{
        compare,
        compare::{Comparison, Step},
        gyr_rig_fit::{MotionFit, bias_alone, score},
    },
    observe::motion::MotionData,
    recording::SensorKind,
};

/// What no other rung contains: the field form minimises something else.
const OTHER_CRITERION: u8 = u8::MAX;

/// All rungs over the motions that G12 keeps; `field` gives the field form of the rests before a row, or of all.
pub fn comparison(
    observations: &Observations,
    field: &dyn Fn(Option<usize>) -> Option<Triad<f64>>,
) -> Option<Comparison> {
    let full = fit(G12, observations);
    let kept = |from: usize, to: usize| Observations {
        data: full.kept[from..to].iter().map(|k| observations.data[*k].clone()).collect(),
        ..observations.clone()
    };
    let count = full.kept.len();
    let (all, first, second) = (kept(0, count), kept(0, count / 2), kept(count / 2, count).data);
    let middle = second.first()?.rows.start;
    let mut steps = lower(&all, &first, &second);
    steps.extend(field(None).map(|triad| field_form(&triad, field(Some(middle)), &all.data, &second)));
    for (name, adds) in [(G12, "gain"), (G21, "g-sensitivity")] {
        if check(&all, name).is_err() {
            continue;
        }
        let found = fit(name, &all);
        // Rungs are compared over the same motions.
        if found.kept.len() == count {
            let by_half = check(&first, name).ok().map(|()| scored(&fit(name, &first), &second));
            steps.push(Step { second_half_rms: by_half, ..found.step(name, adds) });
        }
    }
    compare::climb(SensorKind::Gyr, steps)
}

/// Rms error of motions under a fit.
fn scored(fit: &MotionFit, data: &[MotionData]) -> f64 {
    if fit.parameters.len() > 12 {
        score(data, FULL_WITH_SENSITIVITY, &SVector::from_column_slice(&fit.parameters)).1
    } else {
        score(data, FULL, &SVector::from_column_slice(&fit.parameters)).1
    }
}

/// A rung below the fits.
fn step(
    name: &'static str,
    adds: &'static str,
    entries: Vec<u8>,
    triad: &Triad<f64>,
    data: &[MotionData],
) -> Step {
    let (squared_sum, rms) = score(data, FULL, &FULL.theta(triad));
    Step {
        name,
        adds,
        free: entries.len(),
        entries,
        residuals: 3 * data.len(),
        squared_sum,
        rms,
        held_out_rms: None,
        second_half_rms: None,
    }
}

/// Nothing estimated, and the bias alone.
fn lower(all: &Observations, first: &Observations, second: &[MotionData]) -> Vec<Step> {
    let rms = |triad: &Triad<f64>| Some(score(second, FULL, &FULL.theta(triad)).1);
    let with = |bias| Triad { bias, ..Triad::identity() };
    let none = step("-", "nothing: the data sheet's values", Vec::new(), &Triad::identity(), &all.data);
    let (bias, held) = bias_alone(&all.data, all.bias);
    let (earlier, _) = bias_alone(&first.data, first.bias);
    let only = step("B3", "bias", vec![9, 10, 11], &with(bias), &all.data);
    vec![
        Step { held_out_rms: Some(none.rms), second_half_rms: rms(&Triad::identity()), ..none },
        Step { held_out_rms: held, second_half_rms: rms(&with(earlier)), ..only },
    ]
}

/// The field form.
fn field_form(
    triad: &Triad<f64>,
    earlier: Option<Triad<f64>>,
    data: &[MotionData],
    second: &[MotionData],
) -> Step {
    let entries: Vec<u8> = (0..12).chain([OTHER_CRITERION]).collect();
    let by_half = earlier.map(|triad| score(second, FULL, &FULL.theta(&triad)).1);
    let step = step(turns::MODEL, "gain by gravity's direction, no attitudes", entries, triad, data);
    Step { free: 12, second_half_rms: by_half, ..step }
}
