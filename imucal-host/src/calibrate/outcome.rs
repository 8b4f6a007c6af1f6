//! What a calibration came to: for each sensor a fit with its figures, accepted or refused with a reason.

use imucal_core::{
    accept::{self, Quantity, Refusal},
    model::{Parameterisation, rig::ReferencePose},
    observation::ShellPoint,
    solver::Termination,
    temperature::TemperatureTerms,
    triad::Triad,
};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

use super::{
    fit::{
        alignment::Alignment, compare::Comparison, gyr_rig_fit::MotionFit, least_squares::dynamic,
        report::FitReport, rig_fit::RigFit, search::Search,
    },
    nonlinear_terms::NonlinearFinding,
    suspicion::{Status, Suspicion},
    temperature::{TemperatureFinding, Terms, WarmTriad},
    thresholds::SegmentationReport,
};
use crate::{
    effect::axis_swap,
    observe::{motion::MotionData, pose::Poses, turn::TurnData},
    recording::{Nominal, SensorKind, Triple, Unit},
};

/// A recording's calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// File name of the recording.
    pub recording: String,
    /// Sensor's name, empty where the recording has none.
    pub sensor_name: String,
    /// Sensor's serial number, empty where the recording has none.
    pub serial: String,
    /// One outcome a sensor present, accelerometer first.
    pub sensors: Vec<SensorOutcome>,
    /// How the recording was cut into rests; `None` without an accelerometer.
    pub segmentation: Option<SegmentationReport>,
    /// The ladders, where they were climbed.
    pub comparisons: Vec<Comparison>,
    /// What else the user should know.
    pub warnings: Vec<String>,
    /// What was noticed when the recording was read.
    pub read_warnings: Vec<String>,
}

/// One sensor's outcome.
#[derive(Clone, Debug)]
pub struct SensorOutcome {
    /// Which sensor.
    pub kind: SensorKind,
    /// Model's name: T9, T6, K9, G12, E9.
    pub model: &'static str,
    /// Whether the fit keeps its limits, or the reason why not. See [`Self::status`].
    pub verdict: Result<(), Refused>,
    /// What speaks against a fit that keeps its limits: its residual is not the noise.
    pub suspicions: Vec<Suspicion>,
    /// The fit, where there was enough to try one; of a refused sensor it is for information only.
    pub fit: Option<FitSummary>,
    /// What the fit was made of.
    pub evidence: Option<Evidence>,
}

/// The observations a fit was made of, for whoever wants to make it again.
#[derive(Clone, Debug)]
pub enum Evidence {
    /// Points of a norm fit.
    Shell {
        /// Points used, nominal SI.
        points: Vec<ShellPoint<f64>>,
        /// Each point's rest, among the segmentation's, or row of a cloud.
        places: Vec<usize>,
        /// Radius of the calibrated sphere.
        norm: f64,
        /// Only the gain's diagonal was estimated.
        diagonal: bool,
        /// Where the fit ended, before any change of gauge.
        triad: Triad<f64>,
        /// Standard errors of its entries.
        std: Box<Triad<f64>>,
    },
    /// Turns of a gyroscope.
    Turns(Vec<KnownTurn>),
    /// Motions of a gyroscope between known attitudes.
    Motions {
        /// Motions used.
        data: Vec<MotionData>,
        /// The fit, its covariance over all entries.
        fit: Box<MotionFit>,
    },
    /// Poses on a rig and their fit.
    Gimbals(Poses, Box<RigFit>),
    /// Samples along a reference.
    Reference {
        /// Samples used.
        poses: Vec<ReferencePose<f64>>,
        /// The row of each.
        rows: Vec<usize>,
        /// Their fit.
        fit: Box<RigFit>,
    },
}

/// A turn and the directions at its ends, calibrated axes.
#[derive(Clone, Debug)]
pub struct KnownTurn {
    /// The turn.
    pub data: TurnData,
    /// Direction of the specific force before it.
    pub before: Vector3<f64>,
    /// And after it.
    pub after: Vector3<f64>,
    /// What its rates were multiplied by, to be those of the reference temperature; the identity without terms.
    pub stretch: Matrix3<f64>,
}

/// A refusal and what to do about it.
#[derive(Clone, Debug)]
pub struct Refused {
    /// The reason with its figures.
    pub refusal: Refusal,
    /// What to do.
    pub advice: String,
}

/// A fit's figures. Input is in nominal SI; see [`FitSummary::raw_triad`] for the file's own unit.
#[derive(Clone, Debug)]
pub struct FitSummary {
    /// The calibration, nominal SI in.
    pub triad: Triad<f64>,
    /// Standard errors of the gain's entries, zero where an entry is not estimated.
    pub gain_std: Matrix3<f64>,
    /// Standard errors of the bias, nominal SI.
    pub bias_std: Vector3<f64>,
    /// Covariance of the estimated entries, nominal SI, in the order of `covariance_of`.
    pub covariance: DMatrix<f64>,
    /// Entries (gain by rows 0 to 8, bias 9 to 11) that are estimated.
    pub covariance_of: Vec<u8>,
    /// Unit of the recording and the raw input.
    pub unit_in: Unit,
    /// Unit of the calibrated output.
    pub unit_out: Unit,
    /// From the recording's unit to nominal SI.
    pub nominal: Nominal,
    /// Rms residual, calibrated unit (rad a turn for the gyroscope).
    pub rms: f64,
    /// The same for observations left out of the fit in turn.
    pub held_out_rms: Option<f64>,
    /// Observations used.
    pub observations: usize,
    /// Parameters estimated.
    pub parameters: usize,
    /// Condition of the Jacobian with columns at unit length.
    pub condition: f64,
    /// Share of the sphere of directions within reach of an observation.
    pub coverage: f64,
    /// Departure from a parabola within one standard error.
    pub nonlinearity: f64,
    /// Largest factor on a standard error for residuals alike in time; 1 where none was needed.
    pub inflation: f64,
    /// Solver steps.
    pub iterations: u16,
    /// Why the solver stopped.
    pub termination: Termination,
    /// Length of the calibrated field where it was not known beforehand, `unit_in`.
    pub field_norm: Option<f64>,
    /// Observations left out as gross outliers, in words.
    pub left_out: Vec<String>,
    /// Largest relative move of a diagonal gain over the thresholds of the rest test.
    pub gain_spread: Option<f64>,
    /// How the gyroscope's bias moved between rests.
    pub bias_wander: Option<BiasWander>,
    /// What belongs to the rig and not to the sensor, where there was one.
    pub rig: Option<RigFindings>,
    /// Rotation of a magnetometer into the accelerometer's axes, where the rests determine it.
    pub alignment: Option<Alignment>,
    /// How a gyroscope's fit was reached.
    pub search: Option<Search>,
    /// How bias and scale follow the temperature; `None` where the recording has none, or it was not asked for.
    pub temperature: Option<TemperatureFinding>,
    /// Quadratic, cubic and cross terms, where the model has them.
    pub nonlinear: Option<NonlinearFinding>,
}

/// What a fit on a rig found of the machine: reported, and never stored in a sensor's record.
#[derive(Clone, Debug, Default)]
pub struct RigFindings {
    /// Levelling tilt α, β of the base and their standard errors, rad; `None` where it was not estimated.
    pub tilt: Option<([f64; 2], [f64; 2])>,
    /// Hard iron on the outer and the middle gimbal, µT, with standard errors; zero where held.
    pub sources: Option<[(Vector3<f64>, Vector3<f64>); 2]>,
    /// Earth's field in n, µT, where it was estimated.
    pub field_n: Option<Vector3<f64>>,
    /// Parameters that the poses cannot determine, and what each is like.
    pub unobservable: Vec<String>,
    /// How a fit against attitudes was made, in words.
    pub notes: Vec<String>,
    /// The gyroscope's g-sensitivity, table axes in, raw rad/s per m/s², with standard errors, where it was estimated.
    pub g_sensitivity: Option<(Matrix3<f64>, Matrix3<f64>)>,
}

/// How a bias moved from rest to rest.
#[derive(Clone, Copy, Debug)]
pub struct BiasWander {
    /// Standard deviation of the rests' means, rad/s.
    pub spread: Vector3<f64>,
    /// The same if only white noise moved them, rad/s.
    pub expected: Vector3<f64>,
    /// It wandered, so the bias was interpolated between neighbouring rests.
    pub interpolated: bool,
}

/// What a fit estimates of a triad, nominal SI in, with its errors.
#[derive(Clone, Debug)]
pub struct Estimates {
    /// Gain and bias.
    pub triad: Triad<f64>,
    /// Their standard errors, zero where an entry is not estimated.
    pub std: Triad<f64>,
    /// Covariance of the estimated entries.
    pub covariance: DMatrix<f64>,
    /// Which entries these are.
    pub covariance_of: Vec<u8>,
}

impl Estimates {
    /// Of parameters and their covariance.
    pub fn of<const P: usize>(
        form: &Parameterisation<P>,
        theta: &SVector<f64, P>,
        covariance: &SMatrix<f64, P, P>,
    ) -> Self {
        Self {
            triad: form.triad(theta),
            std: form.triad(&covariance.diagonal().map(f64::sqrt)),
            covariance: dynamic(covariance),
            covariance_of: form.entries().to_vec(),
        }
    }
}

impl FitSummary {
    /// A fit's figures and estimates; nothing left out, and nothing in addition to the triad.
    pub fn new(
        report: &FitReport,
        estimates: Estimates,
        sensor: &Triple,
        unit_out: Unit,
        coverage: f64,
    ) -> Self {
        Self {
            triad: estimates.triad,
            gain_std: estimates.std.gain,
            bias_std: estimates.std.bias,
            covariance: estimates.covariance,
            covariance_of: estimates.covariance_of,
            unit_in: sensor.unit,
            unit_out,
            nominal: sensor.nominal,
            rms: report.rms,
            held_out_rms: report.held_out_rms,
            observations: report.observations,
            parameters: report.parameters,
            condition: report.solver.condition,
            coverage,
            nonlinearity: report.nonlinearity,
            inflation: report.inflation,
            iterations: report.solver.iterations,
            termination: report.solver.termination,
            field_norm: None,
            left_out: Vec::new(),
            gain_spread: None,
            bias_wander: None,
            rig: None,
            alignment: None,
            search: None,
            temperature: None,
            nonlinear: None,
        }
    }

    /// Terms of temperature and their standard errors, nominal SI, where some are kept.
    pub fn terms(&self) -> Option<(Terms, Terms)> {
        self.temperature.as_ref()?.terms
    }

    /// The triad with its terms of temperature, nominal SI.
    pub fn warm(&self) -> WarmTriad {
        WarmTriad { triad: self.triad, terms: self.terms().map(|(terms, _)| terms) }
    }

    /// Parameters of temperature that were estimated with the others.
    pub fn warm_parameters(&self) -> usize {
        let parts = self.temperature.iter().flat_map(|finding| &finding.parts);
        3 * parts.flat_map(|part| &part.tried).filter(|tried| tried.kept).count()
    }

    /// Terms of temperature of raw values in the recording's own unit, and their standard errors.
    pub fn raw_terms(&self) -> Option<(Terms, Terms)> {
        let per = self.nominal.per_unit;
        let scaled = |terms: Terms, per: f64| Terms {
            linear: TemperatureTerms {
                bias_slope: terms.linear.bias_slope.map(|slope| slope * per),
                ..terms.linear
            },
            bias_quadratic: terms.bias_quadratic * per,
            ..terms
        };
        self.terms().map(|(terms, std)| (scaled(terms, per), scaled(std, per.abs())))
    }

    /// Nonlinear terms of raw values in the recording's own unit, and their standard errors.
    pub fn raw_nonlinear(&self) -> Option<NonlinearFinding> {
        self.nonlinear.as_ref().map(|found| found.in_unit(self.nominal.per_unit))
    }

    /// The calibration of raw values in the recording's own unit.
    pub fn raw_triad(&self) -> Triad<f64> {
        if self.in_raw_scale() {
            Triad { gain: self.triad.gain, bias: self.raw_bias() }
        } else {
            self.triad.in_unit(self.nominal.offset, self.nominal.per_unit)
        }
    }

    /// Unit of `rms` and `held_out_rms`, but of a gyroscope.
    pub fn rms_unit(&self) -> Unit {
        Unit::of_residuals(self.unit_in, self.unit_out)
    }

    /// Standard errors of [`raw_triad`](Self::raw_triad): gain, bias.
    pub fn raw_std(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let per = self.nominal.per_unit.abs();
        let gain = if self.in_raw_scale() { self.gain_std } else { self.gain_std / per };
        (gain, self.bias_std * per)
    }

    /// Covariance of the estimated entries of [`raw_triad`](Self::raw_triad), as `covariance`.
    pub fn raw_covariance(&self) -> DMatrix<f64> {
        let per = self.nominal.per_unit;
        let factor = |entry: u8| match entry {
            0..9 if self.in_raw_scale() => 1.0,
            0..9 => 1.0 / per,
            _ => per,
        };
        let scale: Vec<f64> = self.covariance_of.iter().map(|entry| factor(*entry)).collect();
        DMatrix::from_fn(scale.len(), scale.len(), |i, j| self.covariance[(i, j)] * scale[i] * scale[j])
    }

    /// Expected error of a calibrated vector of this length, calibrated unit, as a share of it; see
    /// [`relative_error`](accept::relative_error).
    pub fn relative_error(&self, norm: f64) -> f64 {
        let std = Triad { gain: self.gain_std, bias: self.bias_std };
        let size = (self.triad.gain.norm_squared() / 3.0).sqrt();
        accept::relative_error(&self.triad.gain, &std, norm / size)
    }

    /// A magnetometer without a known field keeps the recording's unit: its gain has determinant 1.
    fn in_raw_scale(&self) -> bool {
        self.field_norm.is_some()
    }

    fn raw_bias(&self) -> Vector3<f64> {
        self.triad.bias.map(|b| self.nominal.to_raw(b))
    }
}

impl Calibration {
    /// The outcome of one sensor.
    pub fn sensor(&self, kind: SensorKind) -> Option<&SensorOutcome> {
        self.sensors.iter().find(|outcome| outcome.kind == kind)
    }
}

impl SensorOutcome {
    /// Accepted, suspect or refused.
    pub fn status(&self) -> Status {
        match &self.verdict {
            Err(_) => Status::Refused,
            Ok(()) if self.suspicions.is_empty() => Status::Accepted,
            Ok(()) => Status::Suspect,
        }
    }

    /// Why the sensor was refused, with the figures that led to it.
    pub fn detail(&self) -> Option<String> {
        let refused = self.verdict.as_ref().err()?;
        Some(match refused.refusal {
            Refusal::Implausible { what: Quantity::Axes, value, .. } if value > 0.0 => {
                let columns = axis_swap::columns(self.kind, value as usize);
                format!("{}.axis_swap, code {value:.0}, would explain the recording: {columns}", self.kind)
            }
            Refusal::Implausible { what: Quantity::Axes, .. } => {
                "it is calibrated against another sensor whose axes are negated or in another order".into()
            }
            refusal => refusal.to_string(),
        })
    }

    /// The fit of an accepted sensor.
    pub fn accepted(&self) -> Option<&FitSummary> {
        (self.status() == Status::Accepted).then_some(self.fit.as_ref()).flatten()
    }

    /// The fit of an accepted or suspect sensor.
    pub fn passed(&self) -> Option<&FitSummary> {
        (self.status() != Status::Refused).then_some(self.fit.as_ref()).flatten()
    }
}

/// Name of a triad's entry: `gain_xy`, `bias_z`.
pub fn entry_name(entry: u8) -> String {
    let axis = |k: u8| ["x", "y", "z"][usize::from(k % 3)];
    if entry < 9 {
        format!("gain_{}{}", axis(entry / 3), axis(entry))
    } else {
        format!("bias_{}", axis(entry))
    }
}
