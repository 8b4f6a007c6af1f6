//! Clouds over parts of a sphere: an accurate answer or a refusal, and never a runaway.

use imucal_host::{
    calibrate::{
        FitSummary, SensorOutcome,
        mag::samples::{self, MagInput},
    },
    recording::Triple,
};
use imucal_tests::clouds::CapCloud;
use nalgebra::{DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rayon::prelude::*;

/// Clouds tried.
const CLOUDS: u64 = 200;
/// χ² of nine parameters that one in ten thousand exceeds: of 200 clouds that many none should.
const NINE: f64 = 33.7;
/// The same of three.
const THREE: f64 = 21.1;

fn calibrated(cloud: &CapCloud, field: Option<f64>) -> SensorOutcome {
    samples::calibrate(&MagInput::of_cloud(&cloud.sensor, &vec![true; cloud.sensor.values.len()], field))
}

/// Estimated entries of found less true, file's unit.
fn error(cloud: &CapCloud, fit: &FitSummary) -> DVector<f64> {
    let (found, truth) = (fit.raw_triad(), cloud.truth);
    let all: Vec<f64> = (found.gain - truth.gain)
        .transpose()
        .iter()
        .chain((found.bias - truth.bias).iter())
        .copied()
        .collect();
    DVector::from_iterator(
        fit.covariance_of.len(),
        fit.covariance_of.iter().map(|entry| all[usize::from(*entry)]),
    )
}

/// Squared distance of the truth under the reported covariance.
fn mahalanobis2(cloud: &CapCloud, fit: &FitSummary) -> f64 {
    let e = error(cloud, fit);
    let scaled = fit.raw_covariance();
    // To unit standard errors first: gain and bias differ by any unit.
    let std = scaled.diagonal().map(f64::sqrt);
    let correlation = nalgebra::DMatrix::from_fn(e.len(), e.len(), |i, j| scaled[(i, j)] / (std[i] * std[j]));
    let z = e.component_div(&std);
    z.dot(&correlation.cholesky().expect("positive").solve(&z))
}

/// Errors of gain and bias relative to the gain's size and the radius.
fn relative_error(cloud: &CapCloud, fit: &FitSummary) -> f64 {
    let (found, truth) = (fit.raw_triad(), cloud.truth);
    let radius = cloud.field / truth.gain.norm();
    ((found.gain - truth.gain).norm() / truth.gain.norm()).max((found.bias - truth.bias).norm() / radius)
}

#[test]
fn accepted_clouds_are_as_accurate_as_they_say() {
    let results: Vec<(CapCloud, SensorOutcome)> = (0..CLOUDS)
        .into_par_iter()
        .map(|seed| {
            let cloud = CapCloud::draw(seed);
            let outcome = calibrated(&cloud, Some(cloud.field));
            (cloud, outcome)
        })
        .collect();
    for (seed, (cloud, outcome)) in results.iter().enumerate() {
        let Some(fit) = outcome.accepted() else { continue };
        let what = format!("seed {seed}: {:.0} % of the sphere", 100.0 * cloud.coverage);
        if cloud.noise > 0.0 {
            let distance = mahalanobis2(cloud, fit);
            assert!(distance < NINE, "{what}: squared distance {distance}");
        } else {
            // Rounding of the samples, 1e-16 of the offset, times the condition, 60 at the most.
            assert!(relative_error(cloud, fit) < 1e-9, "{what}: {}", relative_error(cloud, fit));
        }
    }
    assert_most_accepted(&results);
}

fn assert_most_accepted(results: &[(CapCloud, SensorOutcome)]) {
    let wide: Vec<_> = results.iter().filter(|(cloud, _)| cloud.coverage >= 0.6).collect();
    let refused: Vec<_> = wide.iter().filter_map(|(_, outcome)| outcome.verdict.as_ref().err()).collect();
    assert!(
        wide.len() > 50 && refused.len() * 10 <= wide.len(),
        "{} of {}: {refused:?}",
        refused.len(),
        wide.len()
    );
}

#[test]
fn without_a_known_field_centre_and_verdict_are_the_same() {
    let results: Vec<(CapCloud, SensorOutcome)> = (0..CLOUDS)
        .into_par_iter()
        .map(|seed| {
            let cloud = CapCloud::draw(seed);
            let outcome = calibrated(&cloud, None);
            let known = calibrated(&cloud, Some(cloud.field));
            assert_eq!(
                outcome.verdict.is_ok(),
                known.verdict.is_ok(),
                "seed {seed}: the field is only a gauge"
            );
            (cloud, outcome)
        })
        .collect();
    for (seed, (cloud, outcome)) in results.iter().enumerate() {
        let Some(fit) = outcome.accepted() else { continue };
        let triad = fit.raw_triad();
        assert!((triad.gain.determinant() - 1.0).abs() < 1e-12, "seed {seed}: {}", triad.gain);
        let off = triad.bias - cloud.truth.bias;
        let covariance: Matrix3<f64> = fit.raw_covariance().fixed_view::<3, 3>(6, 6).into_owned();
        // The field's length in the file's unit goes with the gain of determinant 1.
        let expected = cloud.field / cloud.truth.gain.determinant().cbrt();
        let field = fit.field_norm.expect("unknown beforehand");
        if cloud.noise > 0.0 {
            let distance = off.dot(&covariance.cholesky().expect("positive").solve(&off));
            assert!(distance < THREE, "seed {seed}: squared distance of the centre {distance}");
            // One part in five: an accepted cap cannot be further off, but a runaway would be.
            assert!((field / expected - 1.0).abs() < 0.2, "seed {seed}: field {field} for {expected}");
        } else {
            assert!(off.norm() < 1e-9 * expected, "seed {seed}: {off}");
            assert!((field / expected - 1.0).abs() < 1e-9, "seed {seed}: field {field} for {expected}");
        }
    }
    assert_most_accepted(&results);
}

/// A cloud over the whole sphere, radius about 50, slightly noisy.
fn whole(seed: u64) -> Triple {
    let mut rng = <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(seed);
    let k = Matrix3::new(48.0, 1.0, -2.0, 0.5, 53.0, 0.7, -0.3, 1.5, 50.0);
    let values = (0..300)
        .map(|_| {
            let u: [f64; 3] = rand_distr::Distribution::sample(&rand_distr::UnitSphere, &mut rng);
            let n: [f64; 3] = rand_distr::Distribution::sample(&rand_distr::UnitSphere, &mut rng);
            k * Vector3::from(u) + Vector3::new(20.0, -30.0, 10.0) + Vector3::from(n) * 0.2
        })
        .collect();
    Triple {
        values,
        unit: imucal_host::recording::Unit::MicroTesla,
        nominal: imucal_host::recording::Nominal::IDENTITY,
        full_scale: None,
        single: false,
    }
}

/// Centre and AᵀA of a cloud's shell of radius `field`.
fn shell(values: Vec<Vector3<f64>>, field: f64) -> (Vector3<f64>, Matrix3<f64>) {
    let usable = vec![true; values.len()];
    let outcome =
        samples::calibrate(&MagInput::of_cloud(&Triple { values, ..whole(0) }, &usable, Some(field)));
    let triad = outcome.accepted().expect("the whole sphere is accepted").triad;
    (triad.bias, triad.gain.tr_mul(&triad.gain))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_transformed_cloud_has_its_answer_transformed(
        seed in 0u64..1000,
        turn in prop::array::uniform3(-3.0f64..3.0),
        scale in 1e-3f64..1e3,
        shift in prop::array::uniform3(-100.0f64..100.0),
    ) {
        let (cloud, field) = (whole(seed).values, 50.0);
        let (centre, metric) = shell(cloud.clone(), field);
        let r: Rotation3<f64> = UnitQuaternion::from_scaled_axis(Vector3::from(turn)).to_rotation_matrix();
        let shift = Vector3::from(shift);
        let moved = cloud.iter().map(|p| (r * p + shift) * scale).collect();
        let (moved_centre, moved_metric) = shell(moved, field * scale);
        // Either fit ends within 1e-6 standard errors of its minimum, which are 0.03 and 5e-4.
        let expected = (r * centre + shift) * scale;
        prop_assert!((moved_centre - expected).norm() < 1e-6 * 50.0 * scale, "{moved_centre} for {expected}");
        let turned = r.matrix() * metric * r.matrix().transpose();
        prop_assert!((moved_metric - turned).norm() < 1e-6, "{moved_metric} for {turned}");
    }
}
