//! Hard iron on the gimbals: what it leaves in a fit that does not know it, what of it can be observed, and which of its
//! entries are held for any order of the rig's axes.

use imucal_core::model::{
    rig::{Axis, GimbalPose, Pose, RigAxes},
    unified::{Terms, UnifiedParameters},
};
use imucal_host::{
    calibrate::{
        fit::rig_fit::{RigFit, fit},
        known_attitudes::ladder::{T12, X18, X21},
        known_attitudes::rig::unified_name,
    },
    observe::pose::Poses,
};
use imucal_tests::rig::{Draw, poses};
use nalgebra::Vector3;

/// Earth's field in n, µT: 475 mG, dip 58°, declination 5°.
const FIELD: Vector3<f64> = Vector3::new(25.1, 2.2, 40.3);
/// A source on each gimbal, µT: 15 mG.
const SOURCE: f64 = 1.5;
/// White noise of a pose's mean, µT.
const SIGMA: f64 = 0.0022;
const AXES: [[Axis; 3]; 3] =
    [[Axis::Z, Axis::Y, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]];

/// A magnetometer on a rig with a source on the outer and the middle gimbal.
fn on_gimbals(draw: &mut Draw) -> UnifiedParameters<f64> {
    let mut truth = draw.triad(FIELD, 20.0);
    truth.outer_source = draw.direction() * SOURCE;
    truth.middle_source = draw.direction() * SOURCE;
    truth
}

fn turned(count: usize, draw: &mut Draw) -> Vec<Vector3<f64>> {
    let half = std::f64::consts::PI;
    (0..count).map(|_| Vector3::from_fn(|_, _| draw.within(half))).collect()
}

fn from_nominal<const P: usize>(poses: &Poses, terms: Terms<P>, field: Vector3<f64>) -> RigFit {
    let fit = fit(poses, &UnifiedParameters::nominal(field), terms);
    assert!(fit.report.solver.termination.was_successful(), "{:?}", fit.report);
    fit
}

/// Largest difference of what two sets of parameters predict at new angles, µT.
fn apart(a: &UnifiedParameters<f64>, b: &UnifiedParameters<f64>, axes: RigAxes, draw: &mut Draw) -> f64 {
    let rotations =
        turned(200, draw).into_iter().map(|at| GimbalPose::new(Vector3::zeros(), &at).rotations(&axes));
    rotations.map(|r| (a.predict(&r) - b.predict(&r)).norm()).fold(0.0, f64::max)
}

/// The index of an axis.
fn along(axis: Axis) -> usize {
    axis as usize
}

#[test]
fn gimbal_sources_are_large_in_twelve_parameters_and_gone_in_eighteen() {
    let (mut without, mut with, mut worst) = (0.0, 0.0, 0.0f64);
    for (seed, axes) in (0..10).zip(AXES.into_iter().cycle()) {
        let mut draw = Draw::new(seed);
        let (axes, truth) = (RigAxes(axes), on_gimbals(&mut draw));
        let at = turned(60, &mut draw);
        let poses = poses(&truth, axes, &at, SIGMA, &mut draw);
        let basic = from_nominal(&poses, T12, FIELD);
        let extended = from_nominal(&poses, X18, FIELD);
        // The simulated check values have 5.4 mG for one draw; a source is 15 mG, and a twelve-parameter fit keeps
        // what turns with the table. Any draw leaves a tenth of it at least.
        assert!((0.15..2.0).contains(&basic.report.rms), "seed {seed}: {}", basic.report.rms);
        without += basic.report.rms * basic.report.rms;
        with += extended.report.rms * extended.report.rms;
        // The middle gimbal's source along the inner axis is bias, and is so in any field measured on this rig.
        let as_bias = Vector3::ith(along(axes.0[2]), truth.middle_source[along(axes.0[2])]);
        let (gain, _) = (extended.parameters.sensitivity.try_inverse().expect("near identity"), ());
        for _ in 0..100 {
            let field = draw.direction() * FIELD.norm();
            let output = truth.sensitivity * (field + as_bias) + truth.bias;
            let calibrated = gain * (output - extended.parameters.bias);
            worst = worst.max(calibrated.angle(&field).to_degrees());
        }
    }
    let (without, with) = ((without / 10.0).sqrt(), (with / 10.0).sqrt());
    println!("M12 {:.2} mG, X18 {:.4} mG, direction {worst:.5}°", 10.0 * without, 10.0 * with);
    assert!(without > 100.0 * SIGMA, "{without}");
    // 10 × 164 degrees of freedom know it to 2 %.
    assert!((0.9..1.1).contains(&(with / SIGMA)), "{with}");
    assert!(worst <= 0.01, "{worst}°");
}

#[test]
fn with_a_known_field_sixteen_of_eighteen_are_observable_whatever_the_axes() {
    for axes in AXES {
        let mut draw = Draw::new(40);
        let truth = on_gimbals(&mut draw);
        let at = turned(60, &mut draw);
        let fit = from_nominal(&poses(&truth, RigAxes(axes), &at, SIGMA, &mut draw), X18, FIELD);
        assert_eq!((fit.entries.len(), fit.free()), (18, 16), "{axes:?}: {:?}", fit.held);
        // Along the inner axis the middle gimbal's source is bias; along the middle axis one source is the other.
        let [_, middle, inner] = axes.map(|axis| ["x", "y", "z"][along(axis)]);
        let names: Vec<String> = fit.held.iter().map(|(entry, _)| unified_name(*entry)).collect();
        assert!(names.contains(&format!("middle_hard_iron_{inner}")), "{axes:?}: {names:?}");
        let either = [format!("outer_hard_iron_{middle}"), format!("middle_hard_iron_{middle}")];
        assert!(either.iter().any(|name| names.contains(name)), "{axes:?}: {names:?}");
        for (entry, _) in &fit.held {
            assert_eq!(fit.std(*entry), Some(0.0), "held, so without an error of its own");
        }
    }
}

#[test]
fn with_an_unknown_field_seventeen_of_twenty_one_are_observable() {
    for axes in AXES {
        let mut draw = Draw::new(50);
        let truth = on_gimbals(&mut draw);
        let at = turned(60, &mut draw);
        let poses = poses(&truth, RigAxes(axes), &at, SIGMA, &mut draw);
        let fit = from_nominal(&poses, X21, FIELD + Vector3::new(0.4, -0.6, 0.3));
        assert_eq!((fit.entries.len(), fit.free()), (21, 17), "{axes:?}: {:?}", fit.held);
        let of_field = fit.held.iter().filter(|(entry, _)| (14..17).contains(entry)).count();
        assert_eq!(of_field, 2, "{axes:?}: {:?}", fit.held);
        assert!(
            (0.8..1.2).contains(&(fit.report.rms / SIGMA)),
            "{axes:?}: 163 degrees of freedom know it to 6 %"
        );
    }
}

#[test]
fn without_noise_the_sources_are_the_truth_s_up_to_the_gauge() {
    for (seed, axes) in (0..12).zip(AXES.into_iter().cycle()) {
        let mut draw = Draw::new(70 + seed);
        let truth = on_gimbals(&mut draw);
        let (rig, at) = (RigAxes(axes), turned(40, &mut draw));
        let poses = poses(&truth, rig, &at, 0.0, &mut draw);
        let known = from_nominal(&poses, X18, FIELD);
        // Rounding of 40 µT, a hundredth of a picotesla, times the condition of the fit.
        let far = apart(&known.parameters, &truth, rig, &mut draw);
        assert!(far < 1e-9, "seed {seed}: {far}");
        let [outer, middle, inner] = axes.map(along);
        let (found, found_middle) = (known.parameters.outer_source, known.parameters.middle_source);
        for (component, expected, got) in [
            ("outer along outer", truth.outer_source[outer], found[outer]),
            ("outer along inner", truth.outer_source[inner], found[inner]),
            ("middle along outer", truth.middle_source[outer], found_middle[outer]),
            (
                "both along middle",
                truth.outer_source[middle] + truth.middle_source[middle],
                found[middle] + found_middle[middle],
            ),
        ] {
            assert!((expected - got).abs() < 1e-8, "seed {seed}, {component}: {got} against {expected}");
        }
        let bias = truth.bias + truth.sensitivity * Vector3::ith(inner, truth.middle_source[inner]);
        assert!((known.parameters.bias - bias).norm() < 1e-8, "seed {seed}: {}", known.parameters.bias);

        // Of an unknown field the start is off in direction and length; predictions do not depend on either.
        let unknown = from_nominal(&poses, X21, FIELD * 1.01 + Vector3::new(0.3, -0.5, 0.2));
        let far = apart(&unknown.parameters, &truth, rig, &mut draw);
        assert!(far < 1e-8, "seed {seed}, field unknown: {far}");
    }
}

#[test]
fn sources_are_off_by_their_standard_errors() {
    let mut scores = Vec::new();
    for (seed, axes) in (0..60).zip(AXES.into_iter().cycle()) {
        let mut draw = Draw::new(200 + seed);
        let truth = on_gimbals(&mut draw);
        let at = turned(40, &mut draw);
        let fit = from_nominal(&poses(&truth, RigAxes(axes), &at, SIGMA, &mut draw), X18, FIELD);
        let [outer, _, inner] = axes.map(along);
        for (expected, entry) in [
            (truth.outer_source[outer], 17 + outer),
            (truth.outer_source[inner], 17 + inner),
            (truth.middle_source[outer], 20 + outer),
        ] {
            let std = fit.std(entry as u8).filter(|std| *std > 0.0).expect("observable");
            scores.push((fit.parameters.to_vector()[entry] - expected) / std);
        }
    }
    let (mean, std) = imucal_tests::rig::moments(&scores);
    println!("sources: mean {mean:.3}, standard deviation {std:.3} of {}", scores.len());
    // 180 scores: three standard errors of their mean and of their spread.
    assert!(mean.abs() < 0.23, "{mean}");
    assert!((std - 1.0).abs() < 0.17, "{std}");
}
