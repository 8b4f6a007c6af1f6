//! Accelerometer and gyroscope, which share the rests: found once, fitted one after the other.

use imucal_core::{accept::Refusal, triad::Triad};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    Options,
    acc::{
        self,
        rests::{AccInput, AccResult},
    },
    fit::{
        directions::Directions,
        rest_noise::{AtRest, RestNoise},
    },
    gyr,
    gyr::turns::without_accelerometer,
    known_attitudes,
    outcome::{Calibration, FitSummary, SensorOutcome},
    segmentation::{self, Cut},
    temperature::{Thermometry, WarmTriad},
    thresholds::{self, SegmentationReport, ThresholdTrial},
    usable,
};
use crate::{
    noise::Noise,
    observe::{
        quantum::ConverterSteps,
        rest::{RestDetector, Samples},
    },
    recording::{Recording, SensorKind, Series, Triple, check::integrity::Integrity, unit::STANDARD_GRAVITY},
    simulator::place::EARTH_RATE,
};

/// Accelerometer and gyroscope; the directions at the rests, where the accelerometer passed.
pub(crate) fn calibrate(
    recording: &Recording,
    (integrity, steps): (&Integrity, &ConverterSteps<'_>),
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
    calibration: &mut Calibration,
) -> Option<Directions> {
    let thermometry = options.temperature.then(|| Thermometry::of(recording)).flatten();
    let wanted = recording.gyr.as_ref().filter(|_| !options.skip.contains(&SensorKind::Gyr));
    let usable_gyr = usable(integrity, SensorKind::Gyr, recording.rows());
    let by_attitudes = wanted.and_then(|gyr| {
        progress("fitting the gyroscope");
        gyr::rig::gyroscope(recording, gyr, &usable_gyr, options, (calibration, thermometry.as_ref()))
    });
    let (gyr_on_rig, motions) = by_attitudes.unzip();
    let motions = motions.flatten().filter(|_| options.compare);
    let compare_gyr = |calibration: &mut Calibration, field: FieldForm<'_>| {
        let comparison = motions.as_ref().and_then(|motions| gyr::ladder::comparison(motions, field));
        calibration.comparisons.extend(comparison);
    };
    let Some(acc) = &recording.acc else {
        compare_gyr(calibration, &|_| None);
        let alone = wanted.map(|_| gyr::turns::alone());
        calibration.sensors.extend(gyr_on_rig.or(alone));
        return None;
    };
    progress("finding rests");
    let gravity = gravity(recording, calibration);
    let at_rest = Rests {
        recording,
        acc,
        usable: usable(integrity, SensorKind::Acc, recording.rows()),
        interval: recording.sample_interval(SensorKind::Acc).unwrap_or(1.0),
        rates: recording.series(SensorKind::Gyr, &usable_gyr),
        gravity,
        thermometry: thermometry.as_ref(),
    };
    let detector = at_rest.detector();
    let cuts = segmentation::cuts(&detector, &options.multipliers, at_rest.gravity);
    let (_, from_initial_rest) = detector.noise();
    drop(detector);
    let Some(chosen) = segmentation::choose(&cuts) else {
        compare_gyr(calibration, &|_| None);
        calibration.sensors.extend(gyr_on_rig);
        return None;
    };
    progress("fitting the accelerometer");
    // Both sensors' at once: of the three axes of one, two cores take as long as of four.
    let (step, gyr_step) = rayon::join(
        || steps.of(SensorKind::Acc),
        || wanted.map_or_else(Vector3::zeros, |_| steps.of(SensorKind::Gyr)),
    );
    let shown = at_rest.noise(chosen, step);
    let AccResult { outcome: acc_outcome, used, noise } =
        at_rest.accelerometer(&cuts, chosen, &shown, options, calibration);
    let mut trials: Vec<_> = cuts.iter().map(Cut::trial).collect();
    let directions = acc_outcome.passed().map(|fit| directions(fit, chosen, shown, noise));
    let shared = GyrShared {
        recording,
        usable: &usable_gyr,
        interval: at_rest.rates.map_or(1.0, |rates| rates.interval),
        step: gyr_step,
        directions: directions.as_ref(),
        thermometry: thermometry.as_ref(),
    };
    compare_gyr(calibration, &|until| {
        let (gyr, acc) = (wanted?, acc_outcome.passed()?);
        shared.before(gyr, until.unwrap_or(usize::MAX), chosen, &acc.warm(), &used)
    });
    let gyr_outcome = gyr_on_rig.or_else(|| {
        let gyr = wanted?;
        progress("fitting the gyroscope");
        Some(shared.outcome(gyr, chosen, &cuts, (&acc_outcome, &used), &mut trials))
    });
    let acc_outcome = Some(acc_outcome).filter(|_| !options.skip.contains(&SensorKind::Acc));
    calibration.sensors.extend(acc_outcome.into_iter().chain(gyr_outcome));
    calibration.segmentation =
        Some(segmentation_report(chosen, from_initial_rest, &calibration.sensors, trials));
    directions
}

/// What is reported of the rests.
fn segmentation_report(
    chosen: &Cut,
    from_initial_rest: bool,
    sensors: &[SensorOutcome],
    trials: Vec<ThresholdTrial>,
) -> SegmentationReport {
    let spreads = sensors.iter().filter_map(|s| s.fit.as_ref()?.gain_spread);
    SegmentationReport {
        rests: chosen.rows.clone(),
        multiplier: chosen.multiplier,
        threshold: chosen.threshold,
        from_initial_rest,
        gain_spread: spreads.fold(0.0, f64::max),
        trials,
    }
}

/// The site's gravity, m/s².
fn gravity(recording: &Recording, calibration: &mut Calibration) -> f64 {
    recording.manifest.site.gravity().unwrap_or_else(|| {
        calibration.warnings.push(format!(
            "no [site] gravity and no latitude: taken as {STANDARD_GRAVITY} m/s², which may be 0.3 % off"
        ));
        STANDARD_GRAVITY
    })
}

/// Earth's rate about the vertical, upwards, rad/s; zero where the latitude is not given.
fn vertical_rate(recording: &Recording) -> f64 {
    let latitude = recording.manifest.site.latitude_deg;
    latitude.map_or(0.0, |degrees| EARTH_RATE * libm::sin(degrees.to_radians()))
}

/// An accelerometer in which rests are looked for.
struct Rests<'a> {
    recording: &'a Recording,
    acc: &'a Triple,
    /// Rows in which it is usable.
    usable: Vec<bool>,
    /// Between its samples, s.
    interval: f64,
    /// The gyroscope's samples.
    rates: Option<Series<'a>>,
    gravity: f64,
    thermometry: Option<&'a Thermometry<'a>>,
}

impl Rests<'_> {
    fn detector(&self) -> RestDetector<'_> {
        let temperature = self.recording.temperature.as_deref();
        let samples = Samples { acc: self.series(), gyr: self.rates, temperature };
        RestDetector::new(samples, self.recording.median_interval().unwrap_or(1.0))
    }

    fn series(&self) -> Series<'_> {
        let Self { recording, acc, usable, interval, .. } = self;
        Series { time: &recording.time, values: &acc.values, usable, interval: *interval }
    }

    fn noise(&self, chosen: &Cut, step: Vector3<f64>) -> RestNoise {
        AtRest { series: self.series(), rows: &chosen.rows, step }.noise()
    }

    /// The accelerometer's outcome, on a rig or by its rests.
    fn accelerometer(
        &self,
        cuts: &[Cut],
        chosen: &Cut,
        shown: &RestNoise,
        options: &Options,
        calibration: &mut Calibration,
    ) -> AccResult {
        let Self { recording, acc, usable, gravity, thermometry, .. } = self;
        let known = (&mut *calibration, *thermometry);
        let on_rig = known_attitudes::rig::accelerometer(recording, acc, usable, *gravity, options, known);
        let mut result = match on_rig {
            Some(outcome) => AccResult { outcome, used: (0..chosen.rests.len()).collect(), noise: None },
            None if never_moved(&chosen.rows, recording.rows()) => acc::rests::never_moved(options.acc),
            None => {
                let input = AccInput {
                    rests: &chosen.rests,
                    noise: shown,
                    sensor: acc,
                    gravity: *gravity,
                    thermometry: *thermometry,
                };
                acc::rests::calibrate(&input, options.acc)
            }
        };
        if options.compare && recording.gimbal.is_none() {
            calibration.comparisons.extend(acc::rests::compare(&chosen.rests, *gravity));
        }
        // A refused gain moves as it likes, and encoders say where a rig stood still whatever the threshold.
        if result.outcome.evidence.is_some()
            && let Some(fit) = &mut result.outcome.fit
        {
            let gains: Vec<_> =
                segmentation::comparable(cuts).filter_map(|cut| Some(cut.fit?.0.gain.diagonal())).collect();
            fit.gain_spread = Some(thresholds::gain_spread(gains.iter().copied()));
        }
        result
    }
}

/// How an accelerometer's directions err. Where its fit says nothing of the rests' noise, by what they show of it.
fn directions(fit: &FitSummary, cut: &Cut, shown: RestNoise, noise: Option<Noise>) -> Directions {
    let warm = fit.warm();
    Directions {
        triad: fit.triad,
        covariance: fit.covariance.clone(),
        covariance_of: fit.covariance_of.clone(),
        means: cut.rests.iter().map(|rest| warm.reduced(&rest.acc.mean(), rest.temperature)).collect(),
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
    /// Step of the gyroscope's converter.
    step: Vector3<f64>,
    directions: Option<&'a Directions>,
    thermometry: Option<&'a Thermometry<'a>>,
}

/// The gyroscope has usable samples in every rest.
fn known_at_rest(cut: &Cut) -> bool {
    cut.rests.iter().all(|rest| rest.gyr.count() > 0)
}

impl GyrShared<'_> {
    fn input<'b>(
        &'b self,
        gyr: &'b Triple,
        cut: &'b Cut,
        acc: &'b WarmTriad,
        used: &'b [usize],
    ) -> gyr::observed_turns::GyrInput<'b> {
        gyr::observed_turns::GyrInput {
            sensor: gyr,
            rates: Series {
                time: &self.recording.time,
                values: &gyr.values,
                usable: self.usable,
                interval: self.interval,
            },
            step: self.step,
            rows: &cut.rows,
            rests: &cut.rests,
            used,
            acc,
            directions: None,
            vertical_rate: vertical_rate(self.recording),
            thermometry: None,
        }
    }

    /// The field form of the rests that end before a row.
    fn before(
        &self,
        gyr: &Triple,
        row: usize,
        cut: &Cut,
        acc: &WarmTriad,
        used: &[usize],
    ) -> Option<Triad<f64>> {
        if !known_at_rest(cut) {
            return None;
        }
        let count = cut.rows.partition_point(|rest| rest.end <= row);
        let used: Vec<usize> = used.iter().copied().filter(|k| *k < count).collect();
        let whole = self.input(gyr, cut, acc, &used);
        let input =
            gyr::observed_turns::GyrInput { rows: &cut.rows[..count], rests: &cut.rests[..count], ..whole };
        gyr::turns::calibrate(&input).passed().map(|fit| fit.triad)
    }

    fn outcome(
        &self,
        gyr: &Triple,
        chosen: &Cut,
        cuts: &[Cut],
        (acc, used): (&SensorOutcome, &[usize]),
        trials: &mut [ThresholdTrial],
    ) -> SensorOutcome {
        let acc = match (&acc.verdict, &acc.fit) {
            (Ok(()), Some(fit)) => fit.warm(),
            (Err(refused), _) => return without_accelerometer(refused.refusal),
            (Ok(()), None) => return without_accelerometer(Refusal::NoRest),
        };
        if !known_at_rest(chosen) {
            return gyr::turns::unknown_at_rest();
        }
        let input = gyr::observed_turns::GyrInput {
            directions: self.directions,
            thermometry: self.thermometry,
            ..self.input(gyr, chosen, &acc, used)
        };
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
                let own = match cut.fit {
                    // A quick fit knows nothing of temperature.
                    Some((triad, _)) if acc.terms.is_none() => WarmTriad { triad, terms: None },
                    _ => acc,
                };
                known_at_rest(cut).then(|| gyr::turns::trial(&self.input(gyr, cut, &own, &all), &start))?
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
        fit.gain_spread = Some(thresholds::gain_spread(compared.iter().copied()));
        outcome
    }
}
