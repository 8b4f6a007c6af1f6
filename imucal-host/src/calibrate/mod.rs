//! A recording to a calibration: observations, fits through the core, acceptance.

use imucal_core::{accept::Refusal, observation::Moments, triad::Triad};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{
    noise::Noise,
    observe::{
        held,
        rest::{RestDetector, Samples},
    },
    recording::{
        Recording, SensorKind, Triple,
        check::{integrity, integrity::Integrity},
        unit::STANDARD_GRAVITY,
    },
    simulator::place::EARTH_RATE,
};

pub mod acc;
pub mod examination;
pub mod fit;
pub mod gyr;
pub mod handedness;
pub mod known_attitudes;
pub mod mag;
pub mod outcome;
pub mod segmentation;
pub mod suspicion;

pub use outcome::{Calibration, FitSummary, Refused, SegmentationReport, SensorOutcome};
use segmentation::Cut;
pub use suspicion::{Follows, Status, Suspicion};

pub use self::acc::rests::AccModel;
use self::{
    acc::rests::AccInput,
    fit::{
        alignment::FieldAtRest,
        directions::Directions,
        rest_noise::{AtRest, RestNoise},
    },
    mag::samples::MagInput,
};

/// What to calibrate, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The accelerometer's model.
    pub acc: AccModel,
    /// Sensors to leave alone.
    pub skip: Vec<SensorKind>,
    /// Multiples of the initial rest's variance to try.
    pub multipliers: Vec<f64>,
    /// The accelerometer's rung of [`known_attitudes::ladder::ACCELEROMETER`] where the recording has a rig; `None` for the field form.
    pub rig_acc: Option<&'static str>,
    /// The gyroscope's model of [`gyr::rig::MODELS`] where the recording has attitudes; `None` for the field form.
    pub rig_gyr: Option<&'static str>,
    /// The magnetometer's rung of [`known_attitudes::ladder::MAGNETOMETER`] where the recording has attitudes; `None` for the field form.
    pub rig_mag: Option<&'static str>,
    /// Climb the ladders and say which rung to use.
    pub compare: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            acc: AccModel::T9,
            skip: Vec::new(),
            multipliers: segmentation::MULTIPLIERS.to_vec(),
            rig_acc: Some("I14"),
            rig_gyr: Some(gyr::rig::G12),
            rig_mag: Some("X21"),
            compare: false,
        }
    }
}

/// Calibrates every sensor the recording allows. `progress` is told of each stage.
pub fn calibrate(recording: &Recording, options: &Options, progress: &(dyn Fn(&str) + Sync)) -> Calibration {
    progress("checking the samples");
    let integrity = integrity::inspect(recording);
    let mut calibration = Calibration {
        recording: recording.name.clone(),
        sensor_name: recording.manifest.sensor.name.clone().unwrap_or_default(),
        serial: recording.manifest.sensor.serial.clone().unwrap_or_default(),
        sensors: Vec::new(),
        segmentation: None,
        comparisons: Vec::new(),
        warnings: Vec::new(),
        read_warnings: recording.warnings.iter().map(ToString::to_string).collect(),
    };
    integrity_warnings(&integrity, &mut calibration.warnings);
    let directions = inertial(recording, &integrity, options, progress, &mut calibration);
    if let Some(mag) = recording.mag.as_ref().filter(|_| !options.skip.contains(&SensorKind::Mag)) {
        progress("fitting the magnetometer");
        let field = recording.manifest.site.field_ned_ut.map(|f| Vector3::from(f).norm());
        let usable = usable(&integrity, SensorKind::Mag, recording.rows());
        let on_rig = known_attitudes::rig::magnetometer(recording, mag, &usable, options, &mut calibration)
            .or_else(|| {
                known_attitudes::mag_reference::magnetometer(
                    recording,
                    mag,
                    &usable,
                    options,
                    &mut calibration,
                )
            });
        let outcome = on_rig.unwrap_or_else(|| {
            let rests = calibration.segmentation.as_ref().map_or(&[][..], |found| &found.rests);
            let interval = recording.median_interval().unwrap_or(1.0);
            let usable = counted_once(mag, &usable, rests, &mut calibration.warnings);
            let input =
                MagInput { time: &recording.time, sensor: mag, usable: &usable, interval, rests, field };
            let mut outcome = mag::samples::calibrate(&input);
            if outcome.verdict.is_ok()
                && let Some(fit) = &mut outcome.fit
            {
                align(fit, recording, &usable, &calibration, directions.as_ref());
            }
            outcome
        });
        calibration.sensors.push(outcome);
    }
    progress("checking the order and signs of the axes");
    handedness::mirror::check(recording, &mut calibration);
    progress("testing the residuals");
    examination::examine::examine(recording, &integrity, &mut calibration);
    few_left_over(&mut calibration);
    calibration
}

/// Warns of rests that are hardly more than parameters: what they follow is then in the parameters.
fn few_left_over(calibration: &mut Calibration) {
    let Some(outcome) = calibration.sensor(SensorKind::Acc) else { return };
    let Some(fit) = outcome.passed().filter(|_| outcome.evidence.is_some()) else { return };
    if fit.observations < 2 * fit.parameters {
        let (rests, parameters) = (fit.observations, fit.parameters);
        let warning = format!(
            "acc: {rests} rests for {parameters} parameters leave {} degrees of freedom, in which few faults show; record {} \
             rests or more",
            rests - parameters,
            2 * parameters + 2
        );
        calibration.warnings.push(warning);
    }
}

/// The usable rows; without those that repeat the row before, where samples are held in motion.
fn counted_once(
    mag: &Triple,
    usable: &[bool],
    rests: &[std::ops::Range<usize>],
    warnings: &mut Vec<String>,
) -> Vec<bool> {
    let share = held::share(&mag.values, usable, rests);
    if share <= examination::examine::HELD {
        return usable.to_vec();
    }
    warnings.push(format!(
        "mag: {:.0} % of its rows in motion repeat the row before; each sample counts once",
        100.0 * share
    ));
    held::once(&mag.values, usable)
}

/// Turns a magnetometer into the accelerometer's axes, where there is one that passed and the rests tell the rotation.
fn align(
    fit: &mut FitSummary,
    recording: &Recording,
    usable: &[bool],
    calibration: &Calibration,
    directions: Option<&Directions>,
) {
    let (Some(directions), Some(mag)) = (directions, &recording.mag) else { return };
    let Some(segmentation) = &calibration.segmentation else { return };
    let at_rest = segmentation.rests.iter().enumerate().filter_map(|(rest, rows)| {
        let mut moments = Moments::default();
        rows.clone().filter(|k| usable[*k]).for_each(|k| moments.push(&mag.values[k]));
        let (mean, count) = (moments.mean(), f64::from(moments.count()));
        (count > 0.0).then(|| FieldAtRest { rest, mean, variance: moments.variance() / count })
    });
    mag::samples::align_with(fit, directions, &at_rest.collect::<Vec<_>>());
}

/// What was found wrong with the samples and left out, in words.
fn integrity_warnings(integrity: &Integrity, warnings: &mut Vec<String>) {
    for gap in &integrity.gaps {
        warnings.push(format!(
            "gap of {:.3} s before row {} (after t = {:.3} s)",
            gap.duration, gap.row, gap.start
        ));
    }
    for sensor in &integrity.sensors {
        let prefix = sensor.sensor.prefix();
        if sensor.missing > 0 {
            warnings.push(format!("{prefix}: {} rows not measured", sensor.missing));
        }
        for stretch in &sensor.saturated {
            let axis = ["x", "y", "z"][stretch.axis % 3];
            let (from, to) = (stretch.rows.start, stretch.rows.end);
            warnings.push(format!("{prefix}_{axis}: clipped in rows {from} to {to}; left out"));
        }
        for rows in &sensor.stuck {
            warnings.push(format!("{prefix}: stuck in rows {} to {}; left out", rows.start, rows.end));
        }
    }
}

/// Rows in which a sensor is measured, not clipped and not stuck; all rows where there is no such sensor.
fn usable(integrity: &Integrity, kind: SensorKind, rows: usize) -> Vec<bool> {
    integrity.sensor(kind).map_or_else(|| vec![true; rows], |sensor| sensor.usable.clone())
}

/// Accelerometer and gyroscope, which share the rests; the directions there, where the accelerometer passed.
fn inertial(
    recording: &Recording,
    integrity: &Integrity,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
    calibration: &mut Calibration,
) -> Option<Directions> {
    let wanted = recording.gyr.as_ref().filter(|_| !options.skip.contains(&SensorKind::Gyr));
    let (gyr_on_rig, motions) = wanted
        .and_then(|gyr| {
            progress("fitting the gyroscope");
            let usable = usable(integrity, SensorKind::Gyr, recording.rows());
            gyr::rig::gyroscope(recording, gyr, &usable, options, calibration)
        })
        .unzip();
    let motions = motions.flatten().filter(|_| options.compare);
    let compare_gyr = |calibration: &mut Calibration, field: FieldForm<'_>| {
        let comparison = motions.as_ref().and_then(|motions| gyr::ladder::comparison(motions, field));
        calibration.comparisons.extend(comparison);
    };
    let Some(acc) = &recording.acc else {
        compare_gyr(calibration, &|_| None);
        let without = || wanted.map(|_| gyr::turns::without_accelerometer(Refusal::NoRest));
        calibration.sensors.extend(gyr_on_rig.or_else(without));
        return None;
    };
    let gravity = recording.manifest.site.gravity().unwrap_or_else(|| {
        calibration.warnings.push(format!(
            "no [site] gravity and no latitude: taken as {STANDARD_GRAVITY} m/s², which may be 0.3 % off"
        ));
        STANDARD_GRAVITY
    });
    progress("finding rests");
    let usable: Vec<bool> = usable(integrity, SensorKind::Acc, recording.rows())
        .into_iter()
        .zip(usable(integrity, SensorKind::Gyr, recording.rows()))
        .map(|(acc, gyr)| acc && gyr)
        .collect();
    let interval = recording.median_interval().unwrap_or(1.0);
    let detector = RestDetector::new(
        Samples {
            time: &recording.time,
            acc: &acc.values,
            gyr: recording.gyr.as_ref().map(|gyr| gyr.values.as_slice()),
            temperature: recording.temperature.as_deref(),
            usable: &usable,
        },
        interval,
    );
    let cuts = segmentation::cuts(&detector, &options.multipliers, gravity);
    let Some(chosen) = segmentation::choose(&cuts) else {
        compare_gyr(calibration, &|_| None);
        calibration.sensors.extend(gyr_on_rig);
        return None;
    };

    progress("fitting the accelerometer");
    let at_rest =
        AtRest { time: &recording.time, values: &acc.values, usable: &usable, interval, rows: &chosen.rows };
    let shown = at_rest.noise();
    let on_rig = known_attitudes::rig::accelerometer(recording, acc, &usable, gravity, options, calibration);
    let result = match on_rig {
        Some(outcome) => {
            acc::rests::AccResult { outcome, used: (0..chosen.rests.len()).collect(), noise: None }
        }
        None if never_moved(&chosen.rows, recording.rows()) => acc::rests::never_moved(options.acc),
        None => {
            let input = AccInput { rests: &chosen.rests, noise: &shown, sensor: acc, gravity };
            acc::rests::calibrate(&input, options.acc)
        }
    };
    if options.compare && recording.gimbal.is_none() {
        calibration.comparisons.extend(acc::rests::compare(&chosen.rests, gravity));
    }
    let mut trials: Vec<_> = cuts.iter().map(Cut::trial).collect();
    let mut acc_outcome = result.outcome;
    // A refused gain moves as it likes, and encoders say where a rig stood still whatever the threshold.
    if acc_outcome.evidence.is_some()
        && let Some(fit) = &mut acc_outcome.fit
    {
        let gains: Vec<_> =
            segmentation::comparable(&cuts).filter_map(|cut| Some(cut.fit?.0.gain.diagonal())).collect();
        fit.gain_spread = Some(outcome::gain_spread(gains.iter().copied()));
    }
    let directions = acc_outcome.passed().map(|fit| directions(fit, chosen, shown, result.noise));
    let usable = self::usable(integrity, SensorKind::Gyr, recording.rows());
    let latitude = recording.manifest.site.latitude_deg;
    let vertical_rate = latitude.map_or(0.0, |degrees| EARTH_RATE * libm::sin(degrees.to_radians()));
    let shared =
        GyrShared { recording, usable: &usable, interval, vertical_rate, directions: directions.as_ref() };
    compare_gyr(calibration, &|until| {
        let (gyr, acc) = (wanted?, acc_outcome.passed()?);
        shared.before(gyr, until.unwrap_or(usize::MAX), chosen, &acc.triad, &result.used)
    });
    let gyr_outcome = gyr_on_rig.or_else(|| {
        let gyr = wanted?;
        progress("fitting the gyroscope");
        Some(match (&acc_outcome.verdict, acc_outcome.fit.as_ref()) {
            (Ok(()), Some(fit)) => shared.outcome(gyr, chosen, &cuts, &fit.triad, &result.used, &mut trials),
            (Err(refused), _) => gyr::turns::without_accelerometer(refused.refusal),
            (Ok(()), None) => gyr::turns::without_accelerometer(Refusal::NoRest),
        })
    });
    if !options.skip.contains(&SensorKind::Acc) {
        calibration.sensors.push(acc_outcome);
    }
    calibration.sensors.extend(gyr_outcome);
    let spreads = calibration.sensors.iter().filter_map(|s| s.fit.as_ref()?.gain_spread);
    calibration.segmentation = Some(SegmentationReport {
        rests: chosen.rows.clone(),
        multiplier: chosen.multiplier,
        threshold: chosen.threshold,
        from_initial_rest: detector.noise().1,
        gain_spread: spreads.fold(0.0, f64::max),
        trials,
    });
    directions
}

/// How an accelerometer's directions err. Where its fit says nothing of the rests' noise, by what they show of it.
fn directions(fit: &FitSummary, cut: &Cut, shown: RestNoise, noise: Option<Noise>) -> Directions {
    Directions {
        triad: fit.triad,
        covariance: fit.covariance.clone(),
        covariance_of: fit.covariance_of.clone(),
        means: cut.rests.iter().map(|rest| rest.acc.mean()).collect(),
        noise: noise.unwrap_or(Noise { density: shown.density, white: 1.0, drift: 0.0 }),
        spans: shown.spans,
    }
}

/// One rest that is all but the whole recording: the windows at its ends take a little.
fn never_moved(rests: &[std::ops::Range<usize>], rows: usize) -> bool {
    const ALL: f64 = 0.9;
    matches!(rests, [only] if only.len() as f64 > ALL * rows as f64)
}

/// Gives a gyroscope's field form of the rests before a row, or of all.
type FieldForm<'a> = &'a dyn Fn(Option<usize>) -> Option<Triad<f64>>;

/// What all of a gyroscope's fits share.
struct GyrShared<'a> {
    recording: &'a Recording,
    usable: &'a [bool],
    interval: f64,
    vertical_rate: f64,
    directions: Option<&'a Directions>,
}

impl GyrShared<'_> {
    fn input<'b>(
        &'b self,
        gyr: &'b Triple,
        cut: &'b Cut,
        acc: &'b Triad<f64>,
        used: &'b [usize],
    ) -> gyr::turns::GyrInput<'b> {
        gyr::turns::GyrInput {
            time: &self.recording.time,
            sensor: gyr,
            usable: self.usable,
            interval: self.interval,
            rows: &cut.rows,
            rests: &cut.rests,
            used,
            acc,
            directions: None,
            vertical_rate: self.vertical_rate,
        }
    }

    /// The field form of the rests that end before a row.
    fn before(
        &self,
        gyr: &Triple,
        row: usize,
        cut: &Cut,
        acc: &Triad<f64>,
        used: &[usize],
    ) -> Option<Triad<f64>> {
        let count = cut.rows.partition_point(|rest| rest.end <= row);
        let used: Vec<usize> = used.iter().copied().filter(|k| *k < count).collect();
        let whole = self.input(gyr, cut, acc, &used);
        let input = gyr::turns::GyrInput { rows: &cut.rows[..count], rests: &cut.rests[..count], ..whole };
        gyr::turns::calibrate(&input).passed().map(|fit| fit.triad)
    }

    fn outcome(
        &self,
        gyr: &Triple,
        chosen: &Cut,
        cuts: &[Cut],
        acc: &Triad<f64>,
        used: &[usize],
        trials: &mut [outcome::ThresholdTrial],
    ) -> SensorOutcome {
        let input =
            gyr::turns::GyrInput { directions: self.directions, ..self.input(gyr, chosen, acc, used) };
        let mut outcome = gyr::turns::calibrate(&input);
        let Some(fit) = &mut outcome.fit else {
            return outcome;
        };
        let start = fit.triad.gain;
        // Directions come from each cut's own accelerometer fit, as they would had it been chosen.
        let gains: Vec<_> = cuts
            .par_iter()
            .map(|cut| {
                let all: Vec<usize> = (0..cut.rows.len()).collect();
                let own = cut.fit.map_or(*acc, |(triad, _)| triad);
                gyr::turns::trial(&self.input(gyr, cut, &own, &all), &start)
            })
            .collect();
        for (trial, gain) in trials.iter_mut().zip(&gains) {
            trial.gyr_gain = *gain;
        }
        let multipliers: Vec<f64> = segmentation::comparable(cuts).map(|cut| cut.multiplier).collect();
        let compared: Vec<_> = trials
            .iter()
            .filter(|trial| multipliers.contains(&trial.multiplier))
            .filter_map(|trial| trial.gyr_gain)
            .collect();
        fit.gain_spread = Some(outcome::gain_spread(compared.iter().copied()));
        outcome
    }
}
