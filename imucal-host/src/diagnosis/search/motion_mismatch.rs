//! Stretches in which the real machine moved otherwise than its simulator: `ref.motion_mismatch`.
//!
//! They are looked for in what a fit of the baseline leaves ([`motion_evidence`]), left out, and looked for again, since a fit
//! that holds them is bent by them. Impacts that one side has and the other lacks are found before, from the samples
//! ([`crate::diagnosis::reference::impact`]). A turn that the search of effects finds along a stream, and that comes back, is
//! another; it is left out of a further search.

use std::ops::Range;

use super::{
    motion_evidence::{self, Found},
    refit::{Fit, refit},
    stepwise::Solution,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::Amount,
        library::candidates::Candidates,
        reference::strikes::Unmatched,
        residual::{block::Block, forward_model::ForwardModel, vibration},
        screening::conventions::Finding,
    },
    effect::{self, motion_mismatch},
    simulator::Dose,
};

/// The effect that turns the sensor from an instant on.
const SLIP: &str = "ref.mount_slip";
/// A turn that lasts to within this of the recording's end, s, or for more than this share of it, stays.
const STAYS: f64 = 5.0;
const MOST: f64 = 0.5;
/// Time that it takes to turn and to come back, s.
const TURNING: f64 = 2.0;
/// Rounds of fitting and leaving out.
const ROUNDS: usize = 4;
/// A stretch's beginning and end are known to within this, s.
const KNOWN: f64 = 0.3;

/// A stretch in which the machine moved otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// When, s.
    pub time: Range<f64>,
    /// Root mean square of the specific force that the simulator lacks, m/s²; `None` without an accelerometer.
    pub force: Option<f64>,
    /// Root mean square of the rate that it lacks, rad/s; `None` without a gyroscope.
    pub rate: Option<f64>,
    /// Whitened squared size of what the baseline leaves there, by sensor.
    pub energy: [f64; 3],
}

/// A scene without what its source does not know of the movement.
pub struct LeftOut<'a> {
    /// The scene, with the noise that vibration makes.
    pub scene: ForwardModel<'a>,
    /// Stretches in which the machine moved otherwise.
    pub stretches: Vec<Stretch>,
    /// Moments in which one sensor's residual stood alone.
    pub jolts: usize,
}

/// The scene without such stretches and moments.
///
/// # Errors
///
/// [`DiagnosisError`], when the baseline cannot be fitted.
pub fn left_out<'a>(
    mut scene: ForwardModel<'a>,
    candidates: &Candidates,
) -> Result<LeftOut<'a>, DiagnosisError> {
    let by = &scene.settings.residual;
    if !by.weighs_vibration && !by.leaves_out_mismatch {
        return Ok(LeftOut { scene, stretches: Vec::new(), jolts: 0 });
    }
    let baseline = candidates.baseline.iter();
    let mut doses: Vec<Dose> =
        baseline.map(|effect| Dose { effect, values: vec![0.0; effect.parameters.len()] }).collect();
    let (mut stretches, mut jolts): (Vec<Stretch>, usize) = (Vec::new(), 0);
    for _ in 0..ROUNDS {
        let fit = refit(&scene, Fit::of(&scene, doses)?, None)?;
        if by.weighs_vibration {
            scene.vibration = vibration::ratios(&scene, &fit.doses)?;
        }
        let before: Vec<Range<f64>> = stretches.iter().map(|stretch| stretch.time.clone()).collect();
        let new = match by.leaves_out_mismatch {
            true => motion_evidence::found(&scene, &fit, &before)?,
            false => Found::default(),
        };
        doses = fit.doses;
        if new == Found::default() {
            break;
        }
        let times = new.stretches.iter().map(|stretch| stretch.time.clone());
        scene.leave_out(&times.chain(new.jolts.iter().cloned()).collect::<Vec<_>>());
        jolts += new.jolts.len();
        stretches.extend(new.stretches);
    }
    Ok(LeftOut { scene, stretches: merged(stretches), jolts })
}

/// The stretch for which a search has turned the sensor against a simulator's stream, and back: a mount that slips stays
/// where it is, and a machine that moves otherwise comes back to its simulator's course. `None` where none is that short, or
/// there is no stream.
pub fn turned_for_a_while(explained: &Solution<'_>) -> Option<Stretch> {
    let scene = explained.linear.scene;
    let slip = explained.fit.doses.iter().find(|dose| dose.effect.id == SLIP)?;
    let [.., start, end] = slip.values[..] else { return None };
    let comes_back = end < scene.duration() - STAYS && end - start < MOST * scene.duration();
    let is_measured = |(at, block): (usize, &Block)| {
        (start..end).contains(&block.time) && scene.kinds.iter().any(|kind| scene.worth(*kind, at) > 0.0)
    };
    let is_new = scene.blocks.iter().enumerate().any(is_measured);
    let energy = 2.0 * (explained.best.log_evidence - explained.none.log_evidence);
    (scene.settings.residual.leaves_out_mismatch && comes_back && is_new).then_some(Stretch {
        time: start - TURNING..end + TURNING,
        force: None,
        rate: None,
        energy: [energy, 0.0, 0.0],
    })
}

/// What is said of moments that were left out; `None` without one.
pub fn remark(jolts: usize) -> Option<String> {
    (jolts > 0).then(|| {
        format!(
            "{jolts} {} in which a sensor is far from the simulator for less than half a second {} left out: a jolt that the \
             simulator lacks, or one between two samples of its stream",
            if jolts == 1 { "moment" } else { "moments" },
            if jolts == 1 { "is" } else { "are" },
        )
    })
}

/// Stretches in their order, those that touch as one.
fn merged(mut stretches: Vec<Stretch>) -> Vec<Stretch> {
    stretches.sort_by(|a, b| a.time.start.total_cmp(&b.time.start));
    let mut merged: Vec<Stretch> = Vec::new();
    for next in stretches {
        match merged.last_mut().filter(|last| next.time.start <= last.time.end) {
            Some(last) => {
                last.time.end = last.time.end.max(next.time.end);
                let most = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
                (last.force, last.rate) = (most(last.force, next.force), most(last.rate, next.rate));
                for (own, more) in last.energy.iter_mut().zip(next.energy) {
                    *own += more;
                }
            }
            None => merged.push(next),
        }
    }
    merged
}

impl From<&Unmatched> for Stretch {
    /// Impacts that one side lacks are seen by the accelerometer alone.
    fn from(unmatched: &Unmatched) -> Self {
        let energy = [unmatched.energy, 0.0, 0.0];
        Self { time: unmatched.time.clone(), force: Some(unmatched.force), rate: None, energy }
    }
}

/// The stretches, and those with impacts that one side lacks, as a fault of the recording; `None` without one.
pub fn finding(stretches: Vec<Stretch>, unmatched: &[Unmatched]) -> Option<Finding> {
    let stretches = merged(stretches.into_iter().chain(unmatched.iter().map(Stretch::from)).collect());
    let effect = effect::find(motion_mismatch::ID).filter(|_| !stretches.is_empty())?;
    let mut parameters = Vec::new();
    for (at, stretch) in stretches.iter().enumerate() {
        let name = |name: &str| if at == 0 { name.to_owned() } else { format!("{name}_{}", at + 1) };
        let mut add = |own: &str, value: Option<f64>, std_error: Option<f64>, unit: &str| {
            parameters.push(Amount { name: name(own), value, std_error, unit: unit.to_owned() });
        };
        add("t_start", Some(stretch.time.start), Some(KNOWN), "s");
        add("t_end", Some(stretch.time.end), Some(KNOWN), "s");
        stretch.rate.into_iter().for_each(|rate| add("lacking_rate", Some(rate), None, "rad/s"));
        stretch.force.into_iter().for_each(|force| add("lacking_force", Some(force), None, "m/s^2"));
    }
    // Two sensors are as far beyond the usual at once by chance only as often as their whitened squares say.
    let most = stretches.iter().map(|stretch| stretch.energy.iter().sum::<f64>()).fold(0.0, f64::max);
    Some(Finding { effect, parameters, p_value: libm::exp(-0.25 * most) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(time: Range<f64>, rate: f64) -> Stretch {
        Stretch { time, force: None, rate: Some(rate), energy: [1.0; 3] }
    }

    #[test]
    fn stretches_that_touch_are_one() {
        let all = merged(vec![found(9.0..11.0, 0.2), found(3.0..4.0, 0.1), found(10.5..12.0, 0.4)]);
        assert_eq!(all.len(), 2);
        assert_eq!((all[1].time.clone(), all[1].rate, all[1].energy), (9.0..12.0, Some(0.4), [2.0; 3]));
    }
}
