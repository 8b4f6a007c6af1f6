//! The whole way from a recording of a real sensor to its calibration, against what others found and published.

use imucal_core::{
    accept::Refusal,
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    solver::LevenbergMarquardt,
    triad::Triad,
};
use imucal_host::{
    calibrate::{
        AccModel, Calibration, FitSummary, Options, calibrate,
        mag::samples::{self, MagInput},
        outcome::Evidence,
    },
    observe::cloud::cloud,
    recording::{Recording, SensorKind, Triple},
};
use imucal_tests::{
    data,
    golden::{assert_close, assert_each_close},
};
use nalgebra::{SVector, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

fn read(file: &str) -> Option<Recording> {
    Some(Recording::read(&data::real(file)?).expect("a good recording"))
}

fn calibrated(file: &str, options: &Options) -> Option<Calibration> {
    Some(calibrate(&read(file)?, options, &|_| {}))
}

fn accepted(calibration: &Calibration, kind: SensorKind) -> &FitSummary {
    let outcome = calibration.sensor(kind).expect("recorded");
    assert!(outcome.verdict.is_ok(), "{kind}: {:?}", outcome.verdict);
    outcome.accepted().expect("accepted")
}

fn refusal(calibration: &Calibration, kind: SensorKind) -> Refusal {
    calibration.sensor(kind).expect("recorded").verdict.as_ref().expect_err("refused").refusal
}

/// 1 / diag(gain): what T K with a unit diagonal of T gives.
fn per_unit(fit: &FitSummary) -> Vector3<f64> {
    fit.raw_triad().gain.diagonal().map(f64::recip)
}

#[test]
fn an_xsens_accelerometer_is_the_peers_and_says_how_sure_it_is() {
    let Some(calibration) = calibrated("xsens-mti.csv.gz", &Options::default()) else { return };
    let fit = accepted(&calibration, SensorKind::Acc);
    // Peers cut the recording by another detector: their rests move the answer by a few standard errors, which
    // are 0.03 LSB/(m/s²) and 0.24 LSB.
    assert_close("scale", per_unit(fit).as_slice(), &[414.418739, 412.031935, 414.620687], 0.1);
    let bias = fit.raw_triad().bias;
    assert_close("bias", bias.as_slice(), &[33123.838314, 33275.162981, 32364.494575], 0.6);
    let (gain_std, bias_std) = fit.raw_std();
    let ppm = gain_std.diagonal().component_div(&fit.raw_triad().gain.diagonal()) * 1e6;
    let (scale, offset) = ([64.0, 34.0, 38.0], [0.24, 0.14, 0.15]);
    // Two rests more or less, and another threshold, change the residual's variance by less than a quarter. The peers'
    // residuals are independent: that they are alike from rest to rest widens a gain by half, and biases, which the two
    // halves of the recording have 0.6 LSB apart, severalfold.
    for axis in 0..3 {
        assert!((0.75..1.6).contains(&(ppm[axis] / scale[axis])), "scale std: {ppm}");
        assert!((0.75..8.0).contains(&(bias_std[axis] / offset[axis])), "bias std: {bias_std}");
    }
}

#[test]
fn an_xsens_gyroscope_is_the_peers() {
    let Some(calibration) = calibrated("xsens-mti.csv.gz", &Options::default()) else { return };
    let fit = accepted(&calibration, SensorKind::Gyr);
    // A standard error is 3 LSB/(rad/s); peers take one bias for all turns, which moves the scale by twice that.
    assert_close("scale", per_unit(fit).as_slice(), &[4777.99, 4764.37, 4773.13], 10.0);
    // The peers' 0.514° a turn.
    assert!(fit.rms.to_degrees() <= 0.52, "{}° a turn", fit.rms.to_degrees());
    assert!(fit.bias_wander.expect("known").interpolated, "this bias wanders by 0.07 °/s");
}

#[test]
fn rest_thresholds_move_a_gyroscope_s_gain_by_less_than_0_3_percent() {
    for file in ["mpu9150-0.csv.gz", "mpu9150-1.csv.gz"] {
        let Some(calibration) = calibrated(file, &Options::default()) else { return };
        let fit = accepted(&calibration, SensorKind::Gyr);
        // Published for this pair of units: 0.07 to 0.22°.
        assert!(fit.rms.to_degrees() <= 0.22, "{file}: {}° a turn", fit.rms.to_degrees());
        let trials = &calibration.segmentation.as_ref().expect("rests").trials;
        let gains: Vec<Vector3<f64>> =
            trials.iter().filter(|trial| trial.rests >= 20).filter_map(|trial| trial.gyr_gain).collect();
        assert!(gains.len() >= 5, "{file}: only {} thresholds left 20 rests", gains.len());
        for axis in 0..3 {
            let (low, high) = gains
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(low, high), g| (low.min(g[axis]), high.max(g[axis])));
            assert!(high / low - 1.0 < 0.003, "{file}, axis {axis}: {gains:?}");
        }
    }
}

#[test]
fn an_mpu9150_is_as_published() {
    let Some(calibration) = calibrated("mpu9150-0.csv.gz", &Options::default()) else { return };
    // Published: S = 1/diag(gain) − 1 and B of the same recording under another detector; each answer has about
    // the standard error that we report, and three of their difference are allowed.
    let three = |std: Vector3<f64>| (std * (3.0 * std::f64::consts::SQRT_2)).as_slice().to_vec();
    for (kind, scale, bias) in [
        (SensorKind::Acc, [0.003595, 0.003108, 0.006580], [0.102892, 0.097010, 0.344629]),
        (SensorKind::Gyr, [0.000291, 0.004503, 0.008185], [0.019561, -0.006725, 0.021670]),
    ] {
        let fit = accepted(&calibration, kind);
        let (gain_std, bias_std) = fit.raw_std();
        let found = per_unit(fit) - Vector3::repeat(1.0);
        assert_each_close(kind.prefix(), found.as_slice(), &scale, &three(gain_std.diagonal()));
        assert_each_close(kind.prefix(), fit.raw_triad().bias.as_slice(), &bias, &three(bias_std));
    }
}

#[test]
fn a_px4_magnetometer_is_the_peer_s_within_the_peer_s_tolerance() {
    let Some(calibration) = calibrated("px4-mag.csv", &Options::default()) else { return };
    let fit = accepted(&calibration, SensorKind::Mag);
    let triad = fit.raw_triad();
    // Offset and scale ± .01 G and ± .01: the tolerance of the peer's own test.
    assert_close("offset", triad.bias.as_slice(), &[-0.18, 0.05, -0.58], 0.01);
    let scale = triad.gain.diagonal() / triad.gain[(0, 0)];
    assert_close("scale", scale.as_slice(), &[1.0, 1.06, 0.94], 0.01);
    assert_eq!(fit.left_out, Vec::<String>::new());
}

#[test]
fn a_cloud_that_is_weak_in_z_is_refused_and_its_figures_say_so() {
    let Some(calibration) = calibrated("hamagure-mag-2.csv.gz", &Options::default()) else { return };
    // Refused: three published solvers put the offset in z anywhere from −.05 to +.04. Condition 188, limit 60.
    assert_eq!(refusal(&calibration, SensorKind::Mag).reason(), "ill-conditioned");
    let fit = calibration.sensor(SensorKind::Mag).and_then(|s| s.fit.as_ref()).expect("for information");
    let (_, std) = fit.raw_std();
    assert!(std.z > 2.0 * std.x && std.z > 2.0 * std.y, "{std}");
    // Residuals have an autocorrelation of 0.98 from sample to sample, 0.7 twenty samples on.
    assert!(fit.inflation > 3.0, "{}", fit.inflation);
    // The offsets published lie within six of its standard errors, which is why it is refused: along a direction this
    // weak they are too small themselves (a bootstrap's are half as large again, and not normal).
    let z = fit.raw_triad().bias.z;
    assert!([-0.05, 0.04].iter().all(|published| (published - z).abs() < 6.0 * std.z), "{z} ± {}", std.z);
}

#[test]
fn six_faces_are_refused_nine_parameters_and_granted_six() {
    let Some(nine) = calibrated("imucal-ferraris.csv.gz", &Options::default()) else { return };
    let refused = refusal(&nine, SensorKind::Acc);
    assert_eq!(refused.reason(), "not-redundant");
    assert!(matches!(refused, Refusal::NotRedundant { directions: 6, parameters: 9, .. }), "{refused}");
    assert_eq!(nine.segmentation.as_ref().expect("rests").rests.len(), 13);
    let options = Options { acc: AccModel::T6, ..Options::default() };
    let Some(six) = calibrated("imucal-ferraris.csv.gz", &options) else { return };
    let fit = accepted(&six, SensorKind::Acc);
    // The peer's gain from the labelled faces; ours are found, and there are more of them: half a percent.
    let expected = [0.996746, 1.002438, 1.023395];
    assert_each_close("T6", per_unit(fit).as_slice(), &expected, &expected.map(|e| 0.005 * e));
}

#[test]
fn a_recording_without_enough_rests_still_gives_its_magnetometer() {
    // Gyroscope and magnetometer by their field forms; against the recording's reference attitude both are accepted.
    let field = Options { rig_gyr: None, rig_mag: None, ..Options::default() };
    let Some(calibration) = calibrated("broad-01-undisturbed.csv.gz", &field) else { return };
    assert_eq!(refusal(&calibration, SensorKind::Acc).reason(), "too-few-observations");
    assert_eq!(refusal(&calibration, SensorKind::Gyr).reason(), "too-few-observations");
    // A norm alone: that the field differs from place to place in the room leaves a residual that follows direction.
    let mag = calibration.sensor(SensorKind::Mag).expect("a magnetometer");
    let triad = mag.passed().expect("accepted or suspect").raw_triad();
    // Calibrated at the factory: offsets below 1 µT of 50, axes within 3 %.
    assert!(
        triad.bias.norm() < 1.0 && (triad.gain.diagonal() - Vector3::repeat(1.0)).amax() < 0.03,
        "{triad:?}"
    );
}

#[test]
fn ten_rests_that_hardly_determine_nine_parameters_are_refused() {
    let Some(calibration) = calibrated("mpu6050-unobservable.csv.gz", &Options::default()) else { return };
    // Ten residuals, nine parameters, and 22 counts of uncertainty in a bias: one standard error along the weakest
    // direction leaves the parabola. Not too few, and not redundant by count: the geometry is what is wrong.
    assert_eq!(refusal(&calibration, SensorKind::Acc).reason(), "ill-conditioned");
    assert_eq!(refusal(&calibration, SensorKind::Gyr).reason(), "ill-conditioned");
}

#[test]
fn no_magnetometer_of_a_real_recording_runs_away() {
    for file in [
        "px4-mag.csv",
        "hamagure-mag-2.csv.gz",
        "broad-01-undisturbed.csv.gz",
        "broad-32-magnet-1cm.csv.gz",
        "disto-SAP6_BB.csv",
        "disto-SAP6_HC.csv",
    ] {
        let Some(recording) = read(file) else { return };
        let mag = recording.mag.expect("a magnetometer");
        // Every tenth row of the long ones: a cloud of thousands has the shape of one of ten thousands.
        let step = if mag.values.len() > 10_000 { 10 } else { 1 };
        let values: Vec<_> = mag.values.iter().step_by(step).copied().collect();
        let extent =
            values.iter().filter(|v| v.iter().all(|x| x.is_finite())).map(|v| v.norm()).fold(0.0, f64::max);
        let usable = vec![true; values.len()];
        let outcome = samples::calibrate(&MagInput::of_cloud(&Triple { values, ..mag }, &usable, None));
        let fit = outcome.fit.expect("enough points");
        let smallest = fit.triad.gain.diagonal().amin();
        // A runaway has its centre far outside of the cloud and its gain at nothing.
        assert!(fit.triad.bias.norm() < extent && smallest > 0.2, "{file}: {:?}", fit.triad);
    }
}

#[test]
fn a_magnet_for_a_part_of_the_time_is_refused_and_little_of_it_left_out() {
    let Some(recording) = read("broad-32-magnet-1cm.csv.gz") else { return };
    let mag = recording.mag.expect("a magnetometer");
    let usable = vec![true; mag.values.len()];
    let points = cloud(&mag.values, &usable).points.len();
    let outcome = samples::calibrate(&MagInput::of_cloud(&mag, &usable, None));
    assert!(outcome.verdict.is_err(), "{outcome:?}");
    // Residuals of a tenth of the field: the model is wrong, not the data, of which a tenth at the most may go.
    let fit = outcome.fit.expect("for information");
    assert!(fit.observations as f64 >= 0.9 * points as f64, "{} of {points}", fit.observations);
    let norm = fit.field_norm.expect("a gauge");
    assert!(fit.rms > 0.05 * norm, "{} of {norm}", fit.rms);
}

/// Entries of a raw triad that are estimated, and their standard errors.
fn entries(fit: &FitSummary) -> (SVector<f64, 9>, SVector<f64, 9>) {
    let (gain, bias) = fit.raw_std();
    (UPPER_TRIANGULAR.theta(&fit.raw_triad()), UPPER_TRIANGULAR.theta(&Triad { gain, bias }))
}

/// Half of the width that holds the middle 68 % of each entry.
fn half_widths(samples: &[SVector<f64, 9>]) -> SVector<f64, 9> {
    SVector::from_fn(|k, _| {
        let mut values: Vec<f64> = samples.iter().map(|s| s[k]).collect();
        values.sort_by(f64::total_cmp);
        let quantile = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
        0.5 * (quantile(0.841) - quantile(0.159))
    })
}

/// First lag at which residuals no longer know of each other: autocorrelation below 0.05; a tenth at the most.
fn memory(residuals: &[f64]) -> usize {
    let product = |lag: usize| residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let longest = residuals.len() / 10;
    (1..longest).find(|lag| product(*lag) < 0.05 * product(0)).unwrap_or(longest)
}

/// Standard errors against a moving-block bootstrap of the whole fit: points drawn in blocks as long as the residuals'
/// memory, in time order. A bias' standard error contains drift that is slower than the recording, of which blocks of it
/// show nothing: it may be larger.
fn assert_bootstrap(file: &str, every: usize, resamples: u64, factor: f64) {
    let Some(recording) = read(file) else { return };
    let mag = recording.mag.expect("a magnetometer");
    let usable = vec![true; mag.values.len()];
    let points: Vec<Vector3<f64>> =
        cloud(&mag.values, &usable).points.iter().step_by(every).map(|p| p.value).collect();
    let usable = vec![true; points.len()];
    let of = |values: Vec<Vector3<f64>>| {
        samples::calibrate(&MagInput::of_cloud(&Triple { values, ..mag.clone() }, &usable, None))
    };
    let outcome = of(points.clone());
    let fit = outcome.accepted().expect("accepted");
    let norm = fit.field_norm.expect("a gauge") / fit.nominal.per_unit;
    let residuals: Vec<f64> = points.iter().map(|p| fit.triad.correct(p).norm() - norm).collect();
    let block = memory(&residuals);
    // Refused ones as well: the most precise alone would be too close to each other.
    let drawn: Vec<SVector<f64, 9>> = (0..resamples)
        .into_par_iter()
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut values = Vec::with_capacity(points.len() + block);
            while values.len() < points.len() {
                let from = rng.next_u64() as usize % (points.len() - block + 1);
                values.extend_from_slice(&points[from..from + block]);
            }
            values.truncate(points.len());
            entries(of(values).fit.as_ref().expect("fitted")).0
        })
        .collect();
    let ratio = half_widths(&drawn).component_div(&entries(fit).1);
    println!("{file}: {} points, blocks of {block}, bootstrap/std {ratio}", points.len());
    assert!(
        ratio.iter().enumerate().all(|(k, r)| *r < factor && (k > 5 || *r > 1.0 / factor)),
        "{file}: bootstrap over reported {ratio}"
    );
}

#[test]
fn standard_errors_of_a_cloud_agree_with_a_moving_block_bootstrap() {
    // Both sides are estimated from the fifteen blocks that know nothing of each other: each to 18 %.
    assert_bootstrap("px4-mag.csv", 1, 200, 1.5);
}

#[test]
fn standard_errors_of_a_long_cloud_agree_with_a_moving_block_bootstrap() {
    // Its residuals never forget: their autocorrelation is 0.65 from the second lag to a tenth of the recording, where
    // blocks are cut. Ten blocks know a width to 22 %, and either side has no more: twice that on both is a factor of 2.
    assert_bootstrap("broad-01-undisturbed.csv.gz", 20, 100, 2.0);
}

#[test]
fn standard_errors_of_rests_agree_with_a_residual_bootstrap() {
    let Some(calibration) = calibrated("xsens-mti.csv.gz", &Options::default()) else { return };
    let fit = accepted(&calibration, SensorKind::Acc);
    let Some(Evidence::Shell { points, norm, triad, .. }) =
        calibration.sensor(SensorKind::Acc).and_then(|s| s.evidence.as_ref())
    else {
        panic!("an accepted accelerometer has its evidence");
    };
    // Each point's distance from the shell and its foot on it, along the normal.
    let (feet, distances): (Vec<_>, Vec<_>) = points
        .iter()
        .map(|p| {
            let y = triad.correct(&p.value);
            let normal = triad.gain.tr_mul(&y.normalize());
            let distance = (y.norm() - norm) / normal.norm();
            let normal = normal.normalize();
            ((p.value - normal * distance, normal), distance)
        })
        .unzip();
    let widen = (points.len() as f64 / (points.len() as f64 - 9.0)).sqrt();
    let drawn: Vec<SVector<f64, 9>> = (0..300)
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let moved: Vec<_> = feet
                .iter()
                .map(|(foot, normal)| {
                    let drawn = distances[rng.next_u64() as usize % distances.len()];
                    ShellPoint::new(foot + normal * (drawn * widen))
                })
                .collect();
            let model = NormModel { points: &moved, norm: *norm, form: UPPER_TRIANGULAR };
            let mut solver = LevenbergMarquardt::new(UPPER_TRIANGULAR.theta(triad), Default::default());
            assert!(solver.run(&model).termination.was_successful());
            *solver.theta()
        })
        .collect();
    let std = UPPER_TRIANGULAR.theta(&Triad { gain: fit.gain_std, bias: fit.bias_std });
    let ratio = half_widths(&drawn).component_div(&std);
    // 300 resamples know a width to 6 %; 40 residuals know their own spread to 13 %. Drawn in any order, they show nothing
    // of noise that is alike from rest to rest, of which these rests have some: gains may be half as wide again for it, and
    // a bias several times.
    assert!(ratio.iter().enumerate().all(|(k, r)| *r < 1.5 && (k > 5 || *r > 1.0 / 2.0)), "{ratio}");
}
