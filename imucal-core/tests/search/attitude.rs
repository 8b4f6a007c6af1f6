//! The attitude model: its derivatives, its compression, Earth rate and g-sensitivity.

use imucal_core::{
    model::{
        Cost, Model, Parameterisation, SquaredSum,
        attitude::AttitudeModel,
        parameterisation::{FULL, FULL_GAIN, FULL_WITH_SENSITIVITY},
    },
    observation::{Compared, Motion},
    rotation::{exp, log, matrix, quaternion},
    solver::{LevenbergMarquardt, jacobian_check::largest_jacobian_error},
    triad::Triad,
};
use nalgebra::{Matrix3, SVector, Vector3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::rig::{DT, Recording, SAMPLES, Sensor, within};

/// The same motion in front of a model of every form.
fn model<'a, const P: usize>(
    motions: &'a [Motion<'a, f64>],
    form: Parameterisation<P>,
) -> AttitudeModel<'a, f64, P> {
    AttitudeModel { motions, form }
}

/// A sensor some way from nominal, with a g-sensitivity of a few °/h per m/s², enlarged so that it matters.
fn sensor(seed: u64) -> Sensor {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sensitivity = Matrix3::from_fn(|_, _| within(&mut rng, 1e-3));
    Sensor { sensitivity, ..Sensor::drawn(&mut rng, 0.05, 0.05) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_analytic_jacobian_is_the_numerical_one(noise in prop::array::uniform(-0.02f64..0.02), fast in 0.2f64..2.0) {
        // Earth rate a thousand times too fast, so that its own derivative counts.
        let mut recording = Recording::of(120, |t| {
            exp(&Vector3::new(fast * (3.0 * t).sin(), 1.5 * (2.0 * t).sin(), -fast * (2.5 * t).sin()))
        });
        recording.earth.iter_mut().for_each(|e| *e *= 1e3);
        let raw = recording.measured(&sensor(5), 0.0, &mut ChaCha8Rng::seed_from_u64(0));
        let held = recording.compress::<f64>(&raw, 10, 4);
        let stops = [1, 5, 5, 12];
        let second = Motion { compared: Compared::After(&stops), ..held.motion() };
        let motions = [held.motion(), second];
        let theta: SVector<f64, 21> = FULL_WITH_SENSITIVITY.theta(&Triad::identity()) + SVector::from(noise);
        let twelve = FULL.theta(&FULL_WITH_SENSITIVITY.triad(&theta));
        prop_assert_eq!(Model::independent_rows(&model(&motions, FULL)), 3 * (3 + 3));
        prop_assert!(largest_jacobian_error(&model(&motions, FULL_WITH_SENSITIVITY), &theta) < 1e-8);
        prop_assert!(largest_jacobian_error(&model(&motions, FULL), &twelve) < 1e-8);
        let nine = FULL_GAIN.theta(&FULL.triad(&twelve));
        prop_assert!(largest_jacobian_error(&model(&motions, FULL_GAIN), &nine) < 1e-8);
    }
}

#[test]
fn the_swarm_s_cost_is_the_mean_square_of_the_rows_however_it_is_sliced() {
    let recording = Recording::slews(1);
    let raw = recording.measured(&sensor(2), 0.005, &mut ChaCha8Rng::seed_from_u64(3));
    let held = recording.compress::<f64>(&raw[..2005], 10, 7);
    // References beyond the blocks, and blocks beyond the last reference, are left out.
    let stops = [30, 30, 77, 500];
    let motions = [held.motion(), Motion { compared: Compared::After(&stops), ..held.motion() }];
    let model = model(&motions, FULL_WITH_SENSITIVITY);
    let mut theta = FULL_WITH_SENSITIVITY.theta(&Triad::identity());
    theta[15] = 1e-3;
    let mut sum = SquaredSum(0.0);
    model.rows(&theta, &mut sum);
    let terms = model.independent_rows() as f64 / 3.0;
    assert_eq!(terms, f64::from(200 / 7 + 3));
    let whole = model.cost(&theta);
    assert!((whole / (sum.0 / terms) - 1.0).abs() < 1e-12);
    for slice in [1, 2, 3, 50, 203] {
        let mut state = model.begin(&theta);
        let value = loop {
            let mut budget = slice;
            if let Some(value) = model.advance(&theta, &mut state, &mut budget) {
                break value;
            }
            assert_eq!(budget, 0);
        };
        assert_eq!(value.to_bits(), whole.to_bits(), "slices of {slice}");
    }
}

#[test]
fn without_a_reference_there_is_no_cost() {
    let held = Recording::slews(1).compress::<f64>(&[], 10, 1);
    assert!(Cost::cost(&model(&[held.motion()], FULL), &FULL.theta(&Triad::identity())).is_nan());
    assert!(Cost::cost(&model(&[], FULL), &FULL.theta(&Triad::identity())).is_nan());
}

/// Largest distance, °, of the compressed attitude from the product over samples, at any block's end in 100 s.
fn compression_error(size: usize) -> f64 {
    let recording = Recording::slews(4);
    let truth = Sensor::drawn(&mut ChaCha8Rng::seed_from_u64(6), 0.05, 0.05);
    let raw = recording.measured(&truth, 0.0, &mut ChaCha8Rng::seed_from_u64(0));
    let held = recording.compress::<f64>(&raw, size, 1);
    let exact: Vec<_> = recording.exact(&raw, &truth.triad).iter().map(quaternion).collect();
    let exact: Vec<_> = exact.iter().skip(size - 1).step_by(size).copied().collect();
    let motions = [Motion { references: &exact, ..held.motion() }];
    let mut rows = Largest(Vec::new());
    model(&motions, FULL).rows(&FULL.theta(&truth.triad), &mut rows);
    rows.0.chunks_exact(3).map(|r| Vector3::from_column_slice(r).norm().to_degrees()).fold(0.0, f64::max)
}

/// Gathers residuals.
struct Largest(Vec<f64>);

impl<const P: usize> imucal_core::model::RowSink<f64, P> for Largest {
    const JACOBIAN: bool = false;
    fn row(&mut self, residual: f64, _: &SVector<f64, P>) {
        self.0.push(residual);
    }
}

#[test]
fn blocks_of_ten_agree_with_the_product_over_samples() {
    let errors = [5, 10, 20, 50].map(compression_error);
    println!("blocks of 5, 10, 20, 50: {errors:?} degrees");
    assert!(errors[0] < 1e-4 && errors[1] < 1e-3 && errors[2] < 1e-2 && errors[3] < 0.3, "{errors:?}");
}

#[test]
fn a_sensor_at_rest_drifts_by_earth_rate_unless_that_is_taken_out() {
    let recording = Recording::of(SAMPLES, |_| exp(&Vector3::new(0.3, -0.2, 1.0)));
    let raw = recording.measured(&Sensor::ideal(), 0.0, &mut ChaCha8Rng::seed_from_u64(0));
    let held = recording.compress::<f64>(&raw, 10, 1000);
    let drift = |motion| model(&[motion], FULL).cost(&FULL.theta(&Triad::identity())).sqrt().to_degrees();
    assert!(drift(held.motion()) < 1e-9, "{}", drift(held.motion()));
    let with = drift(Motion { earth: &[], ..held.motion() });
    assert!((with - 0.418).abs() < 1e-3, "{with}");
}

#[test]
fn earth_rate_out_of_blocks_is_earth_rate_out_of_samples() {
    let recording = Recording::slews(4);
    let truth = Sensor::drawn(&mut ChaCha8Rng::seed_from_u64(6), 0.1, 0.1);
    let raw = recording.measured(&truth, 0.0, &mut ChaCha8Rng::seed_from_u64(0));
    // The encoders and the product over samples agree, so that the next comparison is with the truth.
    let exact = recording.exact(&raw, &truth.triad);
    assert!(log(&exact[SAMPLES - 1].tr_mul(&recording.attitudes[SAMPLES])).norm() < 1e-9);
    let held = recording.compress::<f64>(&raw, 10, 1);
    let theta = FULL.theta(&truth.triad);
    let error = |motion| model(&[motion], FULL).cost(&theta).sqrt().to_degrees();
    assert!(error(held.motion()) < 1e-3);
    assert!(error(Motion { earth: &[], ..held.motion() }) > 0.1);
}

#[test]
fn a_g_sensitivity_is_found_with_gain_and_bias() {
    let truth = sensor(8);
    let recording = Recording::slews(9);
    let raw = recording.measured(&truth, 1e-3, &mut ChaCha8Rng::seed_from_u64(1));
    let held = recording.compress::<f64>(&raw, 10, 10);
    let motions = [held.motion()];
    let start = FULL_WITH_SENSITIVITY.theta(&Triad { gain: Matrix3::identity(), ..truth.triad });
    let mut fit = LevenbergMarquardt::new(start, Default::default());
    let report = fit.run(&model(&motions, FULL_WITH_SENSITIVITY));
    assert!(report.termination.was_successful());
    let found = FULL_WITH_SENSITIVITY.sensitivity(fit.theta());
    assert!((found - truth.sensitivity).amax() < 1e-4, "{found} {}", truth.sensitivity);
    // Blind to it, the fit is off by more than a degree.
    let mut blind = LevenbergMarquardt::new(FULL.theta(&truth.triad), Default::default());
    blind.run(&model(&motions, FULL));
    let (with, without) =
        (model(&motions, FULL_WITH_SENSITIVITY).cost(fit.theta()), model(&motions, FULL).cost(blind.theta()));
    assert!(without > 30.0 * with, "{with} {without}");
}

#[test]
fn single_precision_tells_attitudes_apart_by_thousandths_of_a_degree() {
    let recording = Recording::slews(4);
    let truth = Sensor::drawn(&mut ChaCha8Rng::seed_from_u64(6), 0.05, 0.05);
    let raw = recording.measured(&truth, 0.0, &mut ChaCha8Rng::seed_from_u64(0));
    let held = recording.compress::<f32>(&raw, 10, 10);
    let triad = Triad { gain: truth.triad.gain.cast(), bias: truth.triad.bias.cast() };
    let motions = [held.motion()];
    let cost = AttitudeModel { motions: &motions, form: FULL }.cost(&FULL.theta::<f32>(&triad));
    let error = cost.sqrt().to_degrees();
    assert!(error < 5e-3, "{error} degrees after {} s", SAMPLES as f64 * DT);
    assert!(size_of_val(&held.blocks[0]) == 36 && size_of_val(&held.references[0]) == 16);
    assert!((matrix(&held.start) - Matrix3::identity()).amax() < 1e-6);
}
