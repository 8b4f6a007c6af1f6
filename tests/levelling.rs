//! The base's levelling: what a tilt does to a fit that takes the base as level, and to one that estimates it.

use imucal_core::model::unified::UnifiedParameters;
use imucal_host::{
    calibrate::{
        Options, calibrate,
        known_attitudes::ladder::{Rung, rung},
    },
    observe::pose::Poses,
    recording::SensorKind,
};
use imucal_tests::{
    rig::{Draw, ZYX, angles, cube, moments, poses, rms},
    simulated,
};
use nalgebra::{Rotation3, Vector3};

const GRAVITY: f64 = 9.799;
const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -GRAVITY);
/// White noise of a pose's mean, m/s².
const SIGMA: f64 = 0.00038;
/// Poses of the balanced set, residuals, and what is left of them by twelve parameters.
const RESIDUALS: f64 = 72.0;

fn fitted(name: &str, poses: &Poses) -> Rung {
    rung(name, poses, DOWN).expect("enough poses")
}

/// Root mean square of all residuals, as they are.
fn plain_rms(rung: &Rung) -> f64 {
    (rung.fit.report.squared_sum() / rung.fit.report.residuals as f64).sqrt()
}

/// An accelerometer on a base tilted by so much (rad) in a direction drawn.
fn tilted(tau: f64, draw: &mut Draw) -> UnifiedParameters<f64> {
    let mut truth = draw.triad(DOWN, 0.5);
    let (sin, cos) = draw.within(std::f64::consts::PI).sin_cos();
    truth.tilt = [tau * cos, tau * sin];
    truth
}

/// The cube's 24 attitudes behind one drawn: balanced, and no axis of the table on gravity.
fn balanced(draw: &mut Draw) -> Vec<Vector3<f64>> {
    let table = draw.attitude();
    cube().iter().map(|attitude| angles(&(attitude * table))).collect()
}

/// Attitudes of which each leans the same way: the table's x axis is in the northern half, its z axis in the lower.
fn unbalanced(draw: &mut Draw) -> Vec<Vector3<f64>> {
    let mut all = Vec::new();
    while all.len() < 24 {
        let attitude = draw.attitude();
        let column = |k: usize| attitude.matrix().column(k).into_owned();
        if column(0).x > 0.0 && column(2).z > -0.3 {
            all.push(angles(&attitude));
        }
    }
    all
}

#[test]
fn an_assumed_level_base_leaves_the_tilt_in_the_residual() {
    for (k, degrees) in [0.02f64, 0.05, 0.1, 0.2, 0.5].into_iter().enumerate() {
        let tau = degrees.to_radians();
        let (mut level, mut estimated) = (Vec::new(), Vec::new());
        for seed in 0..20 {
            let mut draw = Draw::new(1000 * k as u64 + seed);
            let at = balanced(&mut draw);
            let poses = poses(&tilted(tau, &mut draw), ZYX, &at, SIGMA, &mut draw);
            level.push(plain_rms(&fitted("T12", &poses)));
            estimated.push(fitted("I14", &poses).fit.report.rms);
        }
        // The tilt is orthogonal to all columns of K and b, which take 12 of 72 parts of the noise.
        let law = (SIGMA.powi(2) * (1.0 - 12.0 / RESIDUALS) + (GRAVITY * tau).powi(2) / 3.0).sqrt();
        let (level, estimated) = (rms(&level), rms(&estimated));
        println!("{degrees}°: T12 {level:.3e} (law {law:.3e}), I14 {estimated:.3e}");
        // K spreads the residual over the axes by up to 3 % each, of which twenty units average most.
        assert!((level / law - 1.0).abs() < 0.05, "{degrees}°: {level:.3e} against {law:.3e}");
        // 20 × 58 degrees of freedom know a standard deviation to 2 %.
        assert!((estimated / SIGMA - 1.0).abs() < 0.05, "{degrees}°: {estimated:.3e} against {SIGMA:.3e}");
    }
}

#[test]
fn at_a_tenth_of_a_degree_the_gap_is_that_of_the_simulated_check_values() {
    let mut draw = Draw::new(7);
    let truth = UnifiedParameters { tilt: [0.1f64.to_radians(), 0.0], ..UnifiedParameters::nominal(DOWN) };
    // Sixty poses in general position: 12 parameters of 180 take 7 % of the variance, tilt or noise alike.
    let at: Vec<_> = (0..60).map(|_| angles(&draw.attitude())).collect();
    let poses = poses(&truth, ZYX, &at, SIGMA, &mut draw);
    let (level, estimated) = (plain_rms(&fitted("T12", &poses)), plain_rms(&fitted("I14", &poses)));
    println!("T12 {level:.3e}, I14 {estimated:.3e}");
    // Rounded to two digits there; the poses drawn here move the first by 3 % and the noise the second by 6 %.
    assert!((level / 9.8e-3 - 1.0).abs() < 0.08, "{level}");
    assert!((estimated / 0.36e-3 - 1.0).abs() < 0.15, "{estimated}");
}

#[test]
fn tilts_are_off_by_their_standard_errors() {
    let mut scores = Vec::new();
    for seed in 0..200 {
        let mut draw = Draw::new(20_000 + seed);
        let tau = (0.02 + 0.24 * (1.0 + draw.within(1.0))).to_radians();
        let truth = tilted(tau, &mut draw);
        let at: Vec<_> = (0..24).map(|_| angles(&draw.attitude())).collect();
        let fit = fitted("I14", &poses(&truth, ZYX, &at, SIGMA, &mut draw)).fit;
        assert!(fit.held.is_empty(), "seed {seed}: {:?}", fit.held);
        for (axis, entry) in [(0, 12), (1, 13)] {
            let std = fit.std(entry).expect("estimated");
            // A few hundredths of a millidegree: the noise over the root of 24 poses, against gravity.
            assert!((1e-6..4e-5).contains(&std), "seed {seed}: {std}");
            scores.push((fit.parameters.tilt[axis] - truth.tilt[axis]) / std);
        }
    }
    let (mean, std) = moments(&scores);
    println!("tilt: mean {mean:.3}, standard deviation {std:.3} of {}", scores.len());
    // 400 scores: their mean is known to 0.05, their spread to 0.036; 58 degrees of freedom widen it by 2 %.
    assert!(mean.abs() < 0.15, "{mean}");
    assert!((std - 1.0).abs() < 0.15, "{std}");
}

/// Largest error of K or b of the level fit in standard errors that the noise alone would give, and its residual
/// over the noise.
fn damage(at: &[Vector3<f64>], seed: u64) -> (f64, f64) {
    let truth = tilted(0.1f64.to_radians(), &mut Draw::new(seed));
    let poses = poses(&truth, ZYX, at, SIGMA, &mut Draw::new(seed + 1));
    let (level, improved) = (fitted("T12", &poses).fit, fitted("I14", &poses).fit);
    let errors = (level.parameters.to_vector() - truth.to_vector()).fixed_rows::<12>(0).into_owned();
    let worst = (0..12u8)
        .map(|entry| {
            (errors[usize::from(entry)] / (level.std(entry).expect("estimated") / level.report.rms * SIGMA))
                .abs()
        })
        .fold(0.0, f64::max);
    assert!((0.7..1.4).contains(&(improved.report.rms / SIGMA)), "58 degrees of freedom know it to 9 %");
    (worst, level.report.rms / SIGMA)
}

#[test]
fn a_balanced_set_hides_the_tilt_and_an_unbalanced_one_does_not() {
    for seed in 0..10 {
        let mut draw = Draw::new(500 + seed);
        let (hidden, gap) = damage(&balanced(&mut draw), 600 + 2 * seed);
        // Of twelve normal scores none exceeds 4.5 in ten sets but once in 10 000 times; the tilt's square moves the
        // gain by 1.5 millionths, a hundredth of a standard error.
        assert!(hidden < 4.5, "seed {seed}: {hidden}");
        assert!(gap > 20.0, "seed {seed}: {gap}");
        let (shown, gap) = damage(&unbalanced(&mut draw), 600 + 2 * seed);
        // The tilt is 15 times the noise: what half a sphere lets into K is most of that, times the root of 24.
        assert!(shown > 15.0, "seed {seed}: {shown}");
        assert!(gap > 5.0, "seed {seed}: {gap}");
    }
}

#[test]
fn poses_that_cannot_separate_tilt_from_k_keep_the_level_base() {
    // Three attitudes and each turned upside down about the base's x axis: there a tilt about x turns as gravity
    // does, and K takes it.
    let faces = [Rotation3::identity(), about(Vector3::x(), 0.25), about(Vector3::y(), 0.25)];
    let over = about(Vector3::x(), 0.5);
    let at: Vec<Vector3<f64>> =
        faces.iter().cycle().take(6).flat_map(|face| [angles(face), angles(&(over * face))]).collect();

    let mut draw = Draw::new(3);
    let exact = poses(&draw.triad(DOWN, 0.5), ZYX, &at, 0.0, &mut draw);
    let held = fitted("I14", &exact).fit.held;
    assert_eq!(held.iter().map(|(entry, _)| *entry).collect::<Vec<_>>(), [12], "{held:?}");
    // Noise tips the last digits, so that nothing follows from the others to the last: but with an error of degrees.
    let noisy = fitted("I14", &poses(&draw.triad(DOWN, 0.5), ZYX, &at, SIGMA, &mut draw)).fit;
    assert!(noisy.held.iter().any(|(entry, _)| *entry == 12) || noisy.std(12).is_some_and(|std| std > 0.03));

    let calibration = calibrate(&simulated::on_rig(&at), &Options::default(), &|_| {});
    let acc = calibration.sensor(SensorKind::Acc).expect("recorded");
    assert_eq!(acc.model, "T12");
    assert!(acc.accepted().is_some_and(|fit| fit.rig.as_ref().is_some_and(|rig| rig.tilt.is_none())));
    let said = calibration.warnings.iter().any(|warning| warning.contains("tilt") && warning.contains("T12"));
    assert!(said, "{:?}", calibration.warnings);
}

#[test]
fn the_same_poses_with_one_in_general_position_tell_the_tilt() {
    let mut draw = Draw::new(4);
    let at: Vec<_> = cube().iter().take(16).map(angles).chain([angles(&draw.attitude())]).collect();
    let calibration = calibrate(&simulated::on_rig(&at), &Options::default(), &|_| {});
    assert_eq!(calibration.sensor(SensorKind::Acc).expect("recorded").model, "I14");
}

fn about(axis: Vector3<f64>, turns: f64) -> Rotation3<f64> {
    Rotation3::new(axis * turns * std::f64::consts::TAU)
}
