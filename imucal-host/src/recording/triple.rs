//! Samples of one triad and their relation to what the file holds.

use std::ops::Range;

use nalgebra::Vector3;

use super::{order_statistics::median, unit::Unit};

/// Nominal, affine conversion of one sensor: file value = offset + per_unit · SI value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal {
    /// What the file holds at zero, in the file's unit; finite.
    pub offset: f64,
    /// File units per m/s², rad/s or µT; finite, not zero.
    pub per_unit: f64,
}

impl Nominal {
    /// The conversion of a file that is in SI units already.
    pub const IDENTITY: Self = Self { offset: 0.0, per_unit: 1.0 };

    /// From the file's unit to m/s², rad/s or µT. NaN stays NaN.
    #[must_use]
    pub fn to_si(self, raw: f64) -> f64 {
        (raw - self.offset) / self.per_unit
    }

    /// From m/s², rad/s or µT to the file's unit. NaN stays NaN.
    #[must_use]
    pub fn to_raw(self, si: f64) -> f64 {
        self.offset + self.per_unit * si
    }
}

/// The samples of an accelerometer, gyroscope or magnetometer.
#[derive(Clone, Debug, PartialEq)]
pub struct Triple {
    /// One vector a row, in the sensor's own axes: specific force in m/s², rate in rad/s or field in µT
    /// (for the unit `a.u.` as the file has it). A NaN component was not measured; none is infinite.
    pub values: Vec<Vector3<f64>>,
    /// Unit of the file.
    pub unit: Unit,
    /// Conversion between the file and `values`.
    pub nominal: Nominal,
    /// Full scale of `[ranges]`, in the file's unit (for counts: from the nominal offset); positive.
    pub full_scale: Option<f64>,
    /// In the file's unit the values are those of an `f32`, as a device puts them out; a text file has the shortest digits
    /// that are this `f32`.
    pub single: bool,
}

impl Triple {
    /// Those of consecutive rows.
    pub(super) fn part(&self, rows: &Range<usize>) -> Self {
        let Self { unit, nominal, full_scale, single, .. } = *self;
        Self { values: self.values[rows.clone()].to_vec(), unit, nominal, full_scale, single }
    }

    /// The samples in the file's unit and the device's precision: what the sensor put out.
    pub fn raw_samples(&self) -> impl Iterator<Item = Vector3<f32>> {
        self.values.iter().map(|value| value.map(|x| self.nominal.to_raw(x) as f32))
    }

    /// Full scale on the SI side (m/s², rad/s, µT), positive.
    #[must_use]
    pub fn full_scale_si(&self) -> Option<f64> {
        self.full_scale.map(|scale| scale / self.nominal.per_unit.abs())
    }

    /// Median length of the vectors in SI units, over the rows measured on all three axes; `None`
    /// without such a row.
    #[must_use]
    pub fn median_norm(&self) -> Option<f64> {
        let norms = self.values.iter().map(nalgebra::Matrix::norm).filter(|norm| norm.is_finite());
        median(norms.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_conversion_goes_both_ways() {
        let nominal = Nominal { offset: 32768.0, per_unit: 415.0 };
        assert_eq!(nominal.to_si(32768.0 + 415.0), 1.0);
        assert_eq!(nominal.to_raw(1.0), 33183.0);
        assert!(nominal.to_si(f64::NAN).is_nan());
    }

    #[test]
    fn the_median_norm_leaves_missing_rows_out() {
        let values =
            vec![Vector3::new(3.0, 4.0, 0.0), Vector3::new(f64::NAN, 0.0, 0.0), Vector3::new(5.0, 0.0, 0.0)];
        let triple = Triple {
            values,
            unit: Unit::MicroTesla,
            nominal: Nominal::IDENTITY,
            full_scale: Some(2.0),
            single: false,
        };
        assert_eq!(triple.median_norm(), Some(5.0));
        assert_eq!(triple.full_scale_si(), Some(2.0));
    }
}
