//! The motions that a gyroscope is calibrated from: between rests of a rig, or along an optical reference.

use std::ops::Range;

use imucal_core::{model::parameterisation::FULL, observation::Moments};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::bias_smoother::{Still, Wander};
use crate::{
    calibrate::{
        fit::{gyr_rig_fit, lag::Lag, rest_noise::AtRest},
        outcome::BiasWander,
        temperature::{
            TemperatureFinding, Thermometry,
            rest_rates::{self, WarmRates},
        },
    },
    noise::{self, Noise, Span, white::RestMeans},
    observe::{
        motion::{self, Attitudes, MotionData, MotionInput},
        pose,
        quantum::quantum,
    },
    recording::{Recording, SensorKind, Series, Triple, unit::STANDARD_GRAVITY},
    simulator::place::EARTH_RATE,
};

/// How far into a still stretch a motion reaches, s; to its middle where that is nearer.
const MARGIN: f64 = 1.0;
/// Fewer motions do not distinguish a lag from the gain.
const LEAST_FOR_LAG: usize = 16;
/// Length of a motion between optical references, s.
pub const OPTICAL: f64 = 1.5;
/// What a gyroscope is calibrated from.
#[derive(Clone, Debug)]
pub struct Observations {
    /// The motions.
    pub data: Vec<MotionData>,
    /// Static bias, where there is a rest to measure it, rad/s.
    pub bias: Vector3<f64>,
    /// How the bias moved from one still stretch to another, where there are any.
    pub wander: Option<BiasWander>,
    /// Noise of the rates, as the still stretches show it.
    pub noise: Option<Noise>,
    /// Motions left out, in words.
    pub left_out: Vec<String>,
    /// How the motions were made, in words.
    pub notes: Vec<String>,
    /// How the bias follows the temperature, where that is asked for, with the variance of its terms' fit.
    pub temperature: Option<TemperatureFinding>,
}

/// Motions between the still stretches of the encoders.
pub fn on_encoders(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    gimbal: &[[f64; 3]],
    attitudes: &Attitudes,
    axes: &imucal_core::model::rig::RigAxes,
    thermometry: Option<&Thermometry<'_>>,
) -> Observations {
    let input = input(recording, sensor, usable, attitudes);
    let stretches: Vec<(Range<usize>, Matrix3<f64>)> = pose::still_stretches(&recording.time, gimbal)
        .into_iter()
        .filter_map(|rows| {
            let attitude = motion::of_angles(&pose::mean_angles(&gimbal[rows.clone()])?, axes)?;
            Some((rows, attitude))
        })
        .collect();
    let measured = |(rows, attitude): &(Range<usize>, Matrix3<f64>)| {
        Some((rows.clone(), still(&input, rows, attitude)?))
    };
    let (rows, mut stills): (Vec<Range<usize>>, Vec<Still>) = stretches.iter().filter_map(measured).unzip();
    let warm = thermometry.map(|thermometry| warm_bias(&input, &rows, &stills, thermometry));
    let (temperature, growth) = warm.unzip();
    let growth = growth.flatten();
    if let Some(growth) = &growth {
        stills.iter_mut().zip(growth).for_each(|(still, growth)| still.mean -= growth);
    }
    let grown = Wander::through(&stills, growth.as_deref().unwrap_or_default());
    let (path, bias, wander) = Wander::of(&stills);
    let mut found = Observations {
        data: Vec::new(),
        bias,
        wander: Some(wander),
        noise: noise(&input, &stretches, &stills),
        left_out: Vec::new(),
        notes: vec!["against the encoders' attitude, from one still stretch of the table to the next".into()],
        temperature,
    };
    for (k, pair) in stretches.windows(2).enumerate() {
        let [(before, start), (after, end)] = pair else { continue };
        let rows = leave(&recording.time, before)..arrive(&recording.time, after);
        match input.compress(rows, [start, end], &|time| path.at(time) + grown.at(time)) {
            Ok(data) => found.data.push(data),
            Err(gap) => {
                found.left_out.push(format!("motion from still stretch {} to {}: {gap}", k + 1, k + 2));
            }
        }
    }
    found
}

/// How the bias follows the temperature, and by how much it has grown at each still stretch, rad/s, where terms are kept.
fn warm_bias(
    input: &MotionInput<'_>,
    rows: &[Range<usize>],
    stills: &[Still],
    thermometry: &Thermometry<'_>,
) -> (TemperatureFinding, Option<Vec<Vector3<f64>>>) {
    let temperatures: Vec<f64> = rows.iter().map(|rows| thermometry.mean(rows)).collect();
    let mut finding = TemperatureFinding::new(&temperatures);
    if let Err(refusal) = thermometry.check(&temperatures) {
        return (finding.refused(refusal), None);
    }
    let series = input.rates;
    let rates = WarmRates {
        means: &stills.iter().map(|still| still.mean).collect::<Vec<_>>(),
        times: &stills.iter().map(Still::time).collect::<Vec<_>>(),
        temperatures: &temperatures,
        noise: &AtRest { series, rows, step: quantum(series.values, series.usable) }.noise(),
    };
    let kept = rest_rates::estimate(&rates, &mut finding);
    let growth = kept.map(|kept| temperatures.iter().map(|t| kept.terms.drift(*t)).collect());
    (finding, growth)
}

/// Row at which a motion leaves a still stretch.
fn leave(time: &[f64], still: &Range<usize>) -> usize {
    let (first, last) = (time[still.start], time[still.end - 1]);
    let from = last - MARGIN.min(0.5 * (last - first));
    still.start + time[still.clone()].partition_point(|t| *t < from)
}

/// One beyond the row at which a motion arrives in a still stretch.
fn arrive(time: &[f64], still: &Range<usize>) -> usize {
    let (first, last) = (time[still.start], time[still.end - 1]);
    let to = first + MARGIN.min(0.5 * (last - first));
    still.start + time[still.clone()].partition_point(|t| *t <= to)
}

/// The mean rate of a still stretch less Earth's rotation; `None` where hardly a sample is usable.
fn still(input: &MotionInput<'_>, rows: &Range<usize>, attitude: &Matrix3<f64>) -> Option<Still> {
    let mut moments = Moments::default();
    let Series { time, values, usable, .. } = input.rates;
    rows.clone().filter(|k| usable[*k]).for_each(|k| moments.push(&values[k]));
    let count = f64::from(moments.count());
    (moments.count() > 10).then(|| Still {
        span: time[rows.start]..time[rows.end - 1],
        mean: moments.mean() - attitude.tr_mul(&input.earth_p),
        // Rounding to counts may leave no spread at all.
        variance: (moments.variance() / count).map(|v| v.max(1e-14)),
    })
}

/// What the mean rates of the still stretches show of noise, with one constant bias.
fn noise(
    input: &MotionInput<'_>,
    stretches: &[(Range<usize>, Matrix3<f64>)],
    stills: &[Still],
) -> Option<Noise> {
    let Series { time, values, usable, .. } = input.rates;
    let rows: Vec<Range<usize>> = stretches.iter().map(|(rows, _)| rows.clone()).collect();
    let spans: Vec<Span> = stills.iter().map(|still| still.span.clone()).collect();
    let means = stills.iter().flat_map(|still| still.mean.iter().copied());
    Noise::of(&noise::Residuals {
        spans: &spans,
        density: RestMeans::of(time, values, usable, &rows).density(),
        residuals: &DVector::from_iterator(3 * stills.len(), means),
        jacobian: &DMatrix::from_fn(3 * stills.len(), 3, |row, k| f64::from(u8::from(row % 3 == k))),
    })
}

/// Motions of equal length between optical references; each starts at the reference after the one that ended the
/// motion before, so that no two share one.
pub fn on_reference(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    attitudes: &Attitudes,
) -> Observations {
    let input = input(recording, sensor, usable, attitudes);
    let valid = attitudes.iter().flatten().count();
    let mut found = Observations {
        data: Vec::new(),
        bias: Vector3::zeros(),
        wander: None,
        noise: None,
        left_out: Vec::new(),
        notes: vec![format!(
            "against the reference attitude, {OPTICAL} s a motion; {valid} of {} rows have one",
            attitudes.len()
        )],
        temperature: None,
    };
    let next = |from: usize| (from..attitudes.len()).find_map(|k| Some((k, attitudes[k].as_ref()?)));
    let mut from = 0;
    let mut broken = 0;
    while let Some((first, start)) = next(from) {
        let reach = input.rates.time.partition_point(|t| *t < input.rates.time[first] + OPTICAL);
        let Some((last, end)) = next(reach) else { break };
        if input.rates.time[last] - input.rates.time[first] > 2.0 * OPTICAL {
            broken += 1;
        } else {
            match input.compress(first..last + 1, [start, end], &|_| Vector3::zeros()) {
                Ok(data) => found.data.push(data),
                Err(_) => broken += 1,
            }
        }
        from = last + 1;
    }
    if broken > 0 {
        found.left_out.push(format!("{broken} motions in which the reference or the rates are missing"));
    }
    found
}

/// Motions along an optical reference whose clock is as far from the sensor's as fits best.
pub fn lagging(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    attitudes: &Attitudes,
) -> Observations {
    let at =
        |lag: f64| on_reference(recording, sensor, usable, &motion::later(&recording.time, attitudes, lag));
    let plain = on_reference(recording, sensor, usable, attitudes);
    if plain.data.len() < LEAST_FOR_LAG {
        return plain;
    }
    let rms = |lag: f64| gyr_rig_fit::fit(&at(lag).data, FULL, plain.bias).report.rms;
    let lag = Lag::of(rms, rms);
    let mut found = if let Lag::Found(lag) = lag { at(lag) } else { plain };
    found.notes.push(lag.note());
    found
}

fn input<'a>(
    recording: &'a Recording,
    sensor: &'a Triple,
    usable: &'a [bool],
    attitudes: &'a Attitudes,
) -> MotionInput<'a> {
    let site = &recording.manifest.site;
    let earth_p = site.latitude_deg.map_or_else(Vector3::zeros, |degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector3::new(cos, 0.0, -sin) * EARTH_RATE
    });
    MotionInput {
        rates: Series {
            time: &recording.time,
            values: &sensor.values,
            usable,
            interval: recording.sample_interval(SensorKind::Gyr).unwrap_or(1.0),
        },
        attitudes,
        earth_p,
        force_p: Vector3::new(0.0, 0.0, -site.gravity().unwrap_or(STANDARD_GRAVITY)),
    }
}
