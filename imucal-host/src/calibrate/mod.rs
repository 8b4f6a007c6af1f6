//! A recording to a calibration: observations, fits through the core, acceptance.

use imucal_core::observation::Moments;
use nalgebra::Vector3;

use crate::{
    observe::{held, quantum::ConverterSteps},
    recording::{
        Recording, SensorKind, Series, Triple,
        check::{integrity, integrity::Integrity},
    },
};

pub mod acc;
pub mod examination;
pub mod fit;
pub mod gyr;
pub mod handedness;
pub(crate) mod inertial;
pub(crate) mod integrity_warning;
pub mod known_attitudes;
pub mod mag;
pub mod nonlinear_terms;
pub mod outcome;
pub mod request;
pub mod residuals;
pub mod segmentation;
pub mod suspicion;
pub mod temperature;
pub mod thresholds;

pub use outcome::{Calibration, FitSummary, Refused, SensorOutcome};
pub use suspicion::{Follows, Status, Suspicion};
pub use thresholds::SegmentationReport;

pub use self::acc::rests::AccModel;
use self::{
    fit::{alignment::FieldAtRest, directions::Directions},
    mag::{declared_field, samples::MagInput},
    outcome::Evidence,
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
    /// Estimate how bias and scale follow the temperature, where the recording has one.
    pub temperature: bool,
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
            temperature: true,
        }
    }
}

/// Calibrates every sensor the recording allows. `progress` is called at each stage.
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
    calibration.warnings.extend(integrity_warning::of(&integrity, recording.rows()));
    let steps = ConverterSteps::new(recording, &integrity);
    let known = (&integrity, &steps);
    let directions = inertial::calibrate(recording, known, options, progress, &mut calibration);
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
            let series = Series { time: &recording.time, values: &mag.values, usable: &usable, interval };
            let input = MagInput { sensor: mag, series, rests, field };
            let mut outcome = mag::samples::calibrate(&input);
            if outcome.verdict.is_ok()
                && let Some(fit) = &mut outcome.fit
            {
                align(fit, recording, &usable, &calibration, directions.as_ref());
                let declared = recording.manifest.site.field_ned_ut.map(Vector3::from);
                outcome.suspicions.extend(declared.and_then(|field| declared_field::check(fit, &field)));
            }
            outcome
        });
        calibration.sensors.push(outcome);
    }
    progress("checking the order and signs of the axes");
    handedness::mirror::check(recording, &mut calibration);
    progress("testing the residuals");
    examination::examine::examine(recording, &integrity, &steps, &mut calibration);
    few_left_over(&mut calibration);
    calibration
}

/// Warns of rests whose equations are hardly more than parameters: what they follow is then in the parameters.
fn few_left_over(calibration: &mut Calibration) {
    let Some(outcome) = calibration.sensor(SensorKind::Acc) else { return };
    let Some(fit) = outcome.passed().filter(|_| outcome.evidence.is_some()) else { return };
    // A rest's norm is one equation; at a known attitude there are three.
    let each = if matches!(outcome.evidence, Some(Evidence::Shell { .. })) { 1 } else { 3 };
    let (rests, parameters) = (fit.observations, fit.parameters);
    let equations = each * rests;
    if equations < 2 * parameters {
        let warning = format!(
            "acc: {rests} rests for {parameters} parameters leave {} degrees of freedom, in which few faults show; record {} \
             rests or more",
            equations.saturating_sub(parameters),
            (2 * parameters + 2).div_ceil(each)
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

/// Turns a magnetometer into the accelerometer's axes, where there is one that passed and the rests determine the rotation.
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
/// Rows in which a sensor is measured, not clipped and not stuck; all rows where there is no such sensor.
fn usable(integrity: &Integrity, kind: SensorKind, rows: usize) -> Vec<bool> {
    integrity.sensor(kind).map_or_else(|| vec![true; rows], |sensor| sensor.usable.clone())
}
