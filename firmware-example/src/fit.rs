//! The lines of an image that calibrates: each sensor fitted to the observations of [`crate::scene`], judged, and
//! written to a record. Figures are written in bits, since host and device must print the same.

use core::fmt::{self, Write};

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{
        Model, Parameterisation,
        norm::{NormModel, curvature_excess},
        parameterisation::{DIAGONAL, FULL_GAIN, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::{Moments, ShellPoint},
    record::{self, CalibrationRecord, Date, FitQuality, RawUnit, SensorIdentity, TriadRecord},
    solver::{LevenbergMarquardt, SolveReport, lm::Settings},
    triad::Triad,
};
use nalgebra::{Matrix3, SVector, Vector3};

use crate::scene::{self, Motion, Noise, TURNS, unit};

/// Rests of the accelerometer.
const RESTS: usize = 40;
/// Rests on the six faces.
const FACES: usize = 18;
/// Samples of the magnetometer.
const CLOUD: usize = 200;
/// Local gravity, m/s².
const GRAVITY: f32 = 9.80665;
/// Magnitude of the local field, µT.
const FIELD: f32 = 48.0;
/// Half-width of the error of a rest's direction, rad.
const TILT: f32 = 1e-3;
/// An observation before there is one.
const NOWHERE: ShellPoint<f32> = ShellPoint { value: Vector3::new(0.0, 0.0, 0.0), excess: 0.0 };

/// Fits every sensor and writes the record.
///
/// # Errors
///
/// Those of `out`. A fit that is refused is a line, and not an error.
pub fn write(out: &mut impl Write) -> fmt::Result {
    let mut noise = Noise(1);
    let acc = nine_parameters(out, &mut noise)?;
    six_parameters(out, &mut noise)?;
    let gyr = turns(out, &mut noise)?;
    let mag = ellipsoid(out, &mut noise)?;
    let (sensor, date) = (SensorIdentity::default(), Date::from_days(20_000));
    write_record(out, &CalibrationRecord { sensor, date, acc, gyr, mag })
}

type Fitted = Result<Option<TriadRecord>, fmt::Error>;

#[inline(never)]
fn nine_parameters(out: &mut impl Write, noise: &mut Noise) -> Fitted {
    let sensor = scene::accelerometer();
    let mut points = [NOWHERE; RESTS];
    sensor.rests(&mut points, GRAVITY, noise);
    let task = Task {
        name: "acc T9",
        symbol: "T9",
        model: NormModel { points: &points, norm: GRAVITY, form: UPPER_TRIANGULAR },
        form: UPPER_TRIANGULAR,
        unit: RawUnit::MetrePerSecondSquared,
        limits: Limits::for_norm(9, 10),
    };
    let fit = task.fit(out, UPPER_TRIANGULAR.theta(&Triad::identity()))?;
    task.finish_norm(out, &fit, &sensor.truth)
}

#[inline(never)]
fn six_parameters(out: &mut impl Write, noise: &mut Noise) -> fmt::Result {
    let sensor = scene::square_accelerometer();
    let mut points = [NOWHERE; FACES];
    sensor.faces(&mut points, GRAVITY, noise);
    let task = Task {
        name: "acc T6",
        symbol: "T6",
        model: NormModel { points: &points, norm: GRAVITY, form: DIAGONAL },
        form: DIAGONAL,
        unit: RawUnit::MetrePerSecondSquared,
        limits: Limits::for_norm(6, 6),
    };
    let fit = task.fit(out, DIAGONAL.theta(&Triad::identity()))?;
    task.finish_norm(out, &fit, &sensor.truth)?;
    // The same rests cannot tell nine parameters.
    let verdict = accept::check_observations(&task.norm_coverage(&fit.triad), 9, &Limits::for_norm(9, 10));
    write_verdict(out, "acc T6 as T9", verdict)
}

#[inline(never)]
fn turns(out: &mut impl Write, noise: &mut Noise) -> Fitted {
    let sensor = scene::gyroscope();
    let mut motions = [Motion::default(); TURNS];
    let bias = sensor.motions(&mut motions, TILT, noise);
    let turns = motions.each_ref().map(|motion| motion.turn());
    let task = Task {
        name: "gyr",
        symbol: "K9",
        model: TurnModel { turns: &turns, form: FULL_GAIN },
        form: FULL_GAIN,
        unit: RawUnit::RadianPerSecond,
        limits: Limits::for_norm(9, 9),
    };
    let fit = task.fit(out, FULL_GAIN.theta(&Triad::identity()))?;
    // A turn and its reverse tell the same.
    let coverage = Coverage::of(turns.iter().flat_map(|turn| {
        let axis = unit(&turn.before.cross(&turn.after));
        [axis, -axis]
    }));
    let written = task.finish(out, &fit, &coverage, fit.rms, &sensor.truth)?;
    Ok(written.map(|gain| TriadRecord { bias: bias.into(), ..gain }))
}

#[inline(never)]
fn ellipsoid(out: &mut impl Write, noise: &mut Noise) -> Fitted {
    let sensor = scene::magnetometer();
    let mut points = [NOWHERE; CLOUD];
    sensor.cloud(&mut points, FIELD, noise);
    let mut middle = Moments::default();
    points.iter().for_each(|point| middle.push(&point.value));
    let start = Triad { gain: Matrix3::identity(), bias: middle.mean() };
    let rough = field(&points).fit(out, UPPER_TRIANGULAR.theta(&start))?;
    // Single samples: noise leaves them outside the shell on average.
    for point in &mut points {
        point.excess = curvature_excess(&rough.triad, FIELD, &point.value, rough.rms * rough.rms);
    }
    let task = field(&points);
    let fit = task.fit(out, *rough.solver.theta())?;
    task.finish_norm(out, &fit, &sensor.truth)
}

fn field(points: &[ShellPoint<f32>]) -> Task<NormModel<'_, f32, 9>, 9> {
    Task {
        name: "mag",
        symbol: "E9",
        model: NormModel { points, norm: FIELD, form: UPPER_TRIANGULAR },
        form: UPPER_TRIANGULAR,
        unit: RawUnit::MicroTesla,
        limits: Limits::for_norm(9, 10),
    }
}

/// What to fit, and what is asked of the answer.
struct Task<M, const P: usize> {
    name: &'static str,
    /// Of the model, in the record.
    symbol: &'static str,
    model: M,
    form: Parameterisation<P>,
    /// Of raw and calibrated values.
    unit: RawUnit,
    limits: Limits,
}

/// A fit that has ended.
struct Fit<const P: usize> {
    solver: LevenbergMarquardt<f32, P>,
    report: SolveReport<f32>,
    triad: Triad<f32>,
    /// Of the residuals, with the degrees of freedom left; NaN without any.
    rms: f32,
}

impl<M: Model<f32, P>, const P: usize> Task<M, P> {
    /// Fits in one go, and once more as a device does that has other work between iterations.
    fn fit(&self, out: &mut impl Write, start: SVector<f32, P>) -> Result<Fit<P>, fmt::Error> {
        let mut solver = LevenbergMarquardt::new(start, Settings::default());
        let report = solver.run(&self.model);
        let resumed = self.resumed(start);
        writeln!(
            out,
            "{} {} {} iterations {} evaluations {} rows {}",
            self.name,
            report.termination.name(),
            report.iterations,
            report.evaluations,
            report.independent_rows,
            if resumed == (*solver.theta(), report) { "resumed alike" } else { "resumed otherwise" },
        )?;
        write_bits(
            out,
            self.name,
            "cost, gradient, condition",
            [report.cost, report.gradient, report.condition],
        )?;
        let rms = solver.variance().map_or(f32::NAN, libm::sqrtf);
        Ok(Fit { triad: self.form.triad(solver.theta()), solver, report, rms })
    }

    /// Out of line, so that its memory is free again afterwards.
    #[inline(never)]
    fn resumed(&self, start: SVector<f32, P>) -> (SVector<f32, P>, SolveReport<f32>) {
        let mut solver = LevenbergMarquardt::new(start, Settings::default());
        while solver.step(&self.model).is_none() {}
        (*solver.theta(), solver.report())
    }

    /// Writes and judges the fit; what belongs into the record, if it may.
    fn finish(
        &self,
        out: &mut impl Write,
        fit: &Fit<P>,
        coverage: &Coverage<f32>,
        relative_rms: f32,
        truth: &Triad<f32>,
    ) -> Fitted {
        write_bits(out, self.name, "theta", fit.solver.theta().iter().copied())?;
        let Some(covariance) = fit.solver.covariance() else {
            writeln!(out, "{} singular", self.name)?;
            return Ok(None);
        };
        for column in covariance.column_iter() {
            write_bits(out, self.name, "covariance", column.iter().copied())?;
        }
        let std = covariance.diagonal().map(libm::sqrtf);
        let worst = worst_error(fit.solver.theta(), &self.form.theta(truth), &std);
        writeln!(out, "{} within {worst} standard errors of the truth", self.name)?;
        writeln!(
            out,
            "{} {} observations in {} directions",
            self.name, coverage.observations, coverage.distinct
        )?;
        let bend = accept::nonlinearity(&fit.solver, &self.model, 1.0);
        write_bits(out, self.name, "share, flatness, bend", [coverage.share, coverage.flatness, bend])?;
        let verdict = self.judge(fit, coverage, bend, relative_rms);
        write_verdict(out, self.name, verdict)?;
        Ok(verdict.is_ok().then(|| self.record(fit, coverage, &std)))
    }

    fn judge(
        &self,
        fit: &Fit<P>,
        coverage: &Coverage<f32>,
        bend: f32,
        relative_rms: f32,
    ) -> Result<(), Refusal> {
        accept::check_observations(coverage, P, &self.limits)?;
        accept::check_report(&fit.report, &self.limits)?;
        accept::check_nonlinearity(bend, &self.limits)?;
        accept::check_plausibility(&fit.triad, true, relative_rms, &self.limits)
    }

    fn record(&self, fit: &Fit<P>, coverage: &Coverage<f32>, std: &SVector<f32, P>) -> TriadRecord {
        let std = self.form.triad(std);
        TriadRecord {
            gain: rows(&fit.triad.gain),
            bias: fit.triad.bias.into(),
            unit_in: self.unit,
            unit_out: self.unit,
            model: self.symbol.parse().unwrap_or_default(),
            temperature: None,
            quality: FitQuality {
                gain_std: rows(&std.gain),
                bias_std: std.bias.into(),
                rms: fit.rms,
                held_out_rms: None,
                observations: u32::try_from(coverage.observations).unwrap_or(u32::MAX),
                parameters: u8::try_from(P).unwrap_or(u8::MAX),
                condition: fit.report.condition,
                coverage: coverage.share,
                field_norm: None,
            },
        }
    }
}

impl<const P: usize> Task<NormModel<'_, f32, P>, P> {
    /// Directions seen, as the fit sees them.
    fn norm_coverage(&self, triad: &Triad<f32>) -> Coverage<f32> {
        let values = self.model.points.iter().map(|point: &ShellPoint<f32>| point.value);
        Coverage::of(values.map(|value| unit(&triad.correct(&value))))
    }

    fn finish_norm(&self, out: &mut impl Write, fit: &Fit<P>, truth: &Triad<f32>) -> Fitted {
        let radius = self.model.norm / libm::cbrtf(fit.triad.gain.determinant());
        self.finish(out, fit, &self.norm_coverage(&fit.triad), fit.rms / radius, truth)
    }
}

/// Largest error of a parameter in standard errors, rounded up.
fn worst_error<const P: usize>(
    theta: &SVector<f32, P>,
    truth: &SVector<f32, P>,
    std: &SVector<f32, P>,
) -> u32 {
    let errors = (theta - truth).component_div(std);
    errors.iter().map(|error| libm::ceilf(libm::fabsf(*error)) as u32).max().unwrap_or(0)
}

fn rows(matrix: &Matrix3<f32>) -> [[f32; 3]; 3] {
    matrix.transpose().into()
}

fn write_bits(
    out: &mut impl Write,
    name: &str,
    what: &str,
    figures: impl IntoIterator<Item = f32>,
) -> fmt::Result {
    write!(out, "{name} {what}:")?;
    figures.into_iter().try_for_each(|figure| write!(out, " {:08x}", figure.to_bits()))?;
    writeln!(out)
}

fn write_verdict(out: &mut impl Write, name: &str, verdict: Result<(), Refusal>) -> fmt::Result {
    let word = verdict.map_or_else(|refusal| refusal.reason(), |()| "accepted");
    writeln!(out, "{name} {word}")
}

#[inline(never)]
fn write_record(out: &mut impl Write, record: &CalibrationRecord) -> fmt::Result {
    let mut page = [0xFF; record::MAX_LEN];
    let Ok(bytes) = record::encode(record, &mut page) else {
        return writeln!(out, "record not encoded");
    };
    let same = record::decode(bytes).as_ref() == Ok(record);
    write!(out, "record decoded {}:", if same { "alike" } else { "otherwise" })?;
    bytes.iter().try_for_each(|byte| write!(out, " {byte:02x}"))?;
    writeln!(out)
}
