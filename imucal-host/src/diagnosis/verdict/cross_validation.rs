//! Which causes are borne out by blocks that no fit has seen.
//!
//! Where no rig guides the sensor, what hand and reference add is no noise of any kind that is estimated, and evidence
//! alone is too sure. A cause that is not borne out may spoil what the others would foretell: the worst is taken out
//! first, and the others are asked again. Against a calibration made elsewhere an error of a given triad is a gap as well,
//! which nine products of rates may stand for as well as six misalignments: held-out data must confirm a cause together with the triad's
//! terms, were they free.

use super::{estimates, shares, shares::Share};
use crate::{
    diagnosis::{
        error::DiagnosisError, finding::Cause, mixed_model::noise::Noise,
        search::linearisation::Linearisation, settings::VerdictSettings,
    },
    effect::Effect,
};

/// Takes out the causes of a set that no held-out block bears out, that are too small to matter or of no known size, and
/// says so; `causes` are those of `set`, in its order. `None` where nothing can be fitted.
pub fn leave_out(
    causes: &mut Vec<Cause>,
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<Vec<String>, DiagnosisError> {
    let by = &linear.scene.settings.verdict;
    let mut kept = set.to_vec();
    let mut out = Vec::new();
    loop {
        let shares = shares::closed_of_own(linear, &kept, noise)?;
        let fails = |at: &usize| {
            let (share, cause) = (&shares[*at], &causes[*at]);
            let matters = (cause.material || !by.only_material)
                && estimates::is_sized(kept[*at], &cause.parameters, by.amplitude_errors);
            !matters || !is_borne(share, by)
        };
        let failing = (0..kept.len()).filter(fails);
        let Some(worst) = failing.min_by(|a, b| shares[*a].value.total_cmp(&shares[*b].value)) else { break };
        kept.remove(worst);
        out.push(causes.remove(worst).effect);
    }
    for at in (0..kept.len()).rev() {
        if !is_borne_with_terms(at, &kept, linear, noise)? {
            kept.remove(at);
            out.push(causes.remove(at).effect);
        }
    }
    let names = out.join(", ");
    Ok(match out.is_empty() {
        true => Vec::new(),
        false => vec![format!(
            "not asserted, since held-out data do not confirm them or none of their amplitudes differs from zero: {names}"
        )],
    })
}

fn is_borne(share: &Share, by: &VerdictSettings) -> bool {
    share.value > by.least_share && share.interval[0] > 0.0
}

/// Whether held-out blocks bear out a cause of a set with the terms of its triads free, where these are given.
fn is_borne_with_terms(
    at: usize,
    set: &[&'static Effect],
    linear: &Linearisation<'_>,
    noise: &Noise,
) -> Result<bool, DiagnosisError> {
    let is_other = |term: &&'static Effect| !set.contains(term);
    let terms: Vec<&'static Effect> =
        linear.candidates.given_with(set[at]).into_iter().filter(is_other).collect();
    if terms.is_empty() {
        return Ok(true);
    }
    let all: Vec<&'static Effect> = set.iter().copied().chain(terms).collect();
    let shares = shares::closed_of_own(linear, &all, noise)?;
    Ok(is_borne(&shares[at], &linear.scene.settings.verdict))
}
