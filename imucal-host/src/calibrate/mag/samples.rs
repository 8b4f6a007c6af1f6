//! The magnetometer from a cloud of its samples: an ellipsoid that calibration maps to a sphere.

use std::ops::Range;

use imucal_core::{
    accept::{Limits, Refusal},
    model::parameterisation::UPPER_TRIANGULAR,
};
use nalgebra::{DMatrix, Matrix3};
use rayon::prelude::*;

use crate::{
    calibrate::{
        fit::{
            alignment,
            alignment::FieldAtRest,
            directions::Directions,
            least_squares::dynamic,
            norm_fit::{NormFit, NormProblem, raw_coverage},
            report::FitReport,
            rest_noise::AtRest,
            shell_errors::ShellErrors,
        },
        outcome::{Estimates, Evidence, FitSummary, Refused, SensorOutcome},
    },
    ellipsoid::{adjusted, sphere},
    observe::{
        cloud::{Cloud, cloud},
        quantum::quantum,
    },
    recording::{SensorKind, Series, Triple, Unit},
};

/// Name of the model in files: ellipsoid, nine parameters.
pub const MODEL: &str = "E9";
/// Contiguous parts that are held out in turn.
const FOLDS: usize = 5;

/// What a magnetometer is calibrated from.
#[derive(Clone, Copy, Debug)]
pub struct MagInput<'a> {
    /// The magnetometer.
    pub sensor: &'a Triple,
    /// Its samples.
    pub series: Series<'a>,
    /// Rows of the rests, where there are any.
    pub rests: &'a [Range<usize>],
    /// Length of Earth's field, µT, where it is known.
    pub field: Option<f64>,
}

impl<'a> MagInput<'a> {
    /// Samples without times and rests.
    pub fn of_cloud(sensor: &'a Triple, usable: &'a [bool], field: Option<f64>) -> Self {
        let series = Series { time: &[], values: &sensor.values, usable, interval: 1.0 };
        Self { sensor, series, rests: &[], field }
    }
}

/// Calibrates a cloud.
pub fn calibrate(input: &MagInput<'_>) -> SensorOutcome {
    let cloud = cloud(input.series.values, input.series.usable);
    match fit(&cloud, input) {
        Ok((summary, Ok(evidence))) => outcome(Ok(()), Some(summary), Some(evidence)),
        Ok((summary, Err(refusal))) => outcome(Err(refusal), Some(summary), None),
        Err(refusal) => outcome(Err(refusal), None, None),
    }
}

fn outcome(
    verdict: Result<(), Refusal>,
    fit: Option<FitSummary>,
    evidence: Option<Evidence>,
) -> SensorOutcome {
    let verdict = verdict.map_err(|refusal| Refused { advice: advice(&refusal), refusal });
    SensorOutcome { suspicions: Vec::new(), kind: SensorKind::Mag, model: MODEL, verdict, fit, evidence }
}

/// Fits from the start that ends lower: an algebraic ellipsoid can be far off on a small part of the sphere. Of very many points a
/// sample decides.
fn best_fit(problem: &NormProblem<'_, 9>) -> Option<NormFit<9>> {
    let (sample, norm) = (problem.sample(), problem.norm);
    let few = NormProblem { points: &sample, ..*problem };
    let starts = [adjusted::start, sphere::start];
    let ends = starts.par_iter().filter_map(|start| Some(few.ends(&start(&sample, norm)?)));
    let (_, lowest) = ends.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(problem.fit(&lowest))
}

type Judged = (FitSummary, Result<Evidence, Refusal>);

fn fit(cloud: &Cloud, input: &MagInput<'_>) -> Result<Judged, Refusal> {
    let (sensor, field) = (input.sensor, input.field);
    let points = cloud.points.as_slice();
    let limits = Limits::for_norm(9, 10);
    if points.len() < limits.observations {
        return Err(Refusal::TooFewObservations { have: points.len(), need: limits.observations });
    }
    // Without a known field the radius is a gauge: that of a sphere through the cloud keeps gains near one.
    let poor = |coverage: f64, flatness: f64| Refusal::PoorCoverage {
        coverage,
        flatness,
        need_coverage: limits.coverage,
        need_flatness: limits.flatness,
    };
    let flat = poor(0.0, 0.0);
    let sphere = sphere::start(points, 1.0).ok_or(flat)?;
    // A circle with a little noise has an ellipsoid as thin as the noise, seen from which it covers every direction.
    let norm = field.unwrap_or(1.0 / sphere.gain.m11);
    let problem = NormProblem { points, norm, form: UPPER_TRIANGULAR, serial: true };
    let (seen, fit) = rayon::join(|| raw_coverage(points, &sphere.bias), || best_fit(&problem));
    if seen.flatness < limits.flatness {
        return Err(poor(seen.share, seen.flatness));
    }
    let fit = fit.ok_or(flat)?;
    let at: Vec<f64> =
        cloud.rows.iter().map(|row| input.series.time.get(*row).copied().unwrap_or(*row as f64)).collect();
    let (coverage, errors) = rayon::join(
        || problem.coverage(&fit),
        || {
            let step = quantum(&sensor.values, input.series.usable);
            let at_rest = AtRest { series: input.series, rows: input.rests, step };
            ShellErrors::of_cloud(&problem, &fit, &at, &at_rest.noise_of_cloud())
        },
    );
    let (bend, verdict) = problem.judge(&fit, &coverage, &errors.stated(&problem.form, &fit), false, &limits);
    let mut summary = summarise(&problem, &fit, sensor, &errors, (coverage.share, bend));
    if field.is_none() {
        to_unit_determinant(&mut summary, norm);
    }
    let evidence = Evidence::Shell {
        norm,
        diagonal: false,
        triad: problem.form.triad(fit.solver.theta()),
        std: Box::new(problem.form.triad(&errors.covariance.diagonal().map(f64::sqrt))),
        places: fit.used.iter().map(|k| cloud.rows[*k]).collect(),
        points: fit.points,
    };
    Ok((summary, verdict.map(|()| evidence)))
}

fn summarise(
    problem: &NormProblem<'_, 9>,
    fit: &NormFit<9>,
    sensor: &Triple,
    errors: &ShellErrors<9>,
    (coverage, nonlinearity): (f64, f64),
) -> FitSummary {
    let report = FitReport {
        held_out_rms: problem.held_out_rms(fit, FOLDS),
        nonlinearity,
        inflation: errors.inflation.max(),
        ..fit.report()
    };
    let estimates = Estimates::of(&problem.form, fit.solver.theta(), &errors.covariance);
    FitSummary {
        left_out: stretches(&fit.left_out),
        ..FitSummary::new(&report, estimates, sensor, Unit::MicroTesla, coverage)
    }
}

/// Points left out, those in a row as one: a magnet near by takes hundreds.
pub(crate) fn stretches(left_out: &[(usize, f64)]) -> Vec<String> {
    left_out
        .chunk_by(|a, b| b.0 == a.0 + 1)
        .map(|stretch| {
            let (first, last) = (stretch[0].0 + 1, stretch[stretch.len() - 1].0 + 1);
            let most = stretch.iter().map(|(_, size)| *size).fold(0.0, f64::max);
            if first == last {
                format!("point {first}: {most:.1} robust standard deviations")
            } else {
                format!("points {first} to {last}: up to {most:.1} robust standard deviations")
            }
        })
        .collect()
}

/// Gauge of a magnetometer in a field of unknown length: gain of determinant 1, so that the field's length is what the
/// sensor shows. `norm` is that length in the fit's own gauge, nominal SI.
///
/// `A' = A / d`, d = det(A)^⅓; errors follow by `dA' = (dA − A · ⅓ tr(A⁻¹ dA)) / d`.
pub(crate) fn to_unit_determinant(summary: &mut FitSummary, norm: f64) {
    let gain = summary.triad.gain;
    let d = gain.determinant().cbrt();
    let Some(inverse) = gain.try_inverse() else { return };
    let entries = summary.covariance_of.clone();
    let place = |entry: u8| (usize::from(entry) / 3, usize::from(entry) % 3);
    let jacobian = DMatrix::from_fn(entries.len(), entries.len(), |row, column| {
        let same = f64::from(u8::from(row == column));
        if entries[row] > 8 || entries[column] > 8 {
            return same;
        }
        let ((i, j), (k, l)) = (place(entries[row]), place(entries[column]));
        // tr(A⁻¹ dA) of a unit entry (k, l) is that of the inverse at (l, k).
        (same - gain[(i, j)] * inverse[(l, k)] / 3.0) / d
    });
    summary.covariance = &jacobian * &summary.covariance * jacobian.transpose();
    for (k, entry) in entries.iter().enumerate() {
        let std = summary.covariance[(k, k)].max(0.0).sqrt();
        match entry {
            0..9 => summary.gain_std[place(*entry)] = std,
            _ => summary.bias_std[usize::from(*entry) - 9] = std,
        }
    }
    let per_unit = summary.nominal.per_unit.abs();
    summary.triad.gain = gain / d;
    summary.field_norm = Some(norm / d * per_unit);
    summary.unit_out = summary.unit_in;
    // Residuals are distances of raw values, which no gauge changes.
    summary.rms *= per_unit;
    summary.held_out_rms = summary.held_out_rms.map(|rms| rms * per_unit);
}

fn advice(refusal: &Refusal) -> String {
    match refusal {
        Refusal::TooFewObservations { .. } | Refusal::PoorCoverage { .. } | Refusal::NotRedundant { .. } => {
            "turn the sensor through all directions, upside down as well, slowly and away from iron"
        }
        Refusal::IllConditioned { .. } | Refusal::Imprecise { .. } | Refusal::TooNonlinear { .. } => {
            "cover the part of the sphere that is missing: its noise hides the far side's curvature"
        }
        Refusal::Implausible { .. } => "keep away from iron and currents while turning, and check the unit",
        _ => "check the recording for clipping, and for iron that moved",
    }
    .into()
}

/// Turns an accepted magnetometer alone into the accelerometer's axes, where the rests determine the rotation.
/// `at_rest` is its nominal output at rests, of which `directions` knows the specific force.
pub fn align_with(fit: &mut FitSummary, directions: &Directions, at_rest: &[FieldAtRest]) {
    let Some(alignment) = alignment::align_at_rests(directions, at_rest, &fit.triad) else { return };
    let (triad, covariance) = alignment.turn(&fit.triad, &fit.covariance, &fit.covariance_of);
    fit.triad = triad;
    fit.gain_std = Matrix3::from_fn(|i, j| covariance[(3 * i + j, 3 * i + j)].sqrt());
    fit.covariance = dynamic(&covariance);
    fit.covariance_of = (0..12).collect();
    fit.alignment = Some(alignment);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_left_out_in_a_row_are_one_stretch() {
        let words = stretches(&[(3, 8.0), (4, 9.5), (5, 7.5), (9, 7.2)]);
        assert_eq!(
            words,
            [
                "points 4 to 6: up to 9.5 robust standard deviations",
                "point 10: 7.2 robust standard deviations"
            ]
        );
    }
}
