//! What a calibrated sensor can be, wide of every sensor that is built and of every fit that is accepted: what lies
//! outside is a mistake of units, of a writer, or of memory.
//!
//! | figure | limits |
//! | --- | --- |
//! | length of a column of the gain, both units known or alike | 1/3 to 3 times what the units say |
//! | the same, counts or no unit on one side | 1e-9 to 1e3 and 1e-9 to 1e9 |
//! | longest column against the shortest | 9 |
//! | bias, its standard error, the field's magnitude, rms residual | 100 m/s², 10 rad/s, 10 mT; 2³² counts |
//! | rms residual of a gyroscope's fit, an angle | 10 rad |
//! | bias slope, scale slope | a hundredth of the bias' limit, 0.01, per kelvin |
//! | reference temperature, temperature span | −100 to 250 °C |
//! | bias curvature, scale curvature | a hundredth of the slopes' limits, per kelvin |
//! | range of the nonlinear terms | above 0, to a hundred times the bias' limit |
//! | slope of the nonlinear terms over it | [`STEEPEST`]: so steep they can be undone |
//! | standard error of a gain's entry | the gain's longest column |
//! | standard error of a temperature term | the term's own limit |
//! | slope of the nonlinear terms' standard errors | 1 |
//! | condition, coverage | at least 1; 0 to 1 |
//!
//! A factor of 3: accepted fits lie within 2 ([`crate::accept::Limits`]), and of the units that are taken for one
//! another the nearest, g and m/s², lie 9.8 apart. The biases are some ten times the worst of data sheets (±10 % of
//! full scale of a high-g accelerometer, null of a rate table's gyroscope, a magnetometer's whole range).

use super::{
    CurvatureRecord, Defect, Figures, FitQuality, NonlinearRecord, Order, RawUnit, Sensor,
    TemperatureQuality, TriadRecord,
};
use crate::nonlinearity::{NonlinearTerms, STEEPEST};
use crate::temperature::TemperatureTerms;

/// Factor about the nominal gain.
const NOMINAL: f32 = 3.0;
/// Longest column of a gain against the shortest.
const AXIS_RATIO: f32 = NOMINAL * NOMINAL;
/// Limits of a gain from counts.
const FROM_COUNTS: (f32, f32) = (1e-9, 1e3);
/// Limits of a gain where nothing is known of the units.
const ANY: (f32, f32) = (1e-9, 1e9);
/// Most that a value without a scale can be: the range of a 32-bit converter.
const LARGEST_COUNT: f32 = 4_294_967_296.0;
/// Change of temperature that a slope must bear, K.
const WARMTH: f32 = 100.0;
/// Most that a scale grows a kelvin.
const SCALE_SLOPE: f32 = 0.01;
/// Most that a range is, of the bias' limit.
const RANGE: f32 = 100.0;
/// °C.
const REFERENCE: (f32, f32) = (-100.0, 250.0);
/// A condition of exactly one may have been rounded down.
const CONDITION: f32 = 0.999;

/// Most that a sensor's bias can be: m/s², rad/s, µT.
fn largest(sensor: Sensor) -> f32 {
    match sensor {
        Sensor::Accelerometer => 100.0,
        Sensor::Gyroscope => 10.0,
        Sensor::Magnetometer => 1e4,
    }
}

/// The sensor that a unit is of and its size, m/s², rad/s or µT; `None` for a unit without a scale.
///
/// To four digits, which is plenty to judge by: nothing is converted by it.
fn scale(unit: RawUnit) -> Option<(Sensor, f32)> {
    Some(match unit {
        RawUnit::MetrePerSecondSquared => (Sensor::Accelerometer, 1.0),
        RawUnit::StandardGravity => (Sensor::Accelerometer, 9.807),
        RawUnit::MilliGravity => (Sensor::Accelerometer, 9.807e-3),
        RawUnit::RadianPerSecond => (Sensor::Gyroscope, 1.0),
        RawUnit::DegreePerSecond => (Sensor::Gyroscope, 0.017_45),
        RawUnit::MicroTesla => (Sensor::Magnetometer, 1.0),
        RawUnit::MilliGauss => (Sensor::Magnetometer, 0.1),
        RawUnit::Gauss => (Sensor::Magnetometer, 100.0),
        RawUnit::NanoTesla => (Sensor::Magnetometer, 1e-3),
        RawUnit::Counts | RawUnit::Arbitrary => return None,
    })
}

/// Most that a value of a sensor in a unit can be.
#[inline(never)]
fn most(sensor: Sensor, unit: RawUnit) -> f32 {
    scale(unit).map_or(LARGEST_COUNT, |(_, size)| largest(sensor) / size)
}

/// Limits of a column's length.
fn gain_limits(from: RawUnit, to: RawUnit) -> (f32, f32) {
    let nominal = match (scale(from), scale(to)) {
        _ if from == to => 1.0,
        (Some((_, from)), Some((_, to))) => from / to,
        (None, Some(_)) if from == RawUnit::Counts => return FROM_COUNTS,
        _ => return ANY,
    };
    (nominal / NOMINAL, nominal * NOMINAL)
}

/// Checks the figures of one sensor, and keeps the first defect: a result of each check would double the code.
#[derive(Debug)]
pub struct Check {
    sensor: Sensor,
    found: Option<Defect>,
}

impl Check {
    /// Every value is finite and within the limits.
    #[inline(never)]
    fn within(&mut self, figures: Figures, values: &[f32], least: f32, most: f32) {
        let sensor = self.sensor;
        for value in values.iter().copied() {
            if self.found.is_some() {
                return;
            }
            if !value.is_finite() {
                self.found = Some(Defect::NotFinite { sensor, figures });
            } else if value < least || value > most {
                self.found = Some(Defect::OutOfRange { sensor, figures, value, least, most });
            }
        }
    }

    /// Keeps the defect, if it is the first.
    fn unless(&mut self, holds: bool, defect: Defect) {
        if !holds && self.found.is_none() {
            self.found = Some(defect);
        }
    }

    /// The unit is one of the sensor's.
    #[inline(never)]
    fn unit(&mut self, unit: RawUnit) {
        let own = match scale(unit) {
            Some((sensor, _)) => sensor == self.sensor,
            None => unit == RawUnit::Counts || self.sensor == Sensor::Magnetometer,
        };
        self.unless(own, Defect::ForeignUnit { sensor: self.sensor, unit });
    }

    /// Lengths of the gain's columns; gives the longest.
    fn gain<O>(&mut self, triad: &TriadRecord<O>) -> f32 {
        self.within(Figures::Gain, triad.gain.as_flattened(), f32::MIN, f32::MAX);
        let (least, most) = gain_limits(triad.unit_in, triad.unit_out);
        let (mut shortest, mut longest) = (f32::MAX, 0f32);
        let computed = triad.triad::<f32>();
        for column in computed.gain.column_iter() {
            let length = libm::sqrtf(column.norm_squared());
            self.within(Figures::Gain, &[length], least, most);
            shortest = if length < shortest { length } else { shortest };
            longest = if length > longest { length } else { longest };
        }
        self.within(Figures::AxisRatio, &[longest / shortest], CONDITION, AXIS_RATIO);
        self.unless(!computed.is_singular(), Defect::Singular { sensor: self.sensor });
        longest
    }

    fn temperature(&mut self, terms: &TemperatureTerms<f32>, bias: f32) {
        let slope = bias / WARMTH;
        self.within(Figures::Reference, &[terms.reference], REFERENCE.0, REFERENCE.1);
        self.within(Figures::BiasSlope, &terms.bias_slope, -slope, slope);
        self.within(Figures::ScaleSlope, &terms.scale_slope, -SCALE_SLOPE, SCALE_SLOPE);
    }

    /// Figures of temperature terms are there with the terms alone.
    pub(super) fn belongs(&mut self, figures: Figures, warm: bool) {
        self.unless(warm, Defect::WithoutTerms { sensor: self.sensor, figures });
    }

    pub(super) fn warmth(&mut self, warmth: &TemperatureQuality, bias: f32) {
        let [least, _] = warmth.span;
        self.within(Figures::TemperatureSpan, &warmth.span, REFERENCE.0, REFERENCE.1);
        self.within(Figures::TemperatureSpan, &warmth.span, least, REFERENCE.1);
        self.within(Figures::BiasSlopeStd, &warmth.bias_slope_std, 0.0, bias / WARMTH);
        self.within(Figures::ScaleSlopeStd, &warmth.scale_slope_std, 0.0, SCALE_SLOPE);
    }

    pub(super) fn curvature(&mut self, curvature: &CurvatureRecord, bias: f32) {
        let (bias, scale) = (bias / (WARMTH * WARMTH), SCALE_SLOPE / WARMTH);
        self.within(Figures::BiasCurvature, &curvature.terms.bias, -bias, bias);
        self.within(Figures::ScaleCurvature, &curvature.terms.scale, -scale, scale);
        self.within(Figures::BiasCurvatureStd, &curvature.std.bias, 0.0, bias);
        self.within(Figures::ScaleCurvatureStd, &curvature.std.scale, 0.0, scale);
    }

    pub(super) fn nonlinearity(&mut self, found: &NonlinearRecord, bias: f32) {
        let range = found.range;
        self.within(Figures::NonlinearRange, &[range], f32::MIN_POSITIVE, bias * RANGE);
        self.within(Figures::Nonlinearity, &[found.terms.slope(range)], 0.0, STEEPEST as f32);
        let NonlinearTerms { quadratic, cubic, cross } = &found.std;
        for errors in [quadratic, cubic].into_iter().chain(cross) {
            self.within(Figures::NonlinearityStd, errors, 0.0, f32::MAX);
        }
        self.within(Figures::NonlinearityStd, &[found.std.slope(range)], 0.0, 1.0);
    }

    fn quality(&mut self, quality: &FitQuality, gain: f32, bias: f32, rms: f32) {
        self.within(Figures::GainStd, quality.gain_std.as_flattened(), 0.0, gain);
        self.within(Figures::BiasStd, &quality.bias_std, 0.0, bias);
        self.within(Figures::Rms, &[quality.rms], 0.0, rms);
        self.within(Figures::HeldOutRms, quality.held_out_rms.as_slice(), 0.0, rms);
        self.within(Figures::Condition, &[quality.condition], CONDITION, f32::MAX);
        self.within(Figures::Coverage, &[quality.coverage], 0.0, 1.0);
        self.within(Figures::FieldNorm, quality.field_norm.as_slice(), f32::MIN_POSITIVE, bias);
    }
}

impl<O: Order> TriadRecord<O> {
    /// Can the triad be a calibration of that sensor? The one check of records that are stored, loaded or written,
    /// and of fits that are adopted.
    ///
    /// # Errors
    ///
    /// The first [`Defect`].
    #[inline(never)]
    pub fn check(&self, sensor: Sensor) -> Result<(), Defect> {
        let mut check = Check { sensor, found: None };
        check.unit(self.unit_in);
        check.unit(self.unit_out);
        let gain = check.gain(self);
        let bias = most(sensor, self.unit_in);
        check.within(Figures::Bias, &self.bias, -bias, bias);
        if let Some(terms) = &self.temperature {
            check.temperature(terms, bias);
        }
        let rms = match sensor {
            // An angle, whatever the unit of the calibrated rate.
            Sensor::Gyroscope => largest(sensor),
            _ => most(sensor, self.unit_out),
        };
        check.quality(&self.quality, gain, bias, rms);
        self.order.check(&mut check, bias, self.temperature.is_some());
        check.found.map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests;
