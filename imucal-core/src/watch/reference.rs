//! What the record lets expect of a healthy unit at rest.
//!
//! Errors of gain and bias, of which the record has the standard errors alone, reach the component of a calibrated value along a
//! vector a as
//!
//! ```text
//! Var(a · v) = Σ_i a_i² Σ_j σ_G,ij² d_j² + Σ_j (aᵀG)_j² σ_b,j²,     d = G⁻¹ v
//! ```
//!
//! with a = û for the length, and the part of the other direction across, over the length, for the angle between two. Not modelled:
//! correlations between the entries, which the record does not have; they may make the sum too large or too small.

use nalgebra::{Matrix3, Vector3};

use super::{Look, Mean, Statistic, WatchSettings, against_record::Allowance};
use crate::{
    record::{CalibrationRecord, RawUnit, TriadRecord},
    triad::Triad,
};

/// Variance of one component of a vector of length one and any direction.
const ANY_DIRECTION: f32 = 1.0 / 3.0;

/// No sensor reads as much, in any unit of calibrated values.
const LARGEST: f32 = 1e6;

/// A statistic of one look, less what is expected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) value: f32,
    /// Variance by what the samples say.
    pub(super) white: f32,
}

impl Reading {
    /// A figure that a sensor can have, in whatever unit: its squares are finite too.
    #[inline]
    pub(super) fn is_usable(&self) -> bool {
        self.value.is_finite() && self.value.abs() < LARGEST && self.white >= 0.0 && self.white < LARGEST
    }
}

/// Standard errors of one triad, ready to be propagated.
#[derive(Clone, Copy, Debug)]
struct Errors {
    /// Variance of the gain's entries.
    gain: Matrix3<f32>,
    /// Inverse of the gain.
    sensitivity: Matrix3<f32>,
    /// Gain times the standard errors of the bias: its columns.
    bias: Matrix3<f32>,
    /// Mean square residual of the fit, unit of calibrated values.
    residual: f32,
}

impl Errors {
    #[inline]
    fn of<O>(record: &TriadRecord<O>) -> Option<Self> {
        let Triad { gain, .. } = record.triad::<f32>();
        let quality = &record.quality;
        let [[a, b, c], [d, e, f], [g, h, i]] = quality.gain_std;
        let std = Matrix3::new(a, b, c, d, e, f, g, h, i);
        Some(Self {
            gain: std.component_mul(&std),
            sensitivity: gain.try_inverse()?,
            bias: gain * Matrix3::from_diagonal(&Vector3::from(quality.bias_std)),
            residual: quality.rms * quality.rms,
        })
    }

    /// Variance of the component of `value` along `a`.
    #[inline]
    fn along(&self, a: &Vector3<f32>, value: &Vector3<f32>) -> f32 {
        let raw = self.sensitivity * value;
        let of_gain = a.component_mul(a).dot(&(self.gain * raw.component_mul(&raw)));
        let of_bias = self.bias.tr_mul(a);
        of_gain + of_bias.dot(&of_bias)
    }
}

/// Of the triads that a record has.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    acc: Option<Errors>,
    /// Variance of the rate's bias, calibrated axes.
    gyr: Option<Vector3<f32>>,
    mag: Option<Errors>,
    gravity: f32,
    field: Option<f32>,
    /// Cosine of the angle between specific force and field that is expected.
    cosine: Option<f32>,
    /// The magnetometer has the accelerometer's axes.
    has_dip: bool,
}

impl Reference {
    #[inline]
    pub(super) fn of<O>(record: &CalibrationRecord<O>, settings: &WatchSettings) -> Self {
        let acc = record.acc.as_ref().and_then(Errors::of);
        let gyr = record.gyr.as_ref().and_then(Errors::of);
        let mag = record.mag.as_ref().and_then(Errors::of);
        let own = record.mag.as_ref().and_then(own_field);
        // Alone, a magnetometer's gain has no rotation to the accelerometer.
        let is_rotated = |triad: &TriadRecord<O>| {
            let [_, [yx, _, _], [zx, zy, _]] = triad.gain;
            [yx, zx, zy].iter().any(|entry| *entry != 0.0)
        };
        Self {
            has_dip: acc.is_some() && record.mag.as_ref().is_some_and(is_rotated),
            acc,
            gyr: gyr.map(|errors| rows_squared(&errors.bias)),
            mag,
            gravity: settings.gravity,
            field: settings.field.or(own),
            cosine: settings.dip.map(|dip| -libm::sinf(dip)),
        }
    }

    /// The statistics of a look, in the order of [`Statistic::ALL`]; of triads that are not watched or not usable, `None`.
    #[inline]
    pub(super) fn readings(&self, look: &Look, usable: [bool; 3]) -> [Option<Reading>; 6] {
        let [acc, gyr, mag] = usable;
        let force = self.acc.filter(|_| acc).and(length(&look.acc));
        let rate = look.gyr.filter(|_| gyr && self.gyr.is_some());
        let field = look.mag.filter(|_| mag && self.mag.is_some());
        let [x, y, z] = rate.map_or([None; 3], |rate| {
            let reading = |value, white| Some(Reading { value, white });
            [
                reading(rate.value.x, rate.variance.x),
                reading(rate.value.y, rate.variance.y),
                reading(rate.value.z, rate.variance.z),
            ]
        });
        let less = |reading: Reading, expected: f32| Reading { value: reading.value - expected, ..reading };
        [
            force.map(|reading| less(reading, self.gravity)),
            x,
            y,
            z,
            field.and_then(|field| length(&field)).map(|reading| less(reading, self.field.unwrap_or(0.0))),
            field
                .filter(|_| self.has_dip && acc)
                .and_then(|field| cosine(&look.acc, &field))
                .map(|reading| less(reading, self.cosine.unwrap_or(0.0))),
        ]
    }

    /// What a healthy unit may be off by at this look.
    #[inline]
    pub(super) fn allowance(&self, settings: &WatchSettings, statistic: Statistic, look: &Look) -> Allowance {
        let square = |value: f32| value * value;
        let [of_acc, of_gyr, of_mag] = settings.instability.map(square);
        let rate = |variance: Option<f32>| Allowance {
            common: variance.unwrap_or(0.0),
            pose: square(settings.earth_rate) * ANY_DIRECTION,
            slow: of_gyr,
            is_known: true,
        };
        let place = square(settings.place);
        match statistic {
            Statistic::Force => {
                let common = self.acc.map_or(0.0, |acc| acc.along(&unit(&look.acc.value), &look.acc.value));
                let pose = self.acc.map_or(0.0, |acc| acc.residual);
                let common = common + square(settings.gravity_error);
                Allowance { common, pose, slow: of_acc, is_known: true }
            }
            Statistic::RateX => rate(self.gyr.map(|variance| variance.x)),
            Statistic::RateY => rate(self.gyr.map(|variance| variance.y)),
            Statistic::RateZ => rate(self.gyr.map(|variance| variance.z)),
            Statistic::Field => {
                let value = look.mag.map_or_else(Vector3::zeros, |mag| mag.value);
                let common = self.mag.map_or(0.0, |mag| mag.along(&unit(&value), &value));
                let pose = self.mag.map_or(0.0, |mag| mag.residual) + place * value.dot(&value);
                Allowance { common, pose, slow: of_mag, is_known: self.field.is_some() }
            }
            Statistic::Dip => {
                let (Some(acc), Some(mag), Some(field)) = (self.acc, self.mag, look.mag) else {
                    return Allowance::default();
                };
                let (of_f, of_b) = across(&look.acc.value, &field.value);
                let (f2, b2) = (of_f.dot(&of_f), of_b.dot(&of_b));
                Allowance {
                    common: acc.along(&of_f, &look.acc.value) + mag.along(&of_b, &field.value),
                    pose: acc.residual * f2 + mag.residual * b2 + place * b2 * field.value.dot(&field.value),
                    slow: of_acc * f2 + of_mag * b2,
                    is_known: self.cosine.is_some(),
                }
            }
        }
    }
}

/// The field's length, where the fit found it and calibrated values have its unit.
#[inline]
fn own_field<O>(mag: &TriadRecord<O>) -> Option<f32> {
    let alike = mag.unit_out == mag.unit_in || mag.unit_out == RawUnit::Arbitrary;
    mag.quality.field_norm.filter(|_| alike)
}

#[inline]
fn rows_squared(matrix: &Matrix3<f32>) -> Vector3<f32> {
    let square = matrix.component_mul(matrix);
    square.column(0) + square.column(1) + square.column(2)
}

#[inline]
fn unit(vector: &Vector3<f32>) -> Vector3<f32> {
    vector / libm::sqrtf(vector.dot(vector))
}

/// Length of a mean.
#[inline]
fn length(mean: &Mean) -> Option<Reading> {
    let value = libm::sqrtf(mean.value.dot(&mean.value));
    let up = mean.value / value;
    (value > 0.0).then(|| Reading { value, white: up.component_mul(&up).dot(&mean.variance) })
}

/// How the cosine of the angle between two vectors changes with each.
#[inline]
fn across(f: &Vector3<f32>, b: &Vector3<f32>) -> (Vector3<f32>, Vector3<f32>) {
    let (u, v) = (unit(f), unit(b));
    let cosine = u.dot(&v);
    ((v - u * cosine) / libm::sqrtf(f.dot(f)), (u - v * cosine) / libm::sqrtf(b.dot(b)))
}

/// Cosine of the angle between two means.
#[inline]
fn cosine(f: &Mean, b: &Mean) -> Option<Reading> {
    let value = unit(&f.value).dot(&unit(&b.value));
    let (of_f, of_b) = across(&f.value, &b.value);
    let white = of_f.component_mul(&of_f).dot(&f.variance) + of_b.component_mul(&of_b).dot(&b.variance);
    (value.is_finite() && white.is_finite()).then_some(Reading { value, white })
}
