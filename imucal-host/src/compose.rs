//! A calibration of what another one has corrected, and both as one.
//!
//! ```text
//! x = A_o (r − b_o)        y = A_n (x − b_n)
//! y = A (r − b)            A = A_n A_o        b = b_o + A_o⁻¹ b_n
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, x, y | raw values, what a device with the old calibration puts out, calibrated values |
//! | A_o, b_o | gain and bias of the old calibration |
//! | A_n, b_n | of the new one, which was made of x |
//!
//! The old calibration is a transformation that was carried out, and what was wrong with it is in x. So the errors are those of
//! the new calibration alone, carried into raw values: σ_A² = Σ_k σ_{n,ik}² A_{o,kj}², and σ_b² likewise by A_o⁻¹. Correlations between
//! entries are not kept in a calibration and not taken into account. Figures of quality are the new one's.
//!
//! Not composed: terms of temperature and nonlinear terms.

use nalgebra::{Matrix3, Vector3};

use crate::{
    recording::{SensorKind, Unit},
    store::{StoredCalibration, StoredTriad},
};

/// Why two calibrations are not composed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ComposeFault {
    /// Of two units.
    #[error(
        "the serials are `{old}` and `{new}`, expected two calibrations of one unit; give the right files"
    )]
    Serials {
        /// Of the old one.
        old: String,
        /// Of the new one.
        new: String,
    },
    /// The new calibration was not made of what the old one puts out.
    #[error(
        "{sensor}: the new calibration takes values in {found}, expected {expected}, which the old one puts out; calibrate from a \
         recording that the old one has corrected"
    )]
    Units {
        /// Which.
        sensor: SensorKind,
        /// What the new one takes.
        found: Unit,
        /// What the old one puts out.
        expected: Unit,
    },
    /// Both are one calibration.
    #[error(
        "both calibrations have the same gains and biases, expected a new one of what the old one has corrected; give the right files"
    )]
    Same,
    /// Terms beyond gain and bias.
    #[error(
        "{sensor}: found {what} in the {which} calibration, expected gain and bias alone; calibrate from raw values"
    )]
    Terms {
        /// Which.
        sensor: SensorKind,
        /// `old` or `new`.
        which: &'static str,
        /// What.
        what: &'static str,
    },
    /// A gain without an inverse.
    #[error("{sensor}: the old gain has no inverse; calibrate from raw values")]
    Singular {
        /// Which.
        sensor: SensorKind,
    },
    /// The new calibration has a sensor that the old one lacks.
    #[error(
        "{sensor}: calibrated in the new calibration alone, expected it in the old one too; it has nothing to stand on"
    )]
    Alone {
        /// Which.
        sensor: SensorKind,
    },
    /// The new calibration has no sensor.
    #[error("no sensor is calibrated in the new calibration")]
    Nothing,
}

/// One calibration of raw values that does what both do in turn. Sensors that the new one lacks are the old one's, with its day.
///
/// # Errors
///
/// [`ComposeFault`].
pub fn compose(old: &StoredCalibration, new: &StoredCalibration) -> Result<StoredCalibration, ComposeFault> {
    let serials = [&old.sensor.serial, &new.sensor.serial];
    if serials.iter().all(|serial| !serial.is_empty()) && serials[0] != serials[1] {
        return Err(ComposeFault::Serials { old: serials[0].clone(), new: serials[1].clone() });
    }
    if SensorKind::ALL.into_iter().all(|kind| new.triad(kind).is_none()) {
        return Err(ComposeFault::Nothing);
    }
    let constants = |calibration: &StoredCalibration, kind: SensorKind| {
        calibration.triad(kind).map(|triad| (triad.gain, triad.bias))
    };
    let is_same =
        |kind: SensorKind| new.triad(kind).is_none() || constants(new, kind) == constants(old, kind);
    if SensorKind::ALL.into_iter().all(is_same) {
        return Err(ComposeFault::Same);
    }
    let of = |kind: SensorKind| match (old.triad(kind), new.triad(kind)) {
        (Some(old), Some(new)) => of_sensor(kind, old, new).map(Some),
        (None, Some(_)) => Err(ComposeFault::Alone { sensor: kind }),
        (kept, None) => Ok(kept.map(|triad| triad.from_day(old))),
    };
    let (acc, gyr, mag) = (of(SensorKind::Acc)?, of(SensorKind::Gyr)?, of(SensorKind::Mag)?);
    let sensor = if new.sensor.serial.is_empty() { old.sensor.clone() } else { new.sensor.clone() };
    Ok(StoredCalibration { acc, gyr, mag, sensor, ..new.clone() })
}

fn of_sensor(kind: SensorKind, old: &StoredTriad, new: &StoredTriad) -> Result<StoredTriad, ComposeFault> {
    if new.unit_in != old.unit_out {
        return Err(ComposeFault::Units { sensor: kind, found: new.unit_in, expected: old.unit_out });
    }
    for (which, triad) in [("old", old), ("new", new)] {
        let terms = [
            (triad.temperature.is_some(), "terms of temperature"),
            (triad.nonlinearity.is_some(), "nonlinear terms"),
        ];
        if let Some((_, what)) = terms.into_iter().find(|(there, _)| *there) {
            return Err(ComposeFault::Terms { sensor: kind, which, what });
        }
    }
    let (before, after) = (old.triad(), new.triad());
    let inverse = before.gain.try_inverse().ok_or(ComposeFault::Singular { sensor: kind })?;
    let bias = before.bias + inverse * after.bias;
    let gain_std = Matrix3::from_fn(|row, column| new.gain_std[row][column]);
    let squared = |m: Matrix3<f64>| m.component_mul(&m);
    let gain_variance = squared(gain_std) * squared(before.gain);
    let bias_variance = squared(inverse) * Vector3::from(new.bias_std).map(|std| std * std);
    Ok(StoredTriad {
        unit_in: old.unit_in,
        gain: rows(&(after.gain * before.gain)),
        bias: bias.into(),
        gain_std: rows(&gain_variance.map(f64::sqrt)),
        bias_std: bias_variance.map(f64::sqrt).into(),
        ..new.clone()
    })
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| m[(row, column)]))
}

#[cfg(test)]
mod tests {
    use imucal_core::record::Date;

    use super::*;
    use crate::{
        apply::apply,
        calibrate::{Options, calibrate},
        recording::Recording,
        simulator::{SimulatedUnit, Tumble, record},
    };

    fn recorded(seed: u64) -> Recording {
        let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
        record("unit.csv", &Tumble::new(16, seed), &unit, seed)
    }

    fn stored(recording: &Recording) -> StoredCalibration {
        let options = Options { temperature: false, ..Options::default() };
        StoredCalibration::of(&calibrate(recording, &options, &|_| {}), Date::from_days(20_000))
    }

    /// An old calibration that is wrong, what a device makes of a second recording by it, and a calibration of that.
    fn both() -> (StoredCalibration, StoredCalibration, StoredCalibration) {
        let mut old = stored(&recorded(1));
        let acc = old.acc.as_mut().expect("calibrated");
        acc.bias[0] += 200.0;
        acc.gain[1][1] *= 1.01;
        let second = recorded(2);
        let device = old.to_record(std::path::Path::new("old.bin")).expect("it fits");
        let corrected = apply(&second, &old, &device).expect("of the unit");
        (old, stored(&corrected), stored(&second))
    }

    #[test]
    fn both_in_turn_are_the_calibration_that_raw_values_give() {
        let (old, new, direct) = both();
        let composed = compose(&old, &new).expect("of one unit");
        for kind in [SensorKind::Acc, SensorKind::Gyr] {
            let (found, direct) =
                (composed.triad(kind).expect("both"), direct.triad(kind).expect("accepted"));
            assert_eq!(found.unit_in, direct.unit_in);
            for axis in 0..3 {
                let off = (found.bias[axis] - direct.bias[axis]) / direct.bias_std[axis];
                assert!(off.abs() < 0.1, "{kind} bias {axis}: {off} standard errors");
                let off = (found.gain[axis][axis] - direct.gain[axis][axis]) / direct.gain_std[axis][axis];
                assert!(off.abs() < 0.1, "{kind} gain {axis}: {off} standard errors");
                let ratio = found.bias_std[axis] / direct.bias_std[axis];
                assert!((ratio - 1.0).abs() < 0.1, "{kind} bias {axis}: errors of {ratio}");
            }
        }
    }

    #[test]
    fn what_does_not_follow_on_the_old_one_is_refused() {
        let (old, new, direct) = both();
        assert!(matches!(compose(&old, &direct), Err(ComposeFault::Units { .. })));
        let mut other = new.clone();
        other.sensor.serial = "other".into();
        assert!(matches!(compose(&old, &other), Err(ComposeFault::Serials { .. })));
        let without = StoredCalibration { acc: None, ..old.clone() };
        assert_eq!(compose(&without, &new), Err(ComposeFault::Alone { sensor: SensorKind::Acc }));
        let nothing = StoredCalibration { acc: None, gyr: None, mag: None, ..new.clone() };
        assert_eq!(compose(&old, &nothing), Err(ComposeFault::Nothing));
        // Its units would allow it to follow on itself.
        assert_eq!(compose(&new, &new), Err(ComposeFault::Same));
        let mut flat = old.clone();
        flat.acc.as_mut().expect("one").gain = [[0.0; 3]; 3];
        assert_eq!(compose(&flat, &new), Err(ComposeFault::Singular { sensor: SensorKind::Acc }));
    }

    #[test]
    fn a_sensor_that_the_new_one_lacks_stays_with_its_own_day() {
        let (old, new, _) = both();
        let alone = StoredCalibration { gyr: None, mag: None, date: Date::from_days(20_365), ..new };
        let composed = compose(&old, &alone).expect("of one unit");
        let gyr = composed.gyr.expect("the old one's");
        assert_eq!(gyr.gain, old.gyr.expect("calibrated").gain);
        assert_eq!(gyr.provenance.expect("its own").date, Date::from_days(20_000));
    }
}
