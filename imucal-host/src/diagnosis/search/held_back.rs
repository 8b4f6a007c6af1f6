//! Effects that a large noise holds back: released from their usual sizes, or found from a perfect sensor.
//!
//! An effect many times its usual size may leave a gap so large that it counts as noise, which a gain many times too large takes up in
//! part. In a noise as large as what an effect does, the data say little against its usual size: it comes out too small, or no step of the
//! search gains by it. Both are mended the same way: the fit begins with a perfect sensor and a hundredth of the noise, and is taken only
//! if it leaves far less. A fit that cannot be computed from there is not taken; the search goes on without it.

use super::{
    hypothesis::Scored,
    linearisation::Linearisation,
    refit::{Fit, refit},
};
use crate::{
    diagnosis::mixed_model::noise::{FAR, Noise},
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

/// In so much of a noise, effects are as large as the data alone would have them.
const RELEASED: f64 = 0.01;
/// A fit leaves far less that leaves less than this share of the noise.
const FAR_LESS: f64 = 0.5;
/// Effects of which each is fitted from a perfect sensor.
const TRIED: usize = 3;

/// A fit whose effects are not held at their usual sizes, and its noise; `None` unless the noise holds a misfit of which that fit leaves
/// far less.
pub fn released(linear: &Linearisation<'_>, fit: &Fit, noise: &Noise) -> Option<(Fit, Noise)> {
    let held = holding(linear, noise);
    if held.is_empty() {
        return None;
    }
    far_less(linear, from_perfect(linear, fit, &held)?, noise)
}

/// A set with one effect more, its fit and the problem about that, where the noise of `from` holds a misfit and no step gains; `None` unless
/// that leaves far less and is likelier.
pub fn begun_again<'s>(
    linear: &Linearisation<'s>,
    fit: &Fit,
    from: &Scored,
) -> Option<(Scored, Fit, Linearisation<'s>)> {
    let (scene, candidates) = (linear.scene, linear.candidates);
    let held = holding(linear, &from.noise);
    if held.is_empty() || from.set.len() >= scene.settings.search.most {
        return None;
    }
    let start = from_perfect(linear, fit, &held)?;
    let quiet = from.noise.clone().scaled(RELEASED);
    let about = Linearisation::new(scene, candidates, &start, &quiet, None).ok()?;
    let (own, ranked) = about.ranked(&from.set, &quiet).ok()?;
    let acts_there = |effect: &Effect| matches!(effect.sensors, [kind] if held.contains(kind));
    let likely = ranked.into_iter().filter(|(value, effect)| *value > own && acts_there(effect));
    let with = |effect: &'static Effect| {
        let values = about.refined(effect, &start.doses, &from.set, &quiet).ok()?;
        let doses = start.doses.iter().cloned().chain([Dose { effect, values }]).collect();
        let (free, lower) = far_less(linear, start.clone().with(scene, doses).ok()?, &from.noise)?;
        let problem = Linearisation::new(scene, candidates, &free, &lower, None).ok()?;
        let set: Vec<&'static Effect> = from.set.iter().copied().chain([effect]).collect();
        let scored = problem.judge(&set, &lower, &SensorKind::ALL, &FAR).ok()?;
        Some((scored, free, problem))
    };
    let tried = likely.take(TRIED).filter_map(|(_, effect)| with(effect));
    let best = tried.max_by(|(a, ..), (b, ..)| a.log_evidence.total_cmp(&b.log_evidence));
    best.filter(|(best, ..)| best.log_evidence > from.log_evidence)
}

/// Sensors whose noise holds a misfit.
fn holding(linear: &Linearisation<'_>, noise: &Noise) -> Vec<SensorKind> {
    SensorKind::ALL.into_iter().filter(|kind| linear.weighing.holds_misfit(noise, *kind)).collect()
}

/// What a fit holds, with these sensors perfect and without the effects on them.
fn from_perfect(linear: &Linearisation<'_>, fit: &Fit, held: &[SensorKind]) -> Option<Fit> {
    let begins_again = |dose: &Dose| matches!(dose.effect.sensors, [kind] if held.contains(kind));
    let begun = |dose: &Dose| if begins_again(dose) { dose.without_amplitudes() } else { dose.clone() };
    let doses = fit.doses.iter().map(begun).collect();
    fit.clone().with(linear.scene, doses).ok()
}

/// A start fitted in a hundredth of a noise, and what it leaves of that noise, where that is far less.
fn far_less(linear: &Linearisation<'_>, start: Fit, noise: &Noise) -> Option<(Fit, Noise)> {
    let free = refit(linear.scene, start, Some(&noise.clone().scaled(RELEASED))).ok()?;
    let lower = linear.weighing.white(&free.residual).at_most(noise);
    let is_far_less = |kind| lower.largest(kind) < FAR_LESS * noise.largest(kind);
    SensorKind::ALL.into_iter().any(is_far_less).then_some((free, lower))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        diagnosis::{
            Source,
            library::candidates::{Candidates, Setting},
            residual::forward_model::ForwardModel,
            screening::preparation::Preparation,
            settings::Settings,
        },
        effect,
        recording::Stream,
        simulator::robot::{RobotKind, RobotScene},
    };

    const ARM: [f64; 3] = [1.0, 0.5, -0.5];

    /// A drone whose accelerometer sits on an arm, with a gain that a fit without the arm has made far too large and the gap as noise; the
    /// fit holds an arm of this length.
    fn hold(arm: Option<[f64; 3]>, ask: impl Fn(&Linearisation<'_>, &Fit, &Noise)) {
        let lever = effect::find("acc.lever_arm").unwrap();
        let of_length = |arm: [f64; 3]| Dose { effect: lever, values: arm.to_vec() };
        let doses = vec![of_length(ARM)];
        let flight =
            RobotScene { kind: RobotKind::Flying, duration: 60.0, doses, seed: 2, ..RobotScene::default() };
        let pair = flight.record("arm").unwrap();
        let (stream, settings) = (Stream::of(&pair.simulated), Settings::preset(Source::Simulator));
        let preparation = Preparation::new(&pair.real, stream.as_ref(), None, &settings).unwrap();
        let (usable, movement) = (preparation.usable.clone(), &*preparation.movement);
        let scene = ForwardModel::new(&pair.real, usable, movement, preparation.triads, &settings);
        let setting = Setting {
            kinds: &scene.kinds,
            thermometer: false,
            calibrated: &[],
            provided: settings.source,
            field_known: true,
        };
        let candidates = Candidates::new(&setting, &[], &[]);
        let value = |effect: &Effect| if effect.id == "acc.scale" { 8.0 } else { 0.0 };
        let of =
            |effect: &&'static Effect| Dose { effect, values: vec![value(effect); effect.parameters.len()] };
        let doses = candidates.baseline.iter().map(of).chain(arm.map(of_length)).collect();
        let fit = Fit::of(&scene, doses).unwrap();
        let linear = Linearisation::fitted_alone(&scene, &candidates, &fit).unwrap();
        let mut noise = linear.weighing.white(&fit.residual);
        let acc = &mut noise.sensors[SensorKind::Acc as usize];
        (acc.white, acc.moving) = ([30.0; 3], [30.0; 3]);
        ask(&linear, &fit, &noise);
    }

    /// The unit's axes are off by up to a degree.
    fn assert_is_the_arm(fit: &Fit) {
        let found = &fit.doses.iter().find(|dose| dose.effect.id == "acc.lever_arm").unwrap().values;
        assert!(found.iter().zip(ARM).all(|(found, arm)| (found - arm).abs() < 0.04), "{found:?}");
    }

    #[test]
    fn an_arm_that_its_usual_length_holds_back_is_released_where_the_noise_holds_a_misfit() {
        hold(Some([0.02, 0.01, -0.01]), |linear, fit, noise| {
            let (free, lower) = released(linear, fit, noise).expect("it leaves far less");
            assert_is_the_arm(&free);
            assert!(lower.largest(SensorKind::Acc) < 1.0, "{lower:?}");
            assert!(released(linear, &free, &lower).is_none(), "nothing is held any more");
        });
    }

    #[test]
    fn a_drift_many_times_what_a_fit_leaves_begins_again_and_another_stays() {
        hold(Some(ARM), |linear, fit, noise| {
            let begun = |noise: &Noise| linear.weighing.drift_begun_again(noise.clone(), &fit.residual);
            assert_eq!(begun(noise), *noise);
            let mut far = noise.clone();
            far.sensors[SensorKind::Acc as usize].drift = [1e5; 2];
            assert_eq!(begun(&far), *noise);
        });
    }

    #[test]
    fn an_arm_that_no_step_finds_is_found_from_a_perfect_sensor() {
        hold(None, |linear, fit, noise| {
            let from = linear.judge(&[], noise, &[], &FAR).unwrap();
            let (best, free, about) = begun_again(linear, fit, &from).expect("an arm is likelier");
            assert_is_the_arm(&free);
            assert!(best.noise.largest(SensorKind::Acc) < 1.0, "{:?}", best.noise);
            assert!(begun_again(&about, &free, &best).is_none(), "nothing is held any more");
        });
    }
}
