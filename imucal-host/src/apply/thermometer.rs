//! The temperature at each row: a thermometer is often read more seldom than a sensor, and its last reading counts until the next, as
//! on the device.

use crate::{recording::Recording, store::StoredCalibration};

/// Share of the temperatures that terms were found from by which a reading may lie beyond them without a word.
const BEYOND: f64 = 0.5;

/// A thermometer over the rows of a recording, and what of its readings the terms of a calibration do not hold for.
#[derive(Clone, Debug)]
pub struct Thermometer {
    last: f32,
    rows: usize,
    /// Rows before the first reading.
    without: usize,
    /// Rows beyond the span of the terms, and the furthest reading of these.
    beyond: (usize, f32),
    terms: Option<Terms>,
}

/// Where terms of temperature hold, °C.
#[derive(Clone, Copy, Debug)]
struct Terms {
    reference: f64,
    span: Option<[f64; 2]>,
}

impl Thermometer {
    /// For a calibration: that of the first sensor with terms of temperature says where they hold.
    pub fn new(stored: &StoredCalibration) -> Self {
        let triads = [&stored.acc, &stored.gyr, &stored.mag].into_iter().flatten();
        let mut terms = triads.filter_map(|triad| triad.temperature.as_ref()).map(|found| Terms {
            reference: found.reference,
            span: found.quality.map(|quality| quality.span),
        });
        Self { last: f32::NAN, rows: 0, without: 0, beyond: (0, 0.0), terms: terms.next() }
    }

    /// °C at each of the next rows; NaN before the first reading.
    pub fn readings(&mut self, part: &Recording) -> Vec<f32> {
        let rows = 0..part.rows();
        rows.map(|row| {
            let read = part.temperature.as_ref().map_or(f64::NAN, |all| all[row]) as f32;
            if read.is_finite() {
                self.last = read;
            }
            self.count();
            self.last
        })
        .collect()
    }

    fn count(&mut self) {
        self.rows += 1;
        self.without += usize::from(self.last.is_nan());
        let Some([low, high]) = self.terms.and_then(|terms| terms.span) else { return };
        let off = |read: f32| (low - f64::from(read)).max(f64::from(read) - high);
        if off(self.last) > BEYOND * (high - low) {
            let (rows, furthest) = self.beyond;
            let further = rows == 0 || off(self.last) > off(furthest);
            self.beyond = (rows + 1, if further { self.last } else { furthest });
        }
    }

    /// What is not as the terms want it, a sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let Some(Terms { reference, span }) = self.terms else { return Vec::new() };
        let rows = match self.without {
            all if all == self.rows => "no row has a temperature".to_owned(),
            some => format!("{some} of {} rows come before the first temperature", self.rows),
        };
        let without = format!(
            "the calibration has terms of temperature, and {rows}: there it is applied as at {reference:.1} °C"
        );
        let (beyond, furthest) = self.beyond;
        let beyond = span.filter(|_| beyond > 0).map(|[low, high]| {
            format!(
                "the terms of temperature were found between {low:.1} and {high:.1} °C, and {beyond} of {} rows are far beyond, at up \
                 to {furthest:.1} °C: check that `temp` is in °C; a calibration over these temperatures would hold there",
                self.rows
            )
        });
        (self.without > 0).then_some(without).into_iter().chain(beyond).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{apply::stream::tests::CALIBRATION, recording::Manifest, store::StoredTemperatureQuality};

    /// With terms that were found between 20 and 30 °C.
    fn stored() -> StoredCalibration {
        let mut stored: StoredCalibration = toml::from_str(CALIBRATION).unwrap();
        let terms = stored.acc.as_mut().and_then(|acc| acc.temperature.as_mut()).unwrap();
        terms.reference = 25.0;
        terms.quality = Some(StoredTemperatureQuality { span: [20.0, 30.0], ..Default::default() });
        stored
    }

    fn read(temperature: Option<Vec<f64>>) -> (Vec<f32>, Vec<String>) {
        let rows = 6;
        let mut part = Recording::new("run.csv", Manifest::default(), (0..rows).map(f64::from).collect());
        part.temperature = temperature;
        let mut thermometer = Thermometer::new(&stored());
        (thermometer.readings(&part), thermometer.remarks())
    }

    #[test]
    fn the_last_reading_counts_until_the_next() {
        let gap = f64::NAN;
        let (readings, remarks) = read(Some(vec![21.0, gap, gap, 24.0, gap, 29.0]));
        assert_eq!(readings, [21.0, 21.0, 21.0, 24.0, 24.0, 29.0]);
        assert_eq!(remarks, Vec::<String>::new());
        let (readings, remarks) = read(Some(vec![gap, gap, 24.0, gap, gap, gap]));
        assert!(readings[1].is_nan() && readings[5] == 24.0);
        assert!(remarks[0].contains("2 of 6 rows come before the first temperature"), "{remarks:?}");
    }

    #[test]
    fn no_temperature_and_one_far_beyond_are_said() {
        let (_, remarks) = read(None);
        assert!(
            remarks[0].contains("no row has a temperature: there it is applied as at 25.0 °C"),
            "{remarks:?}"
        );
        let kelvin = vec![294.0, 295.0, 296.0, 295.0, 34.0, 36.0];
        let (_, remarks) = read(Some(kelvin));
        assert!(remarks[0].contains("5 of 6 rows are far beyond, at up to 296.0 °C"), "{remarks:?}");
    }
}
