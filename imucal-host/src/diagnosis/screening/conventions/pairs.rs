//! A triad's samples against what it was given: y ≈ K v + b by robust linear least squares.

use nalgebra::Vector3;

use crate::{
    diagnosis::reference::{moments, moments::Moments},
    effect::Truth,
    recording::{Recording, SensorKind, check::integrity::Integrity},
};

/// Least spread of inputs or samples that stands out of any sensor's noise, by [`SensorKind::ALL`]: m/s², rad/s, µT.
const STRONG: [f64; 3] = [2.0, 0.1, 5.0];
/// Rounds of leaving out outliers, and how many medians away an outlier is.
const ROUNDS: usize = 3;
const FAR: f64 = 6.0;
/// Samples this many times full scale are in another unit.
const BEYOND: f64 = 1.05;
/// A triad with fewer rows says nothing, nor do fewer samples beyond full scale.
const FEWEST: usize = 20;

/// Rows of a triad that can be compared.
#[derive(Clone, Debug)]
pub(crate) struct Pairs {
    /// Samples and inputs, SI units.
    rows: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// What a triad is given, in the table's axes.
pub(crate) fn given(kind: SensorKind, truth: &Truth) -> Vector3<f64> {
    match kind {
        SensorKind::Acc => truth.f_t,
        SensorKind::Gyr => truth.w_it_t,
        SensorKind::Mag => truth.b_t,
    }
}

impl Pairs {
    /// Of a sensor, at rows whose truth is given. `None` without the sensor, with too few usable rows, or where
    /// neither input nor samples vary much.
    pub(crate) fn of(
        recording: &Recording,
        integrity: &Integrity,
        kind: SensorKind,
        rows: &[usize],
        truth: &[Truth],
    ) -> Option<Self> {
        let pairs = Self::all(recording, integrity, kind, rows, truth)?;
        let moments = pairs.moments();
        let spread = (f64::max(moments.input.trace(), moments.output) / moments.rows).sqrt();
        (pairs.rows.len() >= FEWEST && spread > STRONG[kind as usize]).then_some(pairs)
    }

    /// Likewise, however little they vary. `None` without the sensor.
    pub(crate) fn all(
        recording: &Recording,
        integrity: &Integrity,
        kind: SensorKind,
        rows: &[usize],
        truth: &[Truth],
    ) -> Option<Self> {
        let samples = &recording.sensor(kind)?.values;
        let sensor = integrity.sensor(kind)?;
        let measured = |row: usize| samples[row].iter().all(|component| component.is_finite());
        // Nothing lies beyond full scale, but in a wrong unit: then what seems clipped is not.
        let most = recording.sensor(kind)?.full_scale_si().map_or(f64::INFINITY, |scale| BEYOND * scale);
        let beyond = samples.iter().filter(|sample| sample.amax() > most).count() > FEWEST;
        let taken = |row: usize| if beyond { measured(row) } else { sensor.usable[row] };
        let rows = rows.iter().zip(truth).filter(|(row, _)| taken(**row));
        let rows: Vec<_> = rows.map(|(row, truth)| (samples[*row], given(kind, truth))).collect();
        Some(Self { rows })
    }

    /// Means of samples and inputs.
    pub(crate) fn means(&self) -> (Vector3<f64>, Vector3<f64>) {
        moments::means(&self.rows)
    }

    /// Moments of all rows.
    pub(crate) fn moments(&self) -> Moments {
        Moments::of(&self.rows)
    }

    /// Without the rows that stand far off the fit.
    pub(crate) fn trusted(&self) -> Self {
        let mut pairs = self.clone();
        for _ in 0..ROUNDS {
            let k = pairs.moments().sensitivity();
            let off: Vec<Vector3<f64>> = pairs.rows.iter().map(|(y, v)| y - k * v).collect();
            let bias = Vector3::from_fn(|axis, _| {
                crate::recording::median(off.iter().map(|off| off[axis]).collect()).unwrap_or(0.0)
            });
            let off: Vec<f64> = off.iter().map(|off| (off - bias).norm()).collect();
            let limit = FAR * crate::recording::median(off.clone()).unwrap_or(f64::INFINITY);
            let mut off = off.into_iter();
            pairs.rows.retain(|_| off.next().is_some_and(|off| off <= limit));
        }
        pairs
    }
}
