//! The core's fits against independent solutions by SciPy on real recordings (`tests/oracle`, `tests/golden`).

use imucal_core::{
    model::{
        Model, Parameterisation, RowSink,
        norm::{NormModel, curvature_excess},
        parameterisation::{DIAGONAL, FULL_GAIN, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::{Moments, ShellPoint},
    scalar::Scalar,
    solver::LevenbergMarquardt,
    triad::Triad,
    watch::run_length::Thresholds,
};
use imucal_host::{
    ellipsoid::{adjusted, sphere},
    observe::{
        cloud::cloud,
        turn::{BiasPath, TurnData, compress},
    },
    recording::{Nominal, Recording, Series},
};
use imucal_tests::{
    data,
    golden::{assert_close, assert_each_close, golden, intervals, matrix, number, numbers, vector, vectors},
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde_json::Value;

const INERTIAL: [&str; 3] = ["xsens-mti", "mpu9150-0", "mpu9150-1"];

/// Both solvers stop where the residual is orthogonal to the Jacobian to 1e-8; what that leaves is far below this.
const SAME: f64 = 1e-6;

fn fit<T: Scalar, const P: usize>(
    model: &impl Model<T, P>,
    start: SVector<T, P>,
) -> LevenbergMarquardt<T, P> {
    let mut solver = LevenbergMarquardt::new(start, Default::default());
    let report = solver.run(model);
    assert!(report.termination.was_successful(), "{report:?}");
    solver
}

fn standard_errors<const P: usize>(solver: &LevenbergMarquardt<f64, P>) -> SVector<f64, P> {
    solver.covariance().expect("regular").diagonal().map(f64::sqrt)
}

/// Means of the accelerometer over the oracle's rests, read by ourselves; nothing where the data are missing.
fn rest_means(name: &str, golden: &Value) -> Option<(Vec<ShellPoint<f64>>, Nominal)> {
    let recording = Recording::read(&data::real(&format!("{name}.csv.gz"))?).expect("a good recording");
    let acc = recording.acc.expect("an accelerometer");
    let means = intervals(&golden["intervals"]).into_iter().map(|(first, end)| {
        let mut moments = Moments::default();
        acc.values[first..end].iter().for_each(|f| moments.push(f));
        ShellPoint::new(moments.mean())
    });
    Some((means.collect(), acc.nominal))
}

#[test]
fn means_over_the_same_rests_are_those_of_numpy() {
    for name in INERTIAL {
        let golden = golden(&format!("acc_t9_{name}"));
        let Some((points, _)) = rest_means(name, &golden) else { return };
        let expected = vectors(&golden["observations"]);
        assert_eq!(points.len(), expected.len());
        for (point, expected) in points.iter().zip(&expected) {
            // Some thousand additions of numbers near ten round to about 1e-12.
            assert!((point.value - expected).norm() < 1e-11, "{name}: {} for {expected}", point.value);
        }
    }
}

#[test]
fn the_accelerometer_s_nine_parameters_are_scipy_s() {
    for name in INERTIAL {
        let golden = golden(&format!("acc_t9_{name}"));
        let Some((points, nominal)) = rest_means(name, &golden) else { return };
        let norm = number(&golden["gravity"]);
        let model = NormModel { points: &points, norm, form: UPPER_TRIANGULAR };
        let solver = fit(&model, UPPER_TRIANGULAR.theta(&Triad::identity()));
        let raw = UPPER_TRIANGULAR.triad(solver.theta()).in_unit(nominal.offset, nominal.per_unit);
        let (gain, one_g) = (matrix(&golden["gain"]), norm * nominal.per_unit);
        assert!((raw.gain - gain).norm() < SAME * gain.norm(), "{name}: {} for {gain}", raw.gain);
        assert_close(name, raw.bias.as_slice(), &numbers(&golden["bias"]), SAME * one_g);
        let cost = number(&golden["cost"]);
        assert!((solver.report().cost / cost - 1.0).abs() < SAME, "{name}: {}", solver.report().cost);
        let expected = numbers(&golden["standard_errors"]);
        let within: Vec<f64> = expected.iter().map(|std| SAME * std).collect();
        assert_each_close(name, standard_errors(&solver).as_slice(), &expected, &within);
        let condition = number(&golden["condition"]);
        assert!((solver.report().condition / condition - 1.0).abs() < SAME, "{name}: condition");
    }
}

#[test]
fn in_f32_the_accelerometer_ends_within_a_hundredth_of_its_errors() {
    for name in INERTIAL {
        let golden = golden(&format!("acc_t9_{name}"));
        let Some((points, _)) = rest_means(name, &golden) else { return };
        let points: Vec<ShellPoint<f32>> =
            points.iter().map(|p| ShellPoint::new(p.value.cast::<f32>())).collect();
        let model =
            NormModel { points: &points, norm: number(&golden["gravity"]) as f32, form: UPPER_TRIANGULAR };
        let solver = fit(&model, UPPER_TRIANGULAR.theta(&Triad::identity()));
        let found = solver.theta().cast::<f64>();
        let expected: Vec<f64> = theta(&golden, &UPPER_TRIANGULAR).iter().copied().collect();
        // f32 holds a rest's mean to 5e-7 m/s², a thousandth of what its noise leaves; measured: below 0.002.
        let std = numbers(&golden["standard_errors"]);
        let within: Vec<f64> = std.iter().map(|std| 0.01 * std).collect();
        assert_each_close(name, found.as_slice(), &expected, &within);
        let of_f32: Vec<f64> = solver
            .covariance()
            .expect("regular")
            .diagonal()
            .iter()
            .map(|variance| f64::from(variance.sqrt()))
            .collect();
        // The residuals, 1e-3 of 10, keep three digits less than f32 has.
        let near: Vec<f64> = std.iter().map(|std| 1e-3 * std).collect();
        assert_each_close(name, &of_f32, &std, &near);
    }
}

/// The oracle's A and b as parameters.
fn theta<const P: usize>(golden: &Value, form: &Parameterisation<P>) -> SVector<f64, P> {
    form.theta(&Triad { gain: matrix(&golden["A"]), bias: vector(&golden["b"]) })
}

#[test]
fn standard_errors_of_rests_agree_with_a_residual_bootstrap() {
    for name in INERTIAL {
        let golden = golden(&format!("acc_t9_{name}"));
        let Some((points, _)) = rest_means(name, &golden) else { return };
        let model = NormModel { points: &points, norm: number(&golden["gravity"]), form: UPPER_TRIANGULAR };
        let std = standard_errors(&fit(&model, UPPER_TRIANGULAR.theta(&Triad::identity())));
        // A factor of 1.5: what a thousand resamples of two dozen residuals settle, and no more.
        for half_width in ["std", "half_width_68"] {
            for (std, boot) in std.iter().zip(numbers(&golden["bootstrap_residual"][half_width])) {
                assert!((1.0 / 1.5..1.5).contains(&(boot / std)), "{name}: {std} for {boot}");
            }
        }
    }
}

#[test]
fn six_faces_give_scipy_s_six_parameters() {
    let golden = golden("acc_t6_imucal-ferraris");
    let Some(path) = data::real("imucal-ferraris.csv.gz") else { return };
    let acc = Recording::read(&path).expect("a good recording").acc.expect("an accelerometer");
    let regions = golden["regions_first_last"].as_object().expect("an object");
    let points: Vec<_> = ["x_p", "x_a", "y_p", "y_a", "z_p", "z_a"]
        .iter()
        .flat_map(|face| intervals(&Value::Array(vec![regions[*face].clone()])))
        .map(|(first, last)| {
            let mut moments = Moments::default();
            acc.values[first..=last].iter().for_each(|f| moments.push(f));
            ShellPoint::new(moments.mean())
        })
        .collect();
    let model = NormModel { points: &points, norm: number(&golden["gravity"]), form: DIAGONAL };
    let solver = fit(&model, DIAGONAL.theta(&Triad::identity()));
    // Six equations for six unknowns: the solution is exact, so that only rounding is left.
    assert_close("T6", solver.theta().as_slice(), &numbers(&golden["theta"]), 1e-9);
    assert!(solver.report().cost < 1e-20, "{}", solver.report().cost);
    assert_eq!(solver.variance(), None, "six residuals leave nothing to estimate a variance from");
    let condition = number(&golden["condition"]);
    assert!((solver.report().condition - condition).abs() < SAME);
}

/// A cloud in the oracle's unit (that of the file); nothing where the data are missing.
fn magnetometer(file: &str, distinct: bool) -> Option<Vec<ShellPoint<f64>>> {
    let mag = Recording::read(&data::real(file)?).expect("a good recording").mag.expect("a magnetometer");
    let usable = vec![true; mag.values.len()];
    let values: Vec<Vector3<f64>> = if distinct {
        cloud(&mag.values, &usable).points.iter().map(|p| p.value).collect()
    } else {
        mag.values.iter().filter(|v| v.iter().all(|x| x.is_finite())).copied().collect()
    };
    Some(values.iter().map(|v| ShellPoint::new(v.map(|x| mag.nominal.to_raw(x)))).collect())
}

/// Fits a cloud with its curvature taken into account: three rounds, the expected excess held within each.
fn corrected(points: &[ShellPoint<f64>], norm: f64) -> LevenbergMarquardt<f64, 9> {
    let mut points = points.to_vec();
    let mut solver = plain(&points, norm);
    for _ in 0..3 {
        let triad = UPPER_TRIANGULAR.triad(solver.theta());
        let variance = solver.variance().expect("redundant");
        points.iter_mut().for_each(|p| p.excess = curvature_excess(&triad, norm, &p.value, variance));
        solver = fit(&NormModel { points: &points, norm, form: UPPER_TRIANGULAR }, *solver.theta());
    }
    solver
}

fn plain(points: &[ShellPoint<f64>], norm: f64) -> LevenbergMarquardt<f64, 9> {
    let start = adjusted::start(points, norm).or_else(|| sphere::start(points, norm)).expect("no plane");
    fit(&NormModel { points, norm, form: UPPER_TRIANGULAR }, UPPER_TRIANGULAR.theta(&start))
}

fn assert_variant(what: &str, solver: &LevenbergMarquardt<f64, 9>, golden: &Value) {
    assert_close(what, solver.theta().as_slice(), &numbers(&golden["theta"]), SAME);
    let cost = number(&golden["cost"]);
    assert!((solver.report().cost / cost - 1.0).abs() < SAME, "{what}: cost {}", solver.report().cost);
    let expected = numbers(&golden["standard_errors_theta"]);
    let within: Vec<f64> = expected.iter().map(|std| 10.0 * SAME * std).collect();
    assert_each_close(what, standard_errors(solver).as_slice(), &expected, &within);
    let condition = number(&golden["condition"]);
    // Of a condition of 188 one more digit is lost.
    assert!((solver.report().condition / condition - 1.0).abs() < 1e2 * SAME, "{what}: condition");
}

#[test]
fn ellipsoids_of_real_clouds_are_scipy_s() {
    for (name, file, distinct) in [
        ("px4-mag", "px4-mag.csv", false),
        ("hamagure-mag-2", "hamagure-mag-2.csv.gz", false),
        ("broad-01-undisturbed", "broad-01-undisturbed.csv.gz", true),
    ] {
        let golden = golden(&format!("mag_ellipsoid_{name}"));
        let Some(points) = magnetometer(file, distinct) else { return };
        assert_eq!(points.len() as f64, number(&golden["rows_used"]), "{name}");
        let (norm, variants) = (number(&golden["F"]), &golden["variants"]);
        let solver = plain(&points, norm);
        assert_variant(&format!("{name}, plain"), &solver, &variants["plain"]);
        assert_variant(
            &format!("{name}, corrected"),
            &corrected(&points, norm),
            &variants["curvature_corrected"],
        );
        // The first-order distance differs from the exact one in second order of the noise: a fiftieth of a
        // standard error even at 3 % noise.
        let within: Vec<f64> =
            numbers(&variants["orthogonal"]["standard_errors_theta"]).iter().map(|s| 0.02 * s).collect();
        let exact = numbers(&variants["orthogonal"]["theta"]);
        assert_each_close(&format!("{name}, orthogonal"), solver.theta().as_slice(), &exact, &within);
    }
}

#[test]
fn ellipsoids_of_stored_clouds_are_scipy_s_down_to_a_tenth_of_the_sphere() {
    let golden = golden("ellipsoid_clouds");
    let norm = number(&golden["F"]);
    let stored: Vec<&Value> =
        golden["clouds"].as_array().expect("a list").iter().filter(|c| !c["points"].is_null()).collect();
    assert_eq!(stored.len(), 8);
    for cloud in stored {
        let points: Vec<_> = vectors(&cloud["points"]).into_iter().map(ShellPoint::new).collect();
        for (variant, solver) in
            [("plain", plain(&points, norm)), ("curvature_corrected", corrected(&points, norm))]
        {
            let expected = &cloud[variant];
            let what = format!("seed {}, {variant}", cloud["seed"]);
            let reference = theta(expected, &UPPER_TRIANGULAR);
            // What a cosine of 1.5e-8 leaves along the weakest direction, in standard errors, is that cosine times
            // √n times the condition: 4e-4 of them for the worst of these clouds, whose condition is 2000.
            let left = 1.5e-8 * (points.len() as f64).sqrt() * number(&expected["condition"]);
            let within: Vec<f64> =
                numbers(&expected["standard_errors"]).iter().map(|std| SAME.max(left * std)).collect();
            assert_each_close(&what, solver.theta().as_slice(), reference.as_slice(), &within);
            let cost = number(&expected["cost"]);
            assert!((solver.report().cost / cost - 1.0).abs() < SAME, "{what}: cost");
            let condition = number(&expected["condition"]);
            assert!((solver.report().condition / condition - 1.0).abs() < 1e-4, "{what}: condition");
        }
    }
}

/// Residuals of a model, in its order.
struct Residuals(Vec<f64>);

impl RowSink<f64, 9> for Residuals {
    const JACOBIAN: bool = false;

    fn row(&mut self, residual: f64, _: &SVector<f64, 9>) {
        self.0.push(residual);
    }
}

/// The oracle's turns through our own compression; `exact` takes the very rows that the oracle integrated.
fn turns(recording: &Recording, golden: &Value, exact: bool) -> Vec<TurnData> {
    let gyr = recording.gyr.as_ref().expect("a gyroscope");
    let usable = vec![true; recording.rows()];
    let interval = recording.median_interval().expect("rows");
    let rates = Series { time: &recording.time, values: &gyr.values, usable: &usable, interval };
    let rests = intervals(&golden["intervals"]);
    let (means, times) = (vectors(&golden["rest_mean_rate"]), numbers(&golden["rest_mid_time"]));
    intervals(&golden["turns_first_last_row"])
        .into_iter()
        .enumerate()
        .map(|(k, (first, last))| {
            let path = BiasPath { before: (times[k], means[k]), after: (times[k + 1], means[k + 1]) };
            // A rest of a single row has no room for a margin, so that the turn begins and ends with it.
            let (before, after) = if exact {
                (first..first + 1, last..last + 1)
            } else {
                (rests[k].0..rests[k].1, rests[k + 1].0..rests[k + 1].1)
            };
            let data = compress(rates, (k, &before, k + 1, &after), &path).expect("no gaps");
            // Half-open against closed rows, and a margin counted from the last row against one from the end.
            let slack = if exact { 0 } else { 2 };
            assert!(data.rows.start.abs_diff(first) <= slack && data.rows.end.abs_diff(last + 1) <= slack);
            data
        })
        .collect()
}

/// Largest departure from the oracle's gain in its standard errors, and the solver.
fn gyroscope(name: &str, golden: &Value, exact: bool) -> Option<(f64, LevenbergMarquardt<f64, 9>, f64)> {
    let recording = Recording::read(&data::real(&format!("{name}.csv.gz"))?).expect("a good recording");
    let data = turns(&recording, golden, exact);
    let directions = vectors(&golden["directions"]);
    let known: Vec<_> = data
        .iter()
        .map(|turn| turn.between(directions[turn.rest_before], directions[turn.rest_after]))
        .collect();
    let model = TurnModel { turns: &known, form: FULL_GAIN };
    let solver = fit(&model, FULL_GAIN.theta(&Triad::identity()));
    let gain = FULL_GAIN.triad(solver.theta()).gain;
    let (expected, std): (Matrix3<f64>, Matrix3<f64>) =
        (matrix(&golden["A"]), matrix(&golden["standard_errors"]));
    let worst = (gain - expected).component_div(&std).abs().max();
    let mut sink = Residuals(Vec::new());
    model.rows(solver.theta(), &mut sink);
    let rms = (sink.0.iter().map(|r| r * r).sum::<f64>() / known.len() as f64).sqrt();
    Some((worst, solver, rms))
}

#[test]
fn a_gyroscope_from_blocks_of_five_is_scipy_s_from_samples() {
    for name in INERTIAL {
        let golden = golden(&format!("gyr_turns_{name}"));
        let Some((worst, solver, rms)) = gyroscope(name, &golden, true) else { return };
        // Blocks of five depart from the product over samples by 1e-5° to 1e-3° a turn, with the square of the
        // hand's rate; residuals are 0.1° to 0.5°. Measured: 0.009 standard errors at the most.
        assert!(worst < 0.02, "{name}: gain off by {worst} standard errors");
        let expected = number(&golden["rms_angle_rad"]);
        assert!((rms / expected - 1.0).abs() < 1e-3, "{name}: rms {rms} for {expected}");
        let std: SMatrix<f64, 9, 1> = standard_errors(&solver);
        let found = FULL_GAIN.triad(&std).gain;
        let apart = found.component_div(&matrix(&golden["standard_errors"])).map(|r| (r - 1.0).abs()).max();
        assert!(apart < 1e-3, "{name}: standard errors apart by {apart}");
    }
}

#[test]
fn own_ends_of_turns_move_the_gyroscope_by_little_of_its_error() {
    for name in INERTIAL {
        let golden = golden(&format!("gyr_turns_{name}"));
        let Some((worst, ..)) = gyroscope(name, &golden, false) else { return };
        // A row of noise more at either end: 0.3 °/s · 0.01 s against residuals of 0.1° and more.
        assert!(worst < 0.05, "{name}: gain off by {worst} standard errors");
    }
}

#[test]
fn thresholds_of_the_drift_watch_are_those_of_the_chain_of_run_lengths() {
    let golden = golden("watch_run_length");
    // As `watch::run_length` shares the rate out: twelve sums, seconds of a day or so many poses.
    for (chart, terms, share) in [("step", 86_400.0, 0.8), ("record", 8640.0, 0.2)] {
        let (decades, thresholds) =
            (numbers(&golden[chart]["decades"]), numbers(&golden[chart]["thresholds"]));
        assert_eq!((decades.len(), thresholds.len()), (9, 9));
        for (decade, expected) in decades.into_iter().zip(thresholds) {
            let rate = 12.0 * terms / (share * 10f64.powf(decade));
            let of = Thresholds::of(rate as f32);
            let found = f64::from(if chart == "step" { of.step } else { of.record });
            assert!((found - expected).abs() < 2e-3, "{chart}, 10^{decade}: {found} for {expected}");
        }
    }
}
