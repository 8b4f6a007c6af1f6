//! Whether the triads have the axes they are said to have: none mirrored, negated or swapped.
//!
//! Norms are blind to it. What shows it, by hand and with the accelerometer's axes as the frame:
//!
//! | relation | known from | means |
//! | --- | --- | --- |
//! | A, gyroscope to accelerometer | gravity over the turns, see [`super::turn_sense`] | improper: the gyroscope is mirrored |
//! | M, magnetometer to accelerometer, proper | the dip's constancy, see [`crate::calibrate::fit::alignment`] | a mirrored one of the two is like one turned by M in a field reversed |
//! | the dip's sign against the site's | `[site]` | reversed: the magnetometer or the accelerometer is mirrored |
//!
//! `A ≠ 1` and proper: the accelerometer or the gyroscope. M says which: the one that agrees with the magnetometer is
//! right. Nothing is undone here, since the guess may be wrong: what contradicts is refused, and what would mend it is
//! named. On a rig attitudes are known, the gain takes the order of the axes up, and it is said.
//!
//! Not seen: two sensors turned alike, which is how they are mounted; without a site, all axes of the magnetometer or of
//! the accelerometer reversed.

use imucal_core::{
    accept::{Quantity, Refusal},
    model::{
        dip::{LEAST_DIP, OBLIQUE},
        unified::UnifiedParameters,
    },
    triad::Triad,
};
use nalgebra::Matrix3;

use super::{body_axes, gain_remark, turn_sense, turn_sense::Sense};
use crate::{
    calibrate::{
        fit::reference_fit,
        outcome::{Calibration, Evidence, FitSummary, Refused, SensorOutcome},
        suspicion::{Follows, Suspicion},
    },
    effect::axis_swap::{columns, nearest, signed_permutation},
    observe::{motion, pose},
    recording::{Recording, SensorKind, Unit},
};

/// What is known of a magnetometer next to an accelerometer.
struct Aligned {
    /// M, where it is an order of the axes.
    order: Option<Matrix3<f64>>,
    /// The dip is reversed against the site's; `None` where the site or the dip does not say.
    reversed: Option<bool>,
    /// Dip, rad.
    dip: f64,
}

/// Looks at what was calibrated; refuses what contradicts, and warns of what cannot be decided.
pub fn check(recording: &Recording, calibration: &mut Calibration) {
    let sense = sense(recording, calibration);
    if let Some(sense) = sense.filter(|sense| sense.factor != 1.0) {
        wrong_unit(recording, calibration, sense.factor);
    }
    let turned = sense.filter(|sense| sense.factor == 1.0).map(|sense| sense.code);
    if on_rig(calibration, SensorKind::Acc) {
        undone(calibration);
        rig_gyroscope(calibration, turned);
    } else {
        by_hand(recording, calibration, turned);
    }
    calibration.warnings.extend(body_axes::remark(recording, calibration));
    for outcome in &calibration.sensors {
        let by_gain =
            |refused: &Refused| matches!(refused.refusal, Refusal::Implausible { what: Quantity::Gain, .. });
        let odd = outcome.kind != SensorKind::Gyr && outcome.verdict.as_ref().is_err_and(by_gain);
        let fit = outcome.fit.as_ref().filter(|_| odd).or(outcome.passed());
        let Some(fit) = fit.filter(|fit| fit.field_norm.is_none()) else { continue };
        calibration.warnings.extend(gain_remark::remark(outcome.kind, fit.unit_in, &fit.triad.gain));
    }
}

/// Attitudes of a rig or a reference were known.
fn on_rig(calibration: &Calibration, kind: SensorKind) -> bool {
    calibration.sensor(kind).and_then(SensorOutcome::passed).is_some_and(|fit| fit.rig.is_some())
}

/// The sense of the turns; against nominal directions where the accelerometer is refused.
fn sense(recording: &Recording, calibration: &Calibration) -> Option<Sense> {
    let found = calibration.segmentation.as_ref().map(|cut| cut.rests.clone()).unwrap_or_default();
    let rests = if found.len() > turn_sense::TURNS.0 { found } else { turn_sense::rests_by_force(recording) };
    let fit = calibration.sensor(SensorKind::Acc).and_then(SensorOutcome::passed);
    let acc = fit.map_or_else(Triad::identity, |fit| fit.triad);
    let refused = calibration.sensor(SensorKind::Gyr).is_some_and(|gyr| gyr.verdict.is_err());
    turn_sense::of(recording, &rests, &acc, refused)
}

/// A refused gyroscope that would follow gravity in another unit.
fn wrong_unit(recording: &Recording, calibration: &mut Calibration, factor: f64) {
    let unit = recording.manifest.units.gyr;
    let meant = Unit::of(SensorKind::Gyr).iter().find(|other| {
        let ratio = other.per_si().zip(unit.per_si()).map(|(other, own)| own / other);
        **other != unit && ratio.is_some_and(|ratio| (ratio / factor).ln().abs() < 0.1)
    });
    let mend = match meant {
        Some(meant) => format!("write gyr = \"{meant}\" below [units]"),
        None if unit == Unit::Counts => "check per_unit of gyr below [counts], and t of [units]".into(),
        None => "check gyr and t of [units], and the range that the driver assumes".into(),
    };
    let reason = gain_remark::reason(factor);
    let advice = format!(
        "gyr.unit_error: gravity moves between rests as {factor:.4} times the rates would have it; {reason}; {mend}"
    );
    let acc = calibration.sensors.iter_mut().find(|outcome| outcome.kind == SensorKind::Acc);
    if let Some(Err(refused)) = acc.map(|acc| &mut acc.verdict) {
        refused.advice = format!("{advice}; rates that large hide the rests");
    }
    let limit = if factor < 1.0 { 0.5 } else { 2.0 };
    let refusal = Refusal::Implausible { what: Quantity::Gain, value: factor, limit };
    refuse(calibration, SensorKind::Gyr, refusal, advice);
}

/// On a rig a gain has the order of the axes in it.
fn undone(calibration: &mut Calibration) {
    for kind in SensorKind::ALL {
        // Along a reference the field's direction is determined with the gain, up to both reversed: see `along_reference`.
        let directed =
            |outcome: &&SensorOutcome| !matches!(outcome.evidence, Some(Evidence::Reference { .. }));
        let fit = calibration.sensor(kind).filter(directed).and_then(SensorOutcome::passed);
        let Some((code, _)) = fit.filter(|fit| fit.rig.is_some()).map(order).filter(|(code, _)| *code != 0)
        else {
            continue;
        };
        let mirrored = signed_permutation(code).is_some_and(|p| p.determinant() < 0.0);
        let cause = if mirrored { "it is mirrored" } else { "or the unit sits turned on the table" };
        let order = format!("{kind}.axis_swap: {}, {cause}", columns(kind, code));
        let others = refused_along_encoders(calibration, kind);
        if others.is_empty() {
            let warning = format!("{order}; the gain, determined from the rig's attitudes, corrects it");
            calibration.warnings.push(warning);
        } else if let Some(outcome) = calibration.sensors.iter_mut().find(|outcome| outcome.kind == kind) {
            let detail = format!(
                "{order}, or the encoders are read wrongly: {others} is refused along the same encoders; check [rig] axes, \
                 and the order, signs and unit of the encoders"
            );
            outcome.suspicions.push(Suspicion { follows: Follows::Attitude, detail });
        }
    }
}

/// The others that were fitted along the rig's encoders, where all are refused.
fn refused_along_encoders(calibration: &Calibration, kind: SensorKind) -> String {
    let along = |outcome: &&SensorOutcome| {
        outcome.kind != kind && outcome.fit.as_ref().is_some_and(|fit| fit.rig.is_some())
    };
    let others: Vec<&SensorOutcome> = calibration.sensors.iter().filter(along).collect();
    if others.iter().any(|outcome| outcome.verdict.is_ok()) {
        return String::new();
    }
    others.iter().map(|outcome| outcome.kind.to_string()).collect::<Vec<_>>().join(", ")
}

/// What a sensor's columns hold by its gain, and the angle to it.
fn order(fit: &FitSummary) -> (usize, f64) {
    nearest(&fit.triad.gain.transpose())
}

/// A gyroscope that was refused on a rig whose accelerometer gives the table's axes.
fn rig_gyroscope(calibration: &mut Calibration, turned: Option<usize>) {
    let mount = calibration.sensor(SensorKind::Acc).and_then(SensorOutcome::passed).map(|fit| order(fit).0);
    let refused = calibration.sensor(SensorKind::Gyr).is_some_and(|gyr| gyr.verdict.is_err());
    let Some(code) = turned.filter(|code| refused && *code != 0).and_then(signed_permutation) else { return };
    let code = nearest(&code.transpose()).0;
    if Some(code) != mount {
        let named = named(SensorKind::Gyr, &signed_permutation(code).unwrap_or_else(Matrix3::identity));
        refuse_axes(calibration, SensorKind::Gyr, code, format!("{named}; correct its columns"));
    }
}

fn named(kind: SensorKind, p: &Matrix3<f64>) -> String {
    format!("{kind}.axis_swap ({})", columns(kind, nearest(p).0))
}

/// Names what contradicts in a recording by hand. `turned` is the code of A.
fn by_hand(recording: &Recording, calibration: &mut Calibration, turned: Option<usize>) {
    undone(calibration);
    let aligned = aligned(recording, calibration).or_else(|| along_reference(recording, calibration));
    let a = turned.and_then(signed_permutation);
    match a {
        Some(a) if turned != Some(0) && on_rig(calibration, SensorKind::Gyr) => {
            against_reference(calibration, &a)
        }
        Some(a) if turned != Some(0) => contradicted(calibration, &a, aligned.as_ref()),
        a => {
            if let Some(aligned) = &aligned {
                magnetometer(calibration, aligned, a.is_some());
            }
        }
    }
    unchecked(calibration, turned.is_some(), aligned.is_some());
}

fn aligned(recording: &Recording, calibration: &Calibration) -> Option<Aligned> {
    let fit = calibration.sensor(SensorKind::Mag)?.passed()?;
    let alignment = fit.alignment.as_ref()?;
    let (code, angle) = nearest(&alignment.axes.rotation);
    let dip = alignment.dip.0;
    let down = recording.manifest.site.field_points_down().filter(|_| dip.abs() > LEAST_DIP);
    Some(Aligned {
        order: signed_permutation(code).filter(|_| angle < OBLIQUE),
        reversed: down.map(|down| down != (dip > 0.0)),
        dip,
    })
}

/// The same of a magnetometer that was calibrated along a reference attitude. However its frame stands, and the sensors
/// on its body: each fit takes its sensor for right-handed, and gives its axes and the direction of what it measures.
fn along_reference(recording: &Recording, calibration: &Calibration) -> Option<Aligned> {
    let outcome = calibration.sensor(SensorKind::Mag)?;
    let (fit, Evidence::Reference { fit: found, .. }) = (outcome.passed()?, outcome.evidence.as_ref()?)
    else {
        return None;
    };
    let force = force_along_reference(recording)?;
    let (code, angle) = nearest(&(force.sensitivity * fit.triad.gain));
    let upward = force.vector_n.normalize();
    let dip = (-upward.dot(&found.parameters.vector_n.normalize())).clamp(-1.0, 1.0).asin();
    let down = recording.manifest.site.field_points_down().filter(|_| dip.abs() > LEAST_DIP)?;
    let order = signed_permutation(code).filter(|_| angle < OBLIQUE);
    Some(Aligned { order, reversed: Some(down != (dip > 0.0)), dip })
}

/// The accelerometer along a reference, as its samples have it, roughly.
pub(super) fn force_along_reference(recording: &Recording) -> Option<UnifiedParameters<f64>> {
    let (acc, reference) = (recording.acc.as_ref()?, recording.reference.as_ref()?);
    let usable: Vec<bool> = acc.values.iter().map(|force| force.iter().all(|x| x.is_finite())).collect();
    let (poses, _) = pose::along_reference(&acc.values, &usable, &motion::of_reference(reference));
    reference_fit::start(&poses)
}

/// A gyroscope that was calibrated along a reference attitude, and an accelerometer that does not turn as it does.
fn against_reference(calibration: &mut Calibration, a: &Matrix3<f64>) {
    let gyr = calibration.sensor(SensorKind::Gyr).and_then(SensorOutcome::passed).map(order);
    if gyr.is_none_or(|(code, _)| code != 0) {
        return;
    }
    let (mirrored, turned) = (named(SensorKind::Acc, &-a), named(SensorKind::Acc, a));
    let advice = format!(
        "{mirrored}, or {turned}: the gyroscope agrees with the reference attitude; correct the columns"
    );
    refuse_axes(calibration, SensorKind::Acc, nearest(&-a).0, advice);
}

/// Gyroscope and accelerometer do not turn alike: A is no identity.
fn contradicted(calibration: &mut Calibration, a: &Matrix3<f64>, aligned: Option<&Aligned>) {
    let gyr = named(SensorKind::Gyr, &a.transpose());
    let turned = named(SensorKind::Acc, a);
    let mirrored = named(SensorKind::Acc, &-a);
    let code = |p: &Matrix3<f64>| nearest(p).0;
    let order = aligned.and_then(|aligned| aligned.order);
    let lean = "it is calibrated against the accelerometer; mend that first";
    if a.determinant() < 0.0 {
        // Mirrored alike, both sensors have each the other's axes and the sense of no turn.
        let both = *a == -Matrix3::identity() && order.is_none_or(|m| m != Matrix3::identity());
        let advice = format!("{gyr}: turns go against gravity's; correct its columns");
        if !both {
            refuse_axes(calibration, SensorKind::Gyr, code(&a.transpose()), advice);
            if let Some(aligned) = aligned {
                magnetometer(calibration, aligned, true);
            }
            return;
        }
        let alike =
            "or acc.axis_swap and gyr.axis_swap, both mirrored alike (two axes swapped, or one negated)";
        for kind in [SensorKind::Gyr, SensorKind::Acc] {
            let advice = format!("{gyr}, {alike}: turns go against gravity's; correct the columns");
            refuse_axes(calibration, kind, code(a), advice);
        }
        refuse_axes(calibration, SensorKind::Mag, 0, lean.into());
    } else if order == Some(Matrix3::identity()) {
        let advice = format!("{gyr}: accelerometer and magnetometer agree on the axes; correct its columns");
        refuse_axes(calibration, SensorKind::Gyr, code(&a.transpose()), advice);
        if let Some(aligned) = aligned {
            magnetometer(calibration, aligned, false);
        }
    } else if order == Some(*a) {
        let reversed = aligned.and_then(|aligned| aligned.reversed);
        let (p, what) = match reversed {
            Some(true) => (-a, mirrored),
            Some(false) => (*a, turned),
            None => (-a, format!("{mirrored}, or {turned}, which [site] latitude_deg would decide")),
        };
        let advice = format!("{what}: gyroscope and magnetometer agree on the axes; correct its columns");
        refuse_axes(calibration, SensorKind::Acc, code(&p), advice);
        refuse_axes(calibration, SensorKind::Gyr, 0, lean.into());
        refuse_axes(calibration, SensorKind::Mag, 0, lean.into());
    } else {
        let advice = format!(
            "{mirrored}, or {turned}, or {gyr}: this recording does not decide which; correct the columns"
        );
        refuse_axes(calibration, SensorKind::Acc, code(&-a), advice.clone());
        refuse_axes(calibration, SensorKind::Gyr, code(&a.transpose()), advice);
        refuse_axes(calibration, SensorKind::Mag, 0, lean.into());
    }
}

/// A magnetometer in the accelerometer's axes. `sure` says that the gyroscope has confirmed the accelerometer's, up to
/// all three reversed.
fn magnetometer(calibration: &mut Calibration, aligned: &Aligned, sure: bool) {
    let Aligned { order, reversed, dip } = aligned;
    let straight = *order == Some(Matrix3::identity());
    let dip = dip.to_degrees();
    match (reversed, order) {
        (Some(true), Some(m)) => {
            let acc = !sure || straight;
            let mut what = named(SensorKind::Mag, &-m.transpose());
            if acc {
                what += &format!(", or {}", named(SensorKind::Acc, &-m));
            }
            let advice = format!("{what}: the dip comes out as {dip:.0}°, the other way than at [site]; correct the columns");
            if acc {
                refuse_axes(calibration, SensorKind::Acc, nearest(&-m).0, advice.clone());
            }
            refuse_axes(calibration, SensorKind::Mag, nearest(&-m.transpose()).0, advice);
        }
        (Some(true), None) => {
            let advice = format!(
                "mag.axis_swap: the dip comes out as {dip:.0}°, the other way than at [site], so an axis is negated or two \
                 are swapped, of the magnetometer or the accelerometer; it is mounted too obliquely to say which"
            );
            refuse_axes(calibration, SensorKind::Mag, 7, advice);
        }
        (None, Some(m)) if !straight => {
            let what = named(SensorKind::Mag, &-m.transpose());
            let advice = format!(
                "add [site] latitude_deg: either it is mounted so that {} and the dip is {dip:.0}°, or it is mirrored, {what}, \
                 and the dip is {:.0}°",
                columns(SensorKind::Mag, nearest(&m.transpose()).0),
                -dip
            );
            refuse_axes(calibration, SensorKind::Mag, nearest(&-m.transpose()).0, advice);
        }
        (None, _) => calibration.warnings.push(format!(
            "mag: no [site] says which way the field dips: {dip:.0}° is assumed; were it the other way, the magnetometer or \
             the accelerometer would have all axes reversed (mag.axis_swap, acc.axis_swap)"
        )),
        (Some(false), Some(m)) if !straight => calibration.warnings.push(format!(
            "mag: {} against the accelerometer, by its mount or by {}; the gain undoes it",
            columns(SensorKind::Mag, nearest(&m.transpose()).0),
            named(SensorKind::Mag, &m.transpose())
        )),
        _ => {}
    }
}

/// Says of accepted sensors what nothing in the recording could check.
fn unchecked(calibration: &mut Calibration, turned: bool, aligned: bool) {
    let passed = |kind| calibration.sensor(kind).and_then(SensorOutcome::passed).is_some();
    let mut alone = Vec::new();
    if passed(SensorKind::Acc) && !turned && !aligned {
        alone.push((SensorKind::Acc, "turns with a gyroscope between rests"));
    }
    if passed(SensorKind::Mag) && !aligned {
        let evidence = calibration.sensor(SensorKind::Mag).and_then(|mag| mag.evidence.as_ref());
        match evidence {
            // On gimbals the site's field is known.
            Some(Evidence::Gimbals(..)) => {}
            Some(Evidence::Reference { .. }) => {
                alone.push((SensorKind::Mag, "an accelerometer and [site] latitude_deg"));
            }
            _ => alone.push((
                SensorKind::Mag,
                "an accepted accelerometer and eight rests or more in all directions",
            )),
        }
    }
    for (kind, need) in alone {
        calibration.warnings.push(format!(
            "{kind}: this recording does not show whether its axes are negated or swapped ({kind}.axis_swap); that needs {need}"
        ));
    }
}

fn refuse_axes(calibration: &mut Calibration, kind: SensorKind, code: usize, advice: String) {
    let refusal = Refusal::Implausible { what: Quantity::Axes, value: code as f64, limit: 0.0 };
    refuse(calibration, kind, refusal, advice);
}

/// Refuses a sensor; a gyroscope's refusal gets its true cause, and any other stays, with a warning.
fn refuse(calibration: &mut Calibration, kind: SensorKind, refusal: Refusal, advice: String) {
    let Some(outcome) = calibration.sensors.iter_mut().find(|outcome| outcome.kind == kind) else { return };
    if outcome.verdict.is_err() && kind != SensorKind::Gyr {
        calibration.warnings.push(advice);
        return;
    }
    outcome.verdict = Err(Refused { refusal, advice });
    outcome.evidence = None;
}
