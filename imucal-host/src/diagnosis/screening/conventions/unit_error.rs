//! Values in another unit than the manifest says: `P.unit_error`.
//!
//! Raw sensors are off by some per cent, a wrong unit by a factor of the list in [`Unit`]. A factor off the list is not
//! an effect of the catalogue; the nominal conversion of counts may be wrong by any.

use super::{Conventions, Finding, axis_swap::Scale};
use crate::{
    effect,
    effect::DataRun,
    recording::{SensorKind, Unit},
};

/// A raw sensor's scale is wrong by no more than this, as a ratio.
const RAW: f64 = 1.25;

/// Judges a common scale.
pub(crate) fn check(kind: SensorKind, unit: Unit, scale: &Scale, found: &mut Conventions) {
    let off = |factor: f64| (scale.scale / factor).ln().abs();
    if unit == Unit::Arbitrary || off(1.0) < RAW.ln() {
        return;
    }
    let mistakes =
        Unit::of(kind).iter().flat_map(|meant| Unit::of(kind).iter().map(move |said| (*meant, *said)));
    let nearest = mistakes
        .filter_map(|(is, said)| Some((is.per_si()? / said.per_si()?, is, said)))
        .filter(|(factor, ..)| *factor != 1.0 && off(*factor) < RAW.ln())
        // Those that the manifest can have meant come first.
        .min_by_key(|(_, _, said)| *said != unit);
    let Some((factor, is, said)) = nearest else {
        let percent = 100.0 * scale.std_error / scale.scale;
        found.remarks.push(format!(
            "{kind} reads {:.4} times its input (± {percent:.1} %), which no unit explains; check {}",
            scale.scale,
            if unit == Unit::Counts { "per_unit of [counts]" } else { "the range that the driver assumes" }
        ));
        return;
    };
    let Some(power) = power(kind, factor) else { return };
    let id = format!("{kind}.unit_error");
    // So many standard errors off that no probability can be distinguished from 0.
    found.findings.extend(Finding::new(&id, &[(Some(power), Some(0.0))], 0.0));
    found.remarks.push(format!("{kind} is {factor:.6} times too large, as {is} is when taken for {said}"));
}

/// The effect's parameter for a factor, by what a power of one does.
fn power(kind: SensorKind, factor: f64) -> Option<f64> {
    let effect = effect::find(&format!("{kind}.unit_error"))?;
    let effect::Act::Data(_, alter) = effect.act else { return None };
    let mut sample = [nalgebra::Vector3::repeat(1.0)];
    alter(&[1.0], &mut DataRun { samples: &mut sample });
    let base = sample[0].x;
    (base > 0.0 && base != 1.0).then(|| factor.ln() / base.ln())
}
