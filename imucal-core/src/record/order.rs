//! What a record may hold beyond its first order: terms that change what is corrected, and what is known of them.
//!
//! | part of a triad | from version | a reader that does not know it |
//! | --- | --- | --- |
//! | [`TemperatureQuality`]: span, standard errors | 1.2 | skips it: it corrects the same |
//! | [`CurvatureRecord`]: temperature to second order | 2.0 | refuses the record |
//! | [`NonlinearRecord`]: quadratic, cubic, cross terms | 2.0 | refuses the record |
//!
//! Gain, bias and slopes are fitted together with the higher terms: without these they are not the best linear
//! calibration but a wrong one. So terms that change a value raise the major version, which every reader there has been
//! refuses.
//!
//! A device chooses by type what it reads: [`FirstOrder`], the default, costs it nothing of the rest, neither memory nor
//! code, and refuses a record of higher order as one of a newer version. [`HigherOrder`] reads every record.

use serde::{Deserialize, Serialize};

use super::{
    CalibrationRecord, DecodeError, Figures,
    codec::{Version, longest, taken},
    payload::Counting,
    plausibility::Check,
};
use crate::nonlinearity::{NonlinearTerms, Nonlinearity};
use crate::temperature::TemperatureCurvature;

/// Terms of the first order alone: gain, bias, and the slopes of temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FirstOrder;

/// All terms there are; by default none beyond the first order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HigherOrder {
    /// How well the temperature terms are known; `None` where that is not, and without such terms.
    pub warmth: Option<TemperatureQuality>,
    /// Temperature to second order, from the reference of the triad's temperature terms; `None` without those.
    pub curvature: Option<CurvatureRecord>,
    /// Quadratic, cubic and cross terms.
    pub nonlinearity: Option<NonlinearRecord>,
}

/// What the temperature terms were found from, and how well.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperatureQuality {
    /// Least and greatest temperature of the calibration, °C: beyond them the terms extrapolate.
    pub span: [f32; 2],
    /// Standard error of the bias slope, `unit_in`/K, ≥ 0; 0 for an entry held fixed.
    pub bias_slope_std: [f32; 3],
    /// Standard error of the scale slope, 1/K, ≥ 0; 0 for an entry held fixed.
    pub scale_slope_std: [f32; 3],
}

impl TemperatureQuality {
    /// The calibration has seen this temperature, °C.
    pub fn covers(&self, temperature: f32) -> bool {
        let [least, greatest] = self.span;
        least <= temperature && temperature <= greatest
    }
}

/// Temperature to second order, and how well it was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CurvatureRecord {
    /// `unit_in`/K² and 1/K².
    pub terms: TemperatureCurvature<f32>,
    /// Their standard errors, ≥ 0; 0 for an entry held fixed.
    pub std: TemperatureCurvature<f32>,
}

/// Nonlinear terms, and how well they were found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NonlinearRecord {
    /// Largest |raw − bias| of an axis that the calibration has seen, `unit_in`: beyond it the terms keep their value.
    pub range: f32,
    /// The coefficients, in `unit_in`.
    pub terms: NonlinearTerms<f32>,
    /// Their standard errors, ≥ 0; 0 for an entry held fixed.
    pub std: NonlinearTerms<f32>,
}

impl NonlinearRecord {
    /// To compute with.
    pub fn nonlinearity(&self) -> Nonlinearity<f32> {
        Nonlinearity { terms: self.terms, range: self.range }
    }
}

/// What an order has of the format. Not for others to implement.
pub trait Parts: Sized {
    /// The lowest version that holds a record, from minor 2 on; `None` where it is older.
    fn version(record: &CalibrationRecord<Self>) -> Option<Version>;
    /// Writes what that version appends.
    ///
    /// # Errors
    ///
    /// Those of postcard.
    fn write(
        record: &CalibrationRecord<Self>,
        version: Version,
        out: &mut Counting<'_>,
    ) -> postcard::Result<()>;
    /// Reads what a version appends after the provenance; gives what follows.
    ///
    /// # Errors
    ///
    /// [`DecodeError::Malformed`].
    fn read<'a>(
        record: &mut CalibrationRecord<Self>,
        version: Version,
        appended: &'a [u8],
    ) -> Result<&'a [u8], DecodeError>;
    /// A triad has no terms that change a value other than gain, bias and the slopes of temperature.
    fn is_first_order(&self) -> bool;
    /// Checks a triad's parts; `bias` is the most that its bias may be, `warm` whether it has temperature terms.
    fn check(&self, check: &mut Check, bias: f32, warm: bool);
}

/// How far the terms of a record go: [`FirstOrder`] or [`HigherOrder`], and nothing else.
///
/// ```compile_fail
/// #[derive(Clone, Debug, Default, PartialEq)]
/// struct Own;
/// impl imucal_core::record::Order for Own {} // sealed
/// ```
pub trait Order: Parts + Clone + core::fmt::Debug + Default + PartialEq {
    /// Major version of the newest records that it reads, and the newest minor.
    const VERSION: (u8, u8);
    /// The longest record of it, bytes: a buffer of this length always suffices for [`encode`](super::encode).
    ///
    /// A newer minor may write longer ones, which are read all the same.
    const MAX_LEN: usize;
}

impl Parts for FirstOrder {
    #[inline]
    fn version(_: &CalibrationRecord<Self>) -> Option<Version> {
        None
    }
    #[inline]
    fn write(_: &CalibrationRecord<Self>, _: Version, _: &mut Counting<'_>) -> postcard::Result<()> {
        Ok(())
    }
    #[inline]
    fn read<'a>(
        _: &mut CalibrationRecord<Self>,
        _: Version,
        appended: &'a [u8],
    ) -> Result<&'a [u8], DecodeError> {
        Ok(appended)
    }
    #[inline]
    fn is_first_order(&self) -> bool {
        true
    }
    #[inline]
    fn check(&self, _: &mut Check, _: f32, _: bool) {}
}

impl Order for FirstOrder {
    const VERSION: (u8, u8) = (1, 1);
    const MAX_LEN: usize = longest::FIRST_ORDER;
}

impl Order for HigherOrder {
    const VERSION: (u8, u8) = (2, 0);
    const MAX_LEN: usize = longest::HIGHER_ORDER;
}

impl Parts for HigherOrder {
    fn version(record: &CalibrationRecord<Self>) -> Option<Version> {
        let any = |has: fn(&Self) -> bool| record.triads().any(|(_, triad)| has(&triad.order));
        if any(|order| !order.is_first_order()) {
            return Some(Version::HIGHER_ORDER);
        }
        any(|order| order.warmth.is_some()).then_some(Version::WITH_TEMPERATURE_QUALITY)
    }

    #[inline(never)]
    fn write(
        record: &CalibrationRecord<Self>,
        version: Version,
        out: &mut Counting<'_>,
    ) -> postcard::Result<()> {
        let of =
            |triad: Option<&super::TriadRecord<Self>>| triad.map(|triad| triad.order).unwrap_or_default();
        let all = [of(record.acc.as_ref()), of(record.gyr.as_ref()), of(record.mag.as_ref())];
        if version >= Version::WITH_TEMPERATURE_QUALITY {
            out.write(&all.map(|order| order.warmth))?;
        }
        if version >= Version::HIGHER_ORDER {
            out.write(&all.map(|order| order.curvature))?;
            out.write(&all.map(|order| order.nonlinearity))?;
        }
        Ok(())
    }

    #[inline(never)]
    fn read<'a>(
        record: &mut CalibrationRecord<Self>,
        version: Version,
        mut appended: &'a [u8],
    ) -> Result<&'a [u8], DecodeError> {
        if version >= Version::WITH_TEMPERATURE_QUALITY {
            appended = each(record, appended, |order, warmth| order.warmth = warmth)?;
        }
        if version >= Version::HIGHER_ORDER {
            appended = each(record, appended, |order, curvature| order.curvature = curvature)?;
            appended = each(record, appended, |order, nonlinearity| order.nonlinearity = nonlinearity)?;
        }
        Ok(appended)
    }

    #[inline]
    fn is_first_order(&self) -> bool {
        self.curvature.is_none() && self.nonlinearity.is_none()
    }

    #[inline(never)]
    fn check(&self, check: &mut Check, bias: f32, warm: bool) {
        if let Some(warmth) = &self.warmth {
            check.belongs(Figures::TemperatureSpan, warm);
            check.warmth(warmth, bias);
        }
        if let Some(curvature) = &self.curvature {
            check.belongs(Figures::BiasCurvature, warm);
            check.curvature(curvature, bias);
        }
        if let Some(nonlinearity) = &self.nonlinearity {
            check.nonlinearity(nonlinearity, bias);
        }
    }
}

/// Reads one part of each triad. A part of a triad that is not there is a faulty writer.
fn each<'a, P: Deserialize<'a>>(
    record: &mut CalibrationRecord<HigherOrder>,
    appended: &'a [u8],
    put: impl Fn(&mut HigherOrder, Option<P>),
) -> Result<&'a [u8], DecodeError> {
    let mut left = appended;
    for triad in [&mut record.acc, &mut record.gyr, &mut record.mag] {
        let (part, rest) = taken::<Option<P>>(left)?;
        left = rest;
        match triad {
            Some(triad) => put(&mut triad.order, part),
            None if part.is_none() => {}
            None => return Err(DecodeError::Malformed),
        }
    }
    Ok(left)
}
