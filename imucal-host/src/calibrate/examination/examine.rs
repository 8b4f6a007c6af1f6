//! Whether the residuals of accepted fits are the noise.
//!
//! A residual is suspected where a [score test](crate::calibrate::fit::score_test) is hardly passed by chance ([`CHANCE`] a sensor, all
//! its tests together) and what it follows is material: an entry of the calibration would move by more than
//! [`MATERIAL`] of the standard errors that are left once it is estimated. Noise that wanders slowly passes neither for
//! long: it follows time, but moves next to nothing. A residual is suspected as well that exceeds what rests say of
//! their own noise by more than 1/f noise does between rests, and rests are that turn.
//!
//! Source: ours. Not seen: what a fit takes wholly into its parameters; of a cloud, noise that is merely larger than
//! that of its samples, as fields in buildings make it.

use std::{ops::Range, sync::OnceLock};

use imucal_core::model::{
    Parameterisation,
    norm::NormModel,
    parameterisation::{DIAGONAL, UPPER_TRIANGULAR},
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{
    cloud_score, dip_residual, motion_residual,
    norm_residual::{Shell, terms},
    pose_score,
    residual_driver::Course,
    side,
    tested::{Tested, judged},
    turning_rest::Turning,
};
use crate::{
    calibrate::{
        fit::{
            alignment::Alignment,
            gyr_rig_fit::MotionFit,
            rig_fit::RigFit,
            rows::Rows,
            score_test::{ScoreTest, upper_tail},
        },
        outcome::{Calibration, Evidence, FitSummary, SensorOutcome, entry_name},
        suspicion::{Follows, Status, Suspicion},
    },
    noise::Span,
    observe::{
        held,
        motion::MotionData,
        pose::Poses,
        quantum::ConverterSteps,
        rest_halves::{self, MeanVariance},
    },
    recording::{Recording, SensorKind, check::integrity::Integrity},
};

/// Probability that a sensor with white noise is suspected by score tests.
pub const CHANCE: f64 = 5e-4;
/// The same of a magnetometer along a reference, whose own errors wander, too, and are not known.
pub const CHANCE_ALONG_REFERENCE: f64 = 1e-9;
/// Probability that 1/f noise as strong as `SLOWER` exceeds what rests say.
pub const CHANCE_OF_EXCESS: f64 = 5e-3;
/// Standard errors by which an entry moves where it matters.
pub const MATERIAL: f64 = 2.5;
/// Variance between rests over that within them, as 1/f noise has it over a hundred rests' time: log₂ of that is 7.
pub(super) const SLOWER: f64 = 8.0;
/// How old a sample of an accelerometer may be that shows where upward is, s.
const AS_OF: f64 = 0.1;
/// Share of the rows in motion that repeat the row before, above which samples are held.
pub const HELD: f64 = 0.47;

/// Fills the suspicions of each fit that keeps its limits.
pub fn examine(
    recording: &Recording,
    integrity: &Integrity,
    steps: &ConverterSteps<'_>,
    calibration: &mut Calibration,
) {
    let rests = calibration.segmentation.as_ref().map_or_else(Vec::new, |cut| cut.rests.clone());
    let scene = Scene { recording, integrity, steps, rests: &rests, at_rest: Default::default() };
    let accelerometer_rms =
        calibration.sensor(SensorKind::Acc).and_then(SensorOutcome::passed).map(|fit| fit.rms);
    let square = matches!(
        calibration.sensor(SensorKind::Acc).and_then(|acc| acc.evidence.as_ref()),
        Some(Evidence::Shell { diagonal: true, .. })
    );
    let mut leant_on = None;
    let examined = calibration.sensors.par_iter().map(|outcome| {
        let refused = outcome.status() == Status::Refused;
        let of_fit = || scene.suspicions(outcome, accelerometer_rms);
        (!refused).then(|| rayon::join(of_fit, || scene.held(outcome.kind)))
    });
    let examined: Vec<_> = examined.collect();
    for (outcome, found) in calibration.sensors.iter_mut().zip(examined) {
        let Some((mut found, held)) = found else { continue };
        if square && matches!(outcome.evidence, Some(Evidence::Turns(_))) {
            // Six parameters were asked for, and what they leave out is left in the turns.
            calibration.warnings.extend(found.drain(..).map(|found| {
                format!(
                    "{}: {}; with six parameters the accelerometer's axes are taken as square, which turns show",
                    outcome.kind, found.detail
                )
            }));
        }
        outcome.suspicions.extend(found);
        outcome.suspicions.extend(held);
        let leans = matches!(outcome.evidence, Some(Evidence::Turns(_)))
            || outcome.fit.as_ref().is_some_and(|fit| fit.alignment.is_some());
        if let Some(detail) = leant_on.as_ref().filter(|_| leans) {
            outcome
                .suspicions
                .push(Suspicion { follows: Follows::Accelerometer, detail: String::clone(detail) });
        }
        if outcome.kind == SensorKind::Acc && outcome.status() == Status::Suspect {
            leant_on = Some("it is calibrated against the accelerometer, which is suspect".to_owned());
        }
    }
}

/// What all examinations look at.
pub(super) struct Scene<'a> {
    pub(super) recording: &'a Recording,
    integrity: &'a Integrity,
    steps: &'a ConverterSteps<'a>,
    pub(super) rests: &'a [Range<usize>],
    /// How well the means of rests are known, by sensor.
    at_rest: [OnceLock<Option<MeanVariance>>; 3],
}

impl Scene<'_> {
    pub(super) fn at_rest(&self, kind: SensorKind) -> Option<MeanVariance> {
        *self.at_rest[kind as usize].get_or_init(|| {
            let values = &self.recording.sensor(kind)?.values;
            rest_halves::mean_variance(values, self.usable(kind), self.rests, &self.steps.of(kind))
        })
    }

    fn suspicions(&self, outcome: &SensorOutcome, accelerometer_rms: Option<f64>) -> Vec<Suspicion> {
        let Some(fit) = &outcome.fit else { return Vec::new() };
        match &outcome.evidence {
            Some(Evidence::Shell { points, places, norm, diagonal, triad, std }) => {
                let upward = (outcome.kind == SensorKind::Mag).then(|| self.upward(places)).flatten();
                let warm = fit.warm_parameters();
                let shell = Shell { points, places, norm: *norm, triad, std, warm, upward };
                let mut found = if *diagonal {
                    self.of_norm(outcome.kind, &shell, DIAGONAL)
                } else {
                    self.of_norm(outcome.kind, &shell, UPPER_TRIANGULAR)
                };
                found.extend(fit.alignment.iter().flat_map(|alignment| self.of_alignment(alignment)));
                found
            }
            Some(Evidence::Turns(turns)) => self.of_turns(turns, fit, accelerometer_rms),
            Some(Evidence::Motions { data, fit: of_motions }) => self.of_motions(data, of_motions, fit),
            Some(Evidence::Gimbals(poses, of_poses)) => self.of_poses((outcome.kind, poses, of_poses), fit),
            Some(Evidence::Reference { poses, rows, fit }) => {
                pose_score::along_reference((outcome.kind, poses, fit), &self.courses(rows))
            }
            None => Vec::new(),
        }
    }

    pub(super) fn usable(&self, kind: SensorKind) -> &[bool] {
        self.integrity.sensor(kind).map_or(&[], |sensor| sensor.usable.as_slice())
    }

    /// Directions upward at some rows, in the axes of the accelerometer as it came; none where it has no sample near one.
    fn upward(&self, rows: &[usize]) -> Option<Vec<Vector3<f64>>> {
        let (values, time) = (&self.recording.acc.as_ref()?.values, &self.recording.time);
        let upward = |row: &usize| {
            let lately = |past: &usize| time[*row] - time[*past] < AS_OF;
            let measured = |past: usize| values[past].try_normalize(0.0).filter(|up| up.x.is_finite());
            (0..=*row).rev().take_while(lately).find_map(measured)
        };
        rows.iter().map(upward).collect()
    }

    /// Middle of a rest, a row.
    fn middle(&self, rest: usize) -> usize {
        self.rests.get(rest).map_or(0, |rows| rows.start.midpoint(rows.end))
    }

    pub(super) fn courses(&self, rows: &[usize]) -> Vec<Course> {
        let at = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        Course::all(at(&self.recording.time), self.recording.temperature.as_deref().map(at))
    }

    fn of_poses(&self, of: (SensorKind, &Poses, &RigFit), fit: &FitSummary) -> Vec<Suspicion> {
        let time = &self.recording.time;
        let middle = |span: &Span| time.partition_point(|t| *t < 0.5 * (span.start + span.end));
        let at: Vec<usize> = of.1.spans.iter().map(middle).collect();
        let name = |pose: usize| format!("the pose at {:.0} s", time[at[pose]]);
        let values = self.recording.sensor(of.0).map_or(&[][..], |triple| &triple.values);
        let sides = side::sides(time, values, &of.1.spans);
        pose_score::of_rig(of, &sides, fit.warm_parameters(), &self.courses(&at), &name)
    }

    fn of_motions(&self, data: &[MotionData], of: &MotionFit, fit: &FitSummary) -> Vec<Suspicion> {
        let at: Vec<usize> = data.iter().map(|motion| motion.rows.start.midpoint(motion.rows.end)).collect();
        let name = |motion: usize| format!("the motion at {:.0} s", self.recording.time[at[motion]]);
        let on_rig = self.recording.gimbal.is_some();
        motion_residual::examine((data, of), fit, &self.courses(&at), on_rig.then_some(&name))
    }

    fn of_alignment(&self, alignment: &Alignment) -> Vec<Suspicion> {
        let at: Vec<usize> = alignment.rests.iter().map(|rest| self.middle(*rest)).collect();
        let name = |rest: usize| format!("the rest at {:.0} s", self.recording.time[at[rest]]);
        dip_residual::examine(alignment, &self.courses(&at), &name)
    }

    fn of_norm<const P: usize>(
        &self,
        kind: SensorKind,
        shell: &Shell<'_>,
        form: Parameterisation<P>,
    ) -> Vec<Suspicion> {
        let (tests, further) = match kind {
            SensorKind::Mag => (cloud_score::tested(shell, form, &self.courses(shell.places)), [None, None]),
            _ => self.of_rests(shell, form).unwrap_or_default(),
        };
        let std: Vec<f64> =
            form.entries().iter().map(|entry| entry_of(&shell.std.gain, &shell.std.bias, *entry)).collect();
        judged(tests, form.entries(), &std, entry_name)
            .into_iter()
            .chain(further.into_iter().flatten())
            .collect()
    }

    /// Score tests of an accelerometer's rests, and what else speaks against them.
    fn of_rests<const P: usize>(
        &self,
        shell: &Shell<'_>,
        form: Parameterisation<P>,
    ) -> Option<(Vec<Tested>, [Option<Suspicion>; 2])> {
        let model = NormModel { points: shell.points, norm: shell.norm, form };
        let all: Vec<usize> = (0..P).collect();
        let rows = Rows::of(&model, &form.theta(shell.triad));
        let count = rows.residuals.len();
        // The residual has nothing of the terms of temperature left, and their freedom is gone.
        let independent = count.saturating_sub(shell.warm);
        let test = ScoreTest::new(&rows.residuals, rows.derivatives(count, &all), independent)?;
        let at: Vec<usize> = shell.places.iter().map(|rest| self.middle(*rest)).collect();
        let (directions, courses) = (shell.directions(shell.points), self.courses(&at));
        let mut tests: Vec<Tested> = terms(count, &courses, None, true)
            .into_par_iter()
            .filter_map(|term| {
                let columns = term.columns(0, &directions);
                let score = test.test(&columns, columns.ncols())?;
                Some(Tested::new(term.follows, term.name, score))
            })
            .collect();
        let name = |rest: usize| format!("the rest at {:.0} s", self.recording.time[at[rest]]);
        tests.extend(Tested::alone(&test, 1, 1, count, &name));
        let excess = self.excess_of_rests(shell, &directions, &rows.residuals, P + shell.warm);
        let turning =
            self.turning(shell.norm).and_then(|t| t.of_accelerometer(shell.std.gain.diagonal().min()));
        Some((tests, [excess, turning]))
    }

    fn excess_of_rests(
        &self,
        shell: &Shell<'_>,
        directions: &[Vector3<f64>],
        residuals: &[f64],
        parameters: usize,
    ) -> Option<Suspicion> {
        let at_rest = self.at_rest(SensorKind::Acc)?;
        let (variance, rests) = (at_rest.with_slower(SLOWER), at_rest.count);
        let along =
            directions.iter().map(|u| u.map(|x| x * x).dot(&variance)).sum::<f64>() / directions.len() as f64;
        let freedom = residuals.len() as f64 - parameters as f64;
        let square = residuals.iter().map(|r| r * r).sum::<f64>() / freedom;
        let chance = upper_tail(square / along, freedom, 2.0 * rests as f64)?;
        (chance < CHANCE_OF_EXCESS).then(|| Suspicion {
            follows: Follows::Excess,
            detail: format!(
                "its residual is {:.1e} m/s² ({:.2} % of g) where the rests' own noise explains {:.1e} m/s² at most",
                square.sqrt(),
                100.0 * square.sqrt() / shell.norm,
                along.sqrt()
            ),
        })
    }

    /// What the accelerometer says of rests that turn.
    pub(super) fn turning(&self, gravity: f64) -> Option<Turning> {
        let values = &self.recording.acc.as_ref()?.values;
        let differences = |values: &[Vector3<f64>], parts| {
            rest_halves::differences(values, self.usable(SensorKind::Acc), self.rests, parts)
        };
        let (halves, quarters) = (differences(values, 2), differences(values, 4));
        let total: f64 = self.rests.iter().map(|rest| self.duration(rest)).sum();
        let duration = total / self.rests.len() as f64;
        let turning = (!quarters.is_empty()).then_some(Turning { halves, quarters, duration, gravity })?;
        let Some(temperatures) = &self.recording.temperature else { return Some(turning) };
        let temperatures: Vec<Vector3<f64>> = temperatures.iter().map(|t| Vector3::x() * *t).collect();
        let of_parts = |parts| differences(&temperatures, parts).iter().map(|d| d.x).collect::<Vec<f64>>();
        Some(turning.without_temperature([&of_parts(2), &of_parts(4)]))
    }

    /// Samples that are held: a turn's rates are not those in between.
    fn held(&self, kind: SensorKind) -> Option<Suspicion> {
        let values = match kind {
            SensorKind::Acc => &self.recording.acc.as_ref()?.values,
            SensorKind::Gyr => &self.recording.gyr.as_ref()?.values,
            // Of a cloud each sample counts once.
            SensorKind::Mag => return None,
        };
        let share = held::share(values, self.usable(kind), self.rests);
        (share > HELD).then(|| Suspicion {
            follows: Follows::Clock,
            detail: format!(
                "{:.0} % of its rows in motion repeat the row before: samples are held, and noise and rates between them \
                 are not what they seem; write a row for each sample",
                100.0 * share
            ),
        })
    }

    pub(super) fn duration(&self, rows: &Range<usize>) -> f64 {
        self.recording.time[rows.end - 1] - self.recording.time[rows.start]
    }
}

pub(super) fn entry_of(gain: &Matrix3<f64>, bias: &Vector3<f64>, entry: u8) -> f64 {
    let entry = usize::from(entry);
    if entry < 9 { gain[(entry / 3, entry % 3)] } else { bias[entry - 9] }
}
