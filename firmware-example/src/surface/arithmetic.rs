//! Numbers, rotations, triads, temperature and the corrector.

use imucal_core::{
    corrector,
    nonlinearity::{self, NonlinearTerms, Nonlinearity},
    record::{self, Sensor},
    rotation,
    scalar::Scalar,
    temperature::{self, TemperatureCurvature, TemperatureTerms},
    triad::{self, Triad},
};
use nalgebra::{Matrix3, Quaternion, Vector3};

use crate::{RECORD, scene};

#[inline(never)]
pub(super) fn reach_all() {
    numbers();
    rotations();
    triads();
    warmth();
    bends();
    corrections();
}

#[inline(never)]
fn numbers() {
    reach!(f32::of(0.1));
    reach!(f32::whole(3));
    reach!(f32::wide(0.1));
    reach!(f32::root(2.0));
    reach!(f32::finite(2.0));
    reach!(f32::same(2.0, 3.0));
    reach!(f64::of(0.1));
    reach!(f64::whole(3));
    reach!(f64::wide(0.1));
    reach!(f64::root(2.0));
    reach!(f64::finite(2.0));
    reach!(f64::same(2.0, 3.0));
}

#[inline(never)]
fn rotations() {
    let phi = Vector3::new(0.1f32, -0.2, 1.3);
    let mut c: Matrix3<f32> = reach!(rotation::exp(&phi));
    reach!(rotation::exp_with_jacobian(&phi));
    reach!(rotation::cross_matrix(&phi));
    reach!(rotation::image(&c, &phi));
    reach!(rotation::product(&c, &c));
    reach!(rotation::sin_cos(0.3f32));
    reach!(rotation::turn(&mut c, &phi));
    let q: Quaternion<f32> = reach!(rotation::quaternion(&c));
    reach!(rotation::quaternion_log(&q));
    reach!(rotation::matrix(&q));
    reach!(rotation::log(&c));
    reach!(rotation::inverse_left_jacobian(&phi));
    reach!(rotation::axis_order::nearest(&c));
    let _swap: Option<Matrix3<f32>> = reach!(rotation::axis_order::signed_permutation(17));
}

#[inline(never)]
fn triads() {
    let (truth, raw) = (scene::gyroscope().truth, Vector3::new(1.0f32, 2.0, 3.0));
    let none: Triad<f32> = reach!(triad::Triad::identity());
    reach!(triad::Triad::correct(&none, &raw));
    reach!(triad::Triad::predict(&truth, &raw));
    reach!(triad::Triad::sensitivity(&truth));
    reach!(triad::Triad::in_unit(&truth, 32_768.0, 415.0));
    reach!(triad::Triad::is_singular(&truth));
    reach!(triad::Triad::is_finite(&truth));
}

pub(super) fn terms() -> TemperatureTerms<f32> {
    TemperatureTerms { reference: 25.0, bias_slope: [1e-3, -2e-3, 5e-4], scale_slope: [1e-5, 2e-5, -1e-5] }
}

#[inline(never)]
fn warmth() {
    let (terms, truth, raw) = (terms(), scene::gyroscope().truth, Vector3::new(1.0f32, 2.0, 3.0));
    reach!(temperature::TemperatureTerms::correct(&terms, &truth, &raw, 31.0));
    let warm = reach!(temperature::TemperatureTerms::at(&terms, &truth, 31.0));
    reach!(temperature::TemperatureTerms::predict(&terms, &truth, &raw, 31.0));
    reach!(temperature::TemperatureTerms::is_finite(&terms));
    let _wide: TemperatureTerms<f64> = reach!(temperature::TemperatureTerms::cast(&terms));
    reach!(temperature::TemperatureTerms::from_reference(&terms, 31.0));
    reach!(temperature::Warmth::none(&truth));
    reach!(temperature::Warmth::correct(&warm, &truth, &raw));
    reach!(temperature::Warmth::sensed(&warm, &truth, &raw));
    let curvature = curvature();
    let drift = reach!(temperature::TemperatureCurvature::drift(&curvature, 6.0));
    reach!(temperature::TemperatureCurvature::growth(&curvature, drift.x));
    let _wide: TemperatureCurvature<f64> = reach!(temperature::TemperatureCurvature::cast(&curvature));
    reach!(temperature::TemperatureTerms::at_curved(&terms, &curvature, &truth, 31.0));
}

fn curvature() -> TemperatureCurvature<f32> {
    TemperatureCurvature { bias: [1e-5, -2e-5, 3e-5], scale: [1e-7, -1e-7, 2e-7] }
}

#[inline(never)]
fn bends() {
    let x = Vector3::new(1.0f32, 2.0, 3.0);
    let mut terms: NonlinearTerms<f32> = reach!(nonlinearity::NonlinearTerms::none());
    terms.quadratic = [1e-3, -1e-3, 2e-3];
    terms.cubic = [1e-5, 2e-5, -1e-5];
    terms.cross = [[1e-4; 3]; 3];
    reach!(nonlinearity::quadratic(&terms.quadratic, &x));
    reach!(nonlinearity::cubic(&terms.cubic, &x));
    reach!(nonlinearity::cross(&terms.cross, &x));
    reach!(nonlinearity::NonlinearTerms::slope(&terms, 10.0));
    let _wide: NonlinearTerms<f64> = reach!(nonlinearity::NonlinearTerms::cast(&terms));
    let bent = Nonlinearity { terms, range: 10.0 };
    let _wide: Nonlinearity<f64> = reach!(nonlinearity::Nonlinearity::cast(&bent));
    reach!(nonlinearity::Nonlinearity::excess(&bent, &x));
    reach!(nonlinearity::Nonlinearity::respond(&bent, &x));
    if let Ok(linearizer) = reach!(nonlinearity::Linearizer::new(bent)) {
        reach!(nonlinearity::Linearizer::rounds(&linearizer));
        let own = *reach!(nonlinearity::Linearizer::nonlinearity(&linearizer));
        let sensed = reach!(nonlinearity::Linearizer::sense(&linearizer, &x));
        full(&sensed, own);
    }
}

#[inline(never)]
fn full(raw: &Vector3<f32>, bent: Nonlinearity<f32>) {
    let first = corrector::Corrector::new(scene::gyroscope().truth, Some(terms()));
    if let Ok(full) = reach!(corrector::FullCorrector::new(first, Some(curvature()), Some(bent))) {
        reach!(corrector::FullCorrector::apply(&full, raw));
        reach!(corrector::FullCorrector::apply_at(&full, raw, 31.0));
        reach!(corrector::FullCorrector::predict_at(&full, raw, 31.0));
        let mut following = reach!(corrector::Compensator::new(full));
        reach!(corrector::Compensator::apply_at(&mut following, raw, 31.0));
    }
}

#[inline(never)]
fn corrections() {
    let raw = Vector3::new(1.0f32, 2.0, 3.0);
    let fixed = reach!(corrector::Corrector::new(scene::gyroscope().truth, Some(terms())));
    reach!(corrector::Corrector::apply(&fixed, &raw));
    reach!(corrector::Corrector::apply_at(&fixed, &raw, 31.0));
    let mut following = reach!(corrector::Compensator::new(fixed));
    reach!(corrector::Compensator::apply_at(&mut following, &raw, 31.0));
    if let Ok(record) = record::decode(RECORD)
        && let Some(triad) = record.triad(Sensor::Accelerometer)
    {
        let _fixed: corrector::Corrector<f32> = reach!(corrector::Corrector::from(triad));
    }
}
