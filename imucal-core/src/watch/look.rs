//! A second of rest: means of calibrated samples.

use nalgebra::Vector3;

use crate::observation::Moments;

/// How long a look lasts, µs.
const LENGTH: u64 = 1_000_000;
/// Time without a sample that breaks a look, µs.
const GAP: u64 = 500_000;

/// Mean of a triad's samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Mean, calibrated, unit of the record.
    pub value: Vector3<f32>,
    /// Variance of the mean on each axis, were the samples independent.
    pub variance: Vector3<f32>,
}

impl Mean {
    /// Every figure is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.value.iter().chain(self.variance.iter()).all(|figure| figure.is_finite())
    }

    #[inline]
    fn of(moments: &Moments<f32>) -> Option<Self> {
        let count = moments.count();
        (count > 0).then(|| Self { value: moments.mean(), variance: moments.variance() / count as f32 })
    }
}

/// A second in which the device lay still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// When it began on the device's clock, whole seconds.
    pub time: u32,
    /// Accelerometer.
    pub acc: Mean,
    /// Gyroscope.
    pub gyr: Option<Mean>,
    /// Magnetometer.
    pub mag: Option<Mean>,
    /// °C; NaN where it is not measured.
    pub temperature: f32,
    /// The device may have been moved since the look before.
    pub moved: bool,
}

/// What calibrated sensors say at one time; unit of the record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibratedSample {
    /// Time on the device's clock, µs.
    pub time: u64,
    /// Accelerometer.
    pub acc: Vector3<f32>,
    /// Gyroscope, where this sample has one.
    pub gyr: Option<Vector3<f32>>,
    /// Magnetometer, likewise.
    pub mag: Option<Vector3<f32>>,
    /// °C; NaN where it is not measured.
    pub temperature: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Second {
    start: u64,
    means: [Moments<f32>; 3],
    temperature: f32,
    temperatures: u32,
}

impl Second {
    #[inline]
    fn push(&mut self, sample: &CalibratedSample) {
        let values = [Some(sample.acc), sample.gyr, sample.mag];
        for (moments, value) in self.means.iter_mut().zip(values) {
            // A sample that was missed is not one of the second.
            let measured = value.filter(|value| value.iter().all(|part| part.is_finite()));
            measured.iter().for_each(|value| moments.push(value));
        }
        if sample.temperature.is_finite() {
            self.temperature += sample.temperature;
            self.temperatures = self.temperatures.saturating_add(1);
        }
    }

    #[inline]
    fn look(&self, moved: bool) -> Option<Look> {
        let [acc, gyr, mag] = &self.means;
        Some(Look {
            time: u32::try_from(self.start / LENGTH).unwrap_or(u32::MAX),
            acc: Mean::of(acc)?,
            gyr: Mean::of(gyr),
            mag: Mean::of(mag),
            // Zero by zero where none was measured.
            temperature: self.temperature / self.temperatures as f32,
            moved,
        })
    }
}

/// Gathers samples at rest into looks. A second counts once the one after it was still too: a motion that begins is none of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookObserver {
    now: Option<Second>,
    pending: Option<Second>,
    /// No motion and no gap since the last look that was given.
    goes_on: bool,
    last: u64,
}

impl LookObserver {
    /// Takes a sample in; `still`: the [`stage`](crate::observer::rest::RestObserver::stage) of a `RestObserver` that had the raw sample
    /// is not [`Moving`](crate::observer::rest::Stage::Moving).
    #[inline]
    pub fn push(&mut self, sample: &CalibratedSample, still: bool) -> Option<Look> {
        let since = sample.time.checked_sub(self.last);
        self.last = sample.time;
        if !still || since.is_none_or(|since| since > GAP) {
            (self.now, self.pending, self.goes_on) = (None, None, false);
        }
        if !still {
            return None;
        }
        let now = self.now.get_or_insert_with(|| Second { start: sample.time, ..Second::default() });
        if sample.time.saturating_sub(now.start) < LENGTH {
            now.push(sample);
            return None;
        }
        let whole = *now;
        let mut next = Second { start: sample.time, ..Second::default() };
        next.push(sample);
        self.now = Some(next);
        let confirmed = self.pending.replace(whole)?;
        let look = confirmed.look(!self.goes_on);
        self.goes_on = true;
        look
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_was_missed_is_none_of_its_second() {
        let mut looks = LookObserver::default();
        let sample = |k: u64| {
            let rate = if k % 50 == 7 { f32::NAN } else { 0.25 };
            CalibratedSample {
                time: 10_000 * k,
                acc: Vector3::new(0.0, 0.0, 9.5),
                gyr: Some(Vector3::new(0.0, rate, 0.0)),
                mag: None,
                temperature: f32::NAN,
            }
        };
        let found: std::vec::Vec<Look> = (0..500).filter_map(|k| looks.push(&sample(k), true)).collect();
        assert!(found.len() >= 2);
        assert!(found.iter().all(|look| look.gyr.is_some_and(|mean| mean.value.y == 0.25)));
    }
}
