//! A triad on a rig: a rung of its ladder made a calibration, with what belongs to the machine kept apart.

use imucal_core::{
    accept::{self, Limits, Quantity, Refusal},
    coverage::Coverage,
    model::unified::UnifiedParameters,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::{ladder, ladder::Rung};
use crate::{
    calibrate::{
        Options,
        fit::{compare, heading::Heading, rig_fit::RigFit},
        nonlinear_terms::NonlinearFinding,
        outcome::{
            Calibration, Estimates, Evidence, FitSummary, Refused, RigFindings, SensorOutcome, entry_name,
        },
        temperature::{TemperatureFinding, Thermometry, poses as warm_poses},
    },
    observe::pose::{self, Poses},
    recording::{Recording, SensorKind, Triple, Unit},
};

/// Poses at least: the affine part has twelve parameters, and each pose gives three.
const LEAST_POSES: usize = 6;

/// A tilt with a larger standard error is not determined, rad: a spirit level knows it to 0.2°.
const LEVELLED: f64 = 3.5e-3;
/// A larger heading of the base is warned of, rad.
const TURNED: f64 = 0.1;
/// A tilt is one from so many standard errors on.
const SIGNIFICANT_TILT: f64 = 4.0;

/// The accelerometer on a rig; `None` where there is none, or the field form is asked for.
pub fn accelerometer(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    gravity: f64,
    options: &Options,
    (calibration, thermometry): (&mut Calibration, Option<&Thermometry<'_>>),
) -> Option<SensorOutcome> {
    let name = options.rig_acc?;
    let poses = poses(recording, sensor, usable, calibration)?;
    let down = Vector3::new(0.0, 0.0, -gravity);
    if options.compare {
        let steps = ladder::ACCELEROMETER.iter().filter_map(|(name, _)| ladder::rung(name, &poses, down));
        calibration
            .comparisons
            .extend(compare::climb(SensorKind::Acc, steps.map(|rung| rung.step()).collect()));
    }
    let Some(mut rung) = ladder::rung(name, &poses, down) else {
        return Some(too_few(SensorKind::Acc, name, &poses));
    };
    let level = tells_tilt(&rung.fit);
    if !level && let Some(lower) = ladder::rung("T12", &poses, down) {
        calibration.warnings.push(format!(
            "acc: the poses do not distinguish the base's tilt from K; T12 is used instead of {name}, with the base taken as level"
        ));
        rung = lower;
    }
    let found = thermometry.map(|thermometry| warm(&mut rung, &poses, thermometry, down));
    let (finding, reduced) = found.unzip();
    let poses = reduced.flatten().unwrap_or(poses);
    if level && !options.compare {
        calibration.warnings.extend(contradicted(&rung, &poses, down));
    }
    let mut outcome = outcome(SensorKind::Acc, &rung, &poses, sensor, gravity);
    if let Some(fit) = &mut outcome.fit {
        fit.temperature = finding;
    }
    Some(outcome)
}

/// A warning where a larger model of the ladder is borne out: terms that are there and are not estimated are in gain and
/// bias, and the residual of a linear model does not show them where it is small.
fn contradicted(rung: &Rung, poses: &Poses, down: Vector3<f64>) -> Option<String> {
    let larger = ladder::ACCELEROMETER.iter().skip_while(|(name, _)| *name != rung.name).skip(1);
    let larger = larger.filter_map(|(name, _)| ladder::rung(name, poses, down));
    let own = ladder::rung(rung.name, poses, down)?;
    let steps = std::iter::once(own.step()).chain(larger.map(|rung| rung.step())).collect();
    let found = compare::climb(SensorKind::Acc, steps).filter(|found| found.chosen != rung.name)?;
    let (name, better, why) = (rung.name, found.chosen, found.why);
    Some(format!(
        "acc: the poses contradict {name}: {why}; use --model acc={better}, or `imucal diagnose` where the rig itself \
         may be the cause"
    ))
}

/// What the poses say of temperature. Where terms are kept, the poses as they would be at the reference temperature, and
/// the rung fitted to these, with the errors of the fit of all parameters together.
fn warm(
    rung: &mut Rung,
    poses: &Poses,
    thermometry: &Thermometry<'_>,
    down: Vector3<f64>,
) -> (TemperatureFinding, Option<Poses>) {
    let base = UnifiedParameters::nominal(down);
    let (finding, kept) = warm_poses::estimate(poses, thermometry, (rung.name, &rung.fit), &base);
    let Some(kept) = kept else { return (finding, None) };
    let all = UnifiedParameters::from_vector(&nalgebra::SVector::from_fn(|k, _| {
        if k < kept.fit.model { kept.fit.fitted.theta[k] } else { 0.0 }
    }));
    let Some(gain) = all.sensitivity.try_inverse() else { return (finding, None) };
    let triad = Triad { gain, bias: all.bias };
    let mut reduced = poses.of_those(&kept.fit.used);
    for (pose, k) in reduced.poses.iter_mut().zip(&kept.fit.used) {
        pose.value = kept.terms.reduced(&triad, &pose.value, kept.temperatures[*k]);
    }
    let Some(mut fitted) = ladder::rung(rung.name, &reduced, down) else { return (finding, None) };
    let size = kept.fit.model;
    fitted.fit.covariance = kept.fit.covariance.view((0, 0), (size, size)).into_owned();
    fitted.fit.report = kept.fit.report(&fitted.fit.report, 3);
    *rung = fitted;
    (finding, Some(reduced))
}

/// The poses determine the base's tilt, where it was asked for. Held is the exact case; noise, scatter of the stops and a
/// tilted base leave poses that ought to be exact a little of their own, and an error far beyond any base.
fn tells_tilt(fit: &RigFit) -> bool {
    [12, 13].iter().all(|entry| {
        let held = fit.held.iter().any(|(held, _)| held == entry);
        !held && fit.std(*entry).is_none_or(|std| std <= LEVELLED)
    })
}

/// The base's tilt as the accelerometer has it, and its standard errors, rad.
fn tilt(calibration: &Calibration) -> Option<([f64; 2], [f64; 2])> {
    calibration.sensor(SensorKind::Acc)?.passed()?.rig.as_ref()?.tilt
}

/// The base's tilt; `None` where it is none or hardly determined: an error of its own would pass for one of the field.
fn known_tilt(calibration: &Calibration) -> Option<[f64; 2]> {
    let (tilt, std) = tilt(calibration)?;
    tilt.iter().zip(std).any(|(tilt, std)| tilt.abs() > SIGNIFICANT_TILT * std).then_some(tilt)
}

/// The magnetometer on a rig whose site has a known field; `None` otherwise, or where the field form is asked for.
pub fn magnetometer(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    options: &Options,
    calibration: &mut Calibration,
) -> Option<SensorOutcome> {
    let name = options.rig_mag?;
    let field = Vector3::from(recording.manifest.site.field_ned_ut?);
    let poses = poses(recording, sensor, usable, calibration)?;
    // The base stands for both sensors: a tilt of 0.05° is 0.1 % of the horizontal field, and of K where that alone
    // determines its scale.
    let mut base = UnifiedParameters::nominal(field);
    if let Some(tilt) = known_tilt(calibration) {
        base.tilt = tilt;
    }
    if options.compare {
        let steps =
            ladder::MAGNETOMETER.iter().filter_map(|(name, _)| ladder::rung_from(name, &poses, &base));
        calibration
            .comparisons
            .extend(compare::climb(SensorKind::Mag, steps.map(|rung| rung.step()).collect()));
    }
    let Some(mut rung) = ladder::rung_from(name, &poses, &base) else {
        return Some(too_few(SensorKind::Mag, name, &poses));
    };
    let pointed = match name {
        "X18" => Some("X21"),
        "M12" => Some("M15"),
        _ => None,
    };
    let pointed = pointed.and_then(|name| ladder::rung_from(name, &poses, &base));
    if let Some(pointed) = pointed
        && compare::p_value(&rung.step(), &pointed.step()).is_some_and(|p| p < compare::SIGNIFICANT)
    {
        let (name, better) = (rung.name, pointed.name);
        calibration.warnings.push(format!(
            "mag: {name} takes the field's direction as known, and the poses contradict it: the base's heading or \
             [site] field is off; use mag={better}, or point the base"
        ));
    }
    if tilt(calibration).is_none() && is_of_tilt(&rung) {
        calibration.warnings.push(format!(
            "mag: nothing shows the base's tilt, which {name} takes into gains and hard iron of the gimbals; the errors allow for {:.1}° \
             of it. Record the accelerometer in the same poses, or use mag=M15",
            LEVELLED.to_degrees()
        ));
    }
    let std = tilt(calibration).map_or([LEVELLED; 2], |(_, std)| std);
    allow_for_tilt(&mut rung, &poses, &base, std);
    calibration.warnings.extend(rung.fit.heading.and_then(turned));
    Some(outcome(SensorKind::Mag, &rung, &poses, sensor, field.norm()))
}

/// The rung takes the vertical as known: its field has the length that is known and turns about it.
fn is_of_tilt(rung: &Rung) -> bool {
    rung.fit.heading.is_some() || !rung.fit.entries.contains(&14)
}

/// A warning where the base stands far off the field's known direction.
fn turned(heading: Heading) -> Option<String> {
    match heading {
        Heading::Found(angle) if angle.abs() > TURNED => Some(format!(
            "mag: the base is turned by {:.1}° against [site] field_ned_ut, which gain and hard iron take into account",
            // The field turns the other way, seen from the base.
            -angle.to_degrees()
        )),
        _ => None,
    }
}

/// Adds to a rung's covariance what errors of the base's tilt, of these standard deviations in rad, do to it.
fn allow_for_tilt(rung: &mut Rung, poses: &Poses, base: &UnifiedParameters<f64>, std: [f64; 2]) {
    let values = |rung: &Rung| {
        let all = rung.fit.parameters.to_vector();
        let held = |entry: u8| rung.fit.held.iter().any(|(held, _)| *held == entry);
        let value = |entry: &u8| if held(*entry) { 0.0 } else { all[usize::from(*entry)] };
        DVector::from_iterator(rung.fit.entries.len(), rung.fit.entries.iter().map(value))
    };
    for (axis, std) in std.into_iter().enumerate() {
        let mut leaning = *base;
        leaning.tilt[axis] += std;
        if let Some(other) = ladder::rung_from(rung.name, poses, &leaning) {
            let moved = values(&other) - values(rung);
            rung.fit.covariance += &moved * moved.transpose();
        }
    }
}

/// The poses of a recording that has encoders; what is wrong with them is said once.
fn poses(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    calibration: &mut Calibration,
) -> Option<Poses> {
    recording.gimbal.as_ref()?;
    let found = pose::poses(recording, sensor, usable);
    let warning = match &found {
        Err(why) => Some(format!("the rig is not used: {why}")),
        Ok(poses) => {
            let (locked, all) = (poses.in_gimbal_lock(), poses.poses.len());
            (2 * locked > all).then(|| {
                format!(
                    "{locked} of {all} poses are in gimbal lock: outer and inner gimbal turn about one axis there, and \
                     two angles say what one does; turn the middle gimbal away from it"
                )
            })
        }
    };
    calibration.warnings.extend(warning.filter(|warning| !calibration.warnings.contains(warning)));
    found.ok()
}

fn too_few(kind: SensorKind, name: &'static str, poses: &Poses) -> SensorOutcome {
    refused(kind, name, Refusal::TooFewObservations { have: poses.poses.len(), need: LEAST_POSES }, None)
}

/// What the affine part of a rung is judged by.
pub(crate) fn limits() -> Limits {
    Limits { observations: LEAST_POSES, directions: LEAST_POSES, ..Limits::for_norm(12, LEAST_POSES) }
}

/// The outcome of one rung.
fn outcome(kind: SensorKind, rung: &Rung, poses: &Poses, sensor: &Triple, norm: f64) -> SensorOutcome {
    let summary = rung.fit.triad().map(|(triad, covariance)| {
        let directions = poses.poses.iter().map(|pose| triad.correct(&pose.value).normalize());
        let coverage = Coverage::of(directions);
        let unit_out = Unit::of(kind)[0];
        let mut summary = summarise(&rung.fit, sensor, unit_out, triad, covariance, coverage.share);
        summary.nonlinear = NonlinearFinding::of(&rung.fit, poses);
        (summary, coverage)
    });
    let Some((summary, coverage)) = summary else {
        return refused(kind, rung.name, Refusal::NotFinite, None);
    };
    match judge(&rung.fit, &summary, &coverage, norm) {
        Ok(()) => SensorOutcome {
            suspicions: Vec::new(),
            kind,
            model: rung.name,
            verdict: Ok(()),
            fit: Some(summary),
            evidence: Some(Evidence::Gimbals(poses.clone(), Box::new(rung.fit.clone()))),
        },
        Err(refusal) => refused(kind, rung.name, refusal, Some(summary)),
    }
}

/// A refusal with what to do.
fn refused(
    kind: SensorKind,
    model: &'static str,
    refusal: Refusal,
    fit: Option<FitSummary>,
) -> SensorOutcome {
    let advice = match refusal {
        Refusal::NoRest | Refusal::TooFewObservations { .. } => {
            "hold the table still for 2 s or more in 24 poses, faces and oblique ones"
        }
        Refusal::PoorCoverage { .. }
        | Refusal::IllConditioned { .. }
        | Refusal::Imprecise { .. }
        | Refusal::NotRedundant { .. } => "add poses upside down and oblique ones; turn all three gimbals",
        Refusal::Implausible { what: Quantity::Heading, .. } => "check [site] field_ned_ut, or use mag=M15",
        Refusal::Implausible { .. } => {
            "check [units], [rig] axes, the encoders' unit and signs, and [site] of the recording's TOML"
        }
        _ => "check the recording for motion during poses, clipping and wrong units",
    };
    SensorOutcome {
        suspicions: Vec::new(),
        kind,
        model,
        verdict: Err(Refused { refusal, advice: advice.into() }),
        fit,
        evidence: None,
    }
}

fn judge(fit: &RigFit, summary: &FitSummary, coverage: &Coverage<f64>, norm: f64) -> Result<(), Refusal> {
    let limits = limits();
    accept::check_observations(coverage, fit.free(), &limits)?;
    if fit.report.residuals <= fit.free() {
        let need = fit.free() / 3 + 1;
        return Err(Refusal::TooFewObservations { have: fit.report.residuals / 3, need });
    }
    accept::check_report(&fit.report.solver)?;
    if let Some(Heading::None(value)) = fit.heading {
        return Err(Refusal::Implausible { what: Quantity::Heading, value, limit: 1.0 });
    }
    accept::check_precision(summary.relative_error(norm), &limits)?;
    // Arbitrary units have no nominal gain.
    let nominal = summary.unit_in != Unit::Arbitrary;
    accept::check_plausibility(&summary.triad, nominal, fit.report.rms / norm, &limits)?;
    summary.nonlinear.as_ref().map_or(Ok(()), |found| found.check(&limits))
}

/// The figures of a fit; `triad` and `covariance` are [`RigFit::triad`]'s.
pub(crate) fn summarise(
    fit: &RigFit,
    sensor: &Triple,
    unit_out: Unit,
    triad: Triad<f64>,
    covariance: DMatrix<f64>,
    coverage: f64,
) -> FitSummary {
    let std = |k: usize| covariance[(k, k)].sqrt();
    let std =
        Triad { gain: Matrix3::from_fn(|i, j| std(3 * i + j)), bias: Vector3::from_fn(|i, _| std(9 + i)) };
    let estimates = Estimates { triad, std, covariance, covariance_of: (0..12).collect() };
    FitSummary {
        rig: Some(findings(fit)),
        ..FitSummary::new(&fit.report, estimates, sensor, unit_out, coverage)
    }
}

fn findings(fit: &RigFit) -> RigFindings {
    let three = |from: u8| Vector3::from_fn(|k, _| fit.std(from + k as u8).unwrap_or(0.0));
    let now = &fit.parameters;
    RigFindings {
        tilt: fit.std(12).zip(fit.std(13)).map(|(alpha, beta)| (now.tilt, [alpha, beta])),
        sources: fit
            .entries
            .contains(&17)
            .then(|| [(now.outer_source, three(17)), (now.middle_source, three(20))]),
        field_n: fit.entries.contains(&14).then_some(now.vector_n),
        unobservable: fit
            .held
            .iter()
            .map(|(entry, like)| match like {
                Some(like) => format!("{} (like {})", unified_name(*entry), unified_name(*like)),
                None => unified_name(*entry),
            })
            .collect(),
        ..RigFindings::default()
    }
}

/// Name of an entry of the unified model.
pub fn unified_name(entry: u8) -> String {
    let axis = |from: u8| ["x", "y", "z"][usize::from((entry - from) % 3)];
    match entry {
        0..9 => entry_name(entry).replace("gain", "K"),
        9..12 => entry_name(entry),
        12 => "tilt_x".into(),
        13 => "tilt_y".into(),
        14..17 => format!("field_{}", axis(14)),
        17..20 => format!("outer_hard_iron_{}", axis(17)),
        20..23 => format!("middle_hard_iron_{}", axis(20)),
        23..26 => format!("quadratic_{}", axis(23)),
        26..29 => format!("cubic_{}", axis(26)),
        _ => format!("cross_product_{}", axis(29)),
    }
}
