//! The clock of a reference: how far the samples are ahead of it or behind it, and whether it runs at another rate.
//!
//! Offset and rate are terms of the baseline, so that no other effect stands for them, and each is named where it is one that
//! matters. A large one is looked for first, and the reference is read by that clock: the fit is linear in what is left.

use super::{estimates, shares, shares::Closed};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Amount, Cause},
        library::candidates::Candidates,
        search::{linearisation::Linearisation, stepwise::Solution},
    },
    effect::{Effect, Part},
    simulator::StreamClock,
};

/// An offset beyond this adds no more to the gap that is shown, s: the fit is linear in it.
const LINEAR: f64 = 0.25;

/// A term of the clock that is named.
pub struct Term {
    effect: &'static Effect,
    parameters: Vec<Amount>,
}

/// The terms that are causes, and what all causes close together with them.
pub struct Clock<'s> {
    /// The causes.
    pub causes: Vec<Cause>,
    /// What the causes of the set close of the gap that the terms are a part of; the terms' own shares stand last.
    pub closed: Closed,
    /// The set and the terms.
    pub set: Vec<&'static Effect>,
    /// The problem with the terms among its effects.
    pub linear: Linearisation<'s>,
}

/// The terms of the clock that are known and matter; the reference was read by `clock`.
pub fn terms(explained: &Solution<'_>, clock: &StreamClock) -> Result<Vec<Term>, DiagnosisError> {
    let is_term = |term: &&'static Effect| matches!(term.part, Part::ClockTerm | Part::ClockRateTerm);
    let terms: Vec<&'static Effect> =
        explained.linear.candidates.baseline.iter().copied().filter(is_term).collect();
    let errors = explained.linear.scene.settings.verdict.clock_errors;
    let amounts = estimates::amounts_of(explained, &terms)?;
    let fitted = |part: Part| {
        let own = terms.iter().zip(&amounts).find(|(term, _)| term.part == part);
        own.and_then(|(_, amounts)| amounts.first()?.value).unwrap_or(0.0)
    };
    let rate = fitted(Part::ClockRateTerm);
    let named = terms.iter().zip(&amounts).filter_map(|(term, amounts)| {
        let whole = |value: f64| match term.part {
            Part::ClockTerm => value + clock.offset * (1.0 + rate),
            _ => (1.0 + value) * (1.0 + clock.error) - 1.0,
        };
        let amount = |amount: &Amount| Amount { value: amount.value.map(whole), ..amount.clone() };
        let parameters: Vec<Amount> = amounts.iter().map(amount).collect();
        let matters =
            estimates::is_material(term, &parameters) && estimates::is_sized(term, &parameters, errors);
        matters.then_some(Term { effect: term, parameters })
    });
    Ok(named.collect())
}

/// The baseline's candidates with the named terms among the effects; `None` without one.
pub fn candidates(candidates: &Candidates, terms: &[Term]) -> Option<Candidates> {
    let named: Vec<&'static Effect> = terms.iter().map(|term| term.effect).collect();
    let mut with = candidates.clone();
    with.baseline.retain(|term| !named.contains(term));
    with.effects.extend(&named);
    with.taken_out.extend(&named);
    (!named.is_empty()).then_some(with)
}

/// The named terms, along a reference attitude those that held-out blocks bear out, together with the `confirmed` causes;
/// `remainder` is the whitened size of what a driver still follows. `None` where there is none.
pub fn clock<'s>(
    explained: &'s Solution<'s>,
    candidates: &'s Candidates,
    terms: &[Term],
    confirmed: &[Cause],
    remainder: f64,
) -> Result<Option<Clock<'s>>, DiagnosisError> {
    let Solution { linear, best, fit, .. } = explained;
    // An effect that is not asserted would take its share of the held-out blocks all the same.
    let is_confirmed = |effect: &&'static Effect| confirmed.iter().any(|cause| cause.effect == effect.id);
    let mut set: Vec<&'static Effect> = best.set.iter().copied().filter(is_confirmed).collect();
    let others = set.len();
    set.extend(terms.iter().map(|term| term.effect));
    let shown = |term: &Term| {
        let value = |amount: &Amount| amount.value.unwrap_or_default().clamp(-LINEAR, LINEAR);
        (term.effect, term.parameters.iter().map(value).collect())
    };
    let linear = linear.with_effects(candidates, fit, terms.iter().map(shown).collect());
    let closed = shares::closed(&linear, &set, &best.noise, remainder)?;
    // Along a stream an offset beyond its errors is there, however unsure a share is of which the other term takes a part.
    let is_exact = explained.linear.scene.settings.source.followed;
    let own = terms.iter().zip(&closed.each[others..]);
    let own = own.filter(|(_, share)| is_exact || share.interval[0] > 0.0);
    let causes: Vec<Cause> = own
        .map(|(term, share)| Cause {
            effect: term.effect.id.clone(),
            probability: 1.0 - chance(&term.parameters),
            equivalents: Vec::new(),
            parameters: term.parameters.clone(),
            material: true,
            gap_closed: Some(share.value),
            gap_closed_ci95: Some(share.interval),
        })
        .collect();
    Ok((!causes.is_empty()).then_some(Clock { causes, closed, set, linear }))
}

/// Probability that an offset of zero would be estimated as far from zero.
fn chance(parameters: &[Amount]) -> f64 {
    let errors = |amount: &Amount| Some(amount.value? / amount.std_error?);
    let furthest = parameters.iter().filter_map(errors).fold(0.0f64, |most, errors| most.max(errors.abs()));
    libm::erfc(furthest / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

    use crate::{
        diagnosis::{Options, Verdict, diagnose},
        effect::{Machine, Truth},
        recording::{
            Recording,
            manifest::{Rig, RigKind},
        },
        simulator::{Motion, Place, SimulatedUnit, recent::Recent, record, truth::in_the_open},
    };

    const ID: &str = "clk.time_offset";

    /// A hand that swings a sensor without a rest, up to 4 rad/s, and moves it to and fro.
    struct Swung {
        /// Amplitude of the linear acceleration, m/s².
        acceleration: f64,
    }

    /// A step of numerical derivatives, s.
    const STEP: f64 = 1e-3;

    impl Swung {
        fn attitude(time: f64) -> Matrix3<f64> {
            let (x, y) = (0.4 * time + 1.1 * (1.3 * time).sin(), 0.9 * (0.9 * time + 1.0).sin());
            let z = 0.7 * time + 0.8 * (1.7 * time).sin();
            Rotation3::from_euler_angles(x, y, z).into_inner()
        }

        fn rate(time: f64) -> Vector3<f64> {
            let turn = Self::attitude(time - STEP).tr_mul(&Self::attitude(time + STEP));
            imucal_core::rotation::log(&turn) / (2.0 * STEP)
        }
    }

    impl Motion for Swung {
        fn duration(&self) -> f64 {
            40.0
        }

        fn truth_among(&self, time: f64, _: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
            let change = (Self::rate(time + STEP) - Self::rate(time - STEP)) / (2.0 * STEP);
            let attitude = Self::attitude(time);
            let mut truth = in_the_open(time, &attitude, Self::rate(time), change, &self.place(), recent);
            let to_and_fro = Vector3::new((5.3 * time).sin(), (4.1 * time).cos(), (6.7 * time).sin());
            truth.f_t += attitude.tr_mul(&to_and_fro) * self.acceleration;
            truth
        }

        fn rig(&self) -> Rig {
            Rig { kind: RigKind::Optical, axes: None }
        }

        fn place(&self) -> Place {
            Place::ankara()
        }
    }

    /// A recording at 50 Hz whose reference is `late` behind the samples, s, and trembles by 0.01°.
    fn tracked(acceleration: f64, late: f64) -> Recording {
        let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
        let mut recording = record("swung.csv", &Swung { acceleration }, &unit, 3);
        let trembling = |row: usize, axis: usize| 1.7e-4 * (7.3 * (row * row + 31 * axis) as f64).sin();
        let quaternion = |(row, time): (usize, &f64)| {
            let shown = Rotation3::from_matrix_unchecked(Swung::attitude(time - late));
            let off = Vector3::from_fn(|axis, _| trembling(row, axis));
            let q = UnitQuaternion::from_rotation_matrix(&shown) * UnitQuaternion::from_scaled_axis(off);
            [q.w, q.i, q.j, q.k]
        };
        recording.reference = Some(recording.time.iter().enumerate().map(quaternion).collect());
        recording
    }

    #[test]
    fn a_reference_s_latency_is_named_with_its_value() {
        for late in [-0.02, 0.01, 0.03, 0.05, 0.12] {
            let diagnosis = diagnose(&tracked(0.0, late), &Options::default(), &|_| ());
            let [cause] = &diagnosis.causes[..] else { panic!("{late}: {:?}", diagnosis.causes) };
            assert_eq!((cause.effect.as_str(), diagnosis.verdict), (ID, Verdict::Explained), "{late}");
            let (value, error) = (cause.parameters[0].value.unwrap(), cause.parameters[0].std_error.unwrap());
            // A late reference shows the sensor ahead of it.
            assert!((value - late).abs() < 4.0 * error && error < 5e-4, "{late}: {value} ± {error}");
            assert!(cause.gap_closed.unwrap() > 0.95, "{late}: {:?}", cause.gap_closed);
            assert_eq!(diagnosis.credible_set[0], ID);
        }
    }

    #[test]
    fn fast_motion_along_a_reference_in_time_has_no_gap() {
        let diagnosis = diagnose(&tracked(0.0, 0.0), &Options::default(), &|_| ());
        assert_eq!((diagnosis.verdict, diagnosis.causes.len()), (Verdict::None, 0), "{:?}", diagnosis.causes);
    }

    #[test]
    fn a_sensor_moved_to_and_fro_is_diagnosed_without_its_accelerometer() {
        let diagnosis = diagnose(&tracked(8.0, 0.01), &Options::default(), &|_| ());
        let remark = diagnosis.remarks.iter().find(|remark| remark.contains("the accelerometer is left out"));
        assert!(remark.is_some_and(|remark| remark.contains("moved to and fro")), "{:?}", diagnosis.remarks);
        assert!(diagnosis.gap.iter().all(|gap| gap.sensor != "acc"));
        let value = diagnosis.causes.iter().find(|cause| cause.effect == ID).unwrap().parameters[0].value;
        assert!((value.unwrap() - 0.01).abs() < 5e-4, "{value:?}");
    }
}
