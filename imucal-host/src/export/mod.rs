//! Calibration and noise in the form of other people's programs.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a calibration, a unit's noise, what a diagnosis has found | the text of a target's file, and what the target cannot say |
//!
//! One target a file; each opens with the target's own convention and where that is stated. A number stands in the text
//! with its unit and convention; the list of what the target cannot say stands in it too.

use crate::{
    recording::SensorKind,
    store::{StoredCalibration, covariance_file::CovarianceFile, noise_file::NoiseFile},
};

mod affine;
mod ardupilot;
mod c_header;
mod csv;
mod error;
mod kalibr;
mod level;
mod px4;
mod python;
mod ros;
mod sdf;

pub use error::ExportError;

/// A program that a calibration or its noise is written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Target {
    /// Kalibr's imu.yaml: noise
    Kalibr,
    /// A Gazebo sensor: noise and bias
    Sdf,
    /// A Python module that needs numpy alone: forward model and its inverse
    Python,
    /// A C99 header that corrects samples, with the bits of the core
    CHeader,
    /// ROS: imu_calib's YAML and covariances of messages
    Ros,
    /// PX4's parameters
    Px4,
    /// ArduPilot's parameters
    Ardupilot,
    /// Every number, a row each
    Csv,
}

/// What there is to write.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// The calibration.
    pub calibration: Option<&'a StoredCalibration>,
    /// The noise of the unit.
    pub noise: Option<&'a NoiseFile>,
    /// How the errors of the calibration's entries vary together.
    pub covariance: Option<&'a CovarianceFile>,
    /// Causes that a diagnosis asserts, in words, with their sizes.
    pub causes: &'a [String],
    /// Samples a second of the target, Hz; without it those of the noise's recording.
    pub rate: Option<f64>,
}

/// A target's text.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The file.
    pub text: String,
    /// What the target cannot say, a sentence each; the text has them as comments.
    pub cannot: Vec<String>,
}

/// The text for a target.
///
/// # Errors
///
/// [`ExportError`], where the target needs what is not given, or cannot say what changes every value.
pub fn document(target: Target, inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let mut document = match target {
        Target::Kalibr => kalibr::document(inputs),
        Target::Sdf => sdf::document(inputs),
        Target::Python => python::document(inputs),
        Target::CHeader => c_header::document(inputs),
        Target::Ros => ros::document(inputs),
        Target::Px4 => px4::document(inputs),
        Target::Ardupilot => ardupilot::document(inputs),
        Target::Csv => csv::document(inputs),
    }?;
    document.cannot.extend(inputs.causes.iter().map(|cause| format!("what the diagnosis found: {cause}")));
    let list = document.cannot.iter().map(|line| target.comment(line)).collect::<String>();
    if !list.is_empty() {
        document.text.push_str(&target.comment("What this file cannot say:"));
        document.text.push_str(&list);
    }
    Ok(document)
}

impl Target {
    /// Whether its file holds covariances of a calibration's entries.
    pub fn takes_covariance(self) -> bool {
        self == Self::Python
    }

    /// Whether its file holds noise.
    pub fn takes_noise(self) -> bool {
        matches!(self, Self::Kalibr | Self::Sdf | Self::Python | Self::Ros | Self::Csv)
    }

    /// Whether its file depends on how fast the target samples.
    pub fn takes_rate(self) -> bool {
        matches!(self, Self::Kalibr | Self::Sdf | Self::Ros)
    }

    /// A line of comment.
    fn comment(self, line: &str) -> String {
        match self {
            Self::CHeader => format!("/* {} */\n", line.replace("*/", "* /")),
            // Two hyphens end a comment of XML.
            Self::Sdf => format!("<!-- {} -->\n", line.replace("--", "- -")),
            _ => format!("# {line}\n"),
        }
    }
}

/// What a target without a place for a calibration's terms leaves out.
fn terms_without_a_place(inputs: &Inputs<'_>) -> Vec<String> {
    let Some(calibration) = inputs.calibration else { return Vec::new() };
    let of = |kind: SensorKind| {
        let triad = calibration.triad(kind)?;
        let mut terms = vec!["gain"];
        terms.extend(triad.temperature.is_some().then_some("temperature terms"));
        terms.extend(triad.nonlinearity.is_some().then_some("nonlinear terms"));
        Some(format!(
            "the {} of {kind}: correct or corrupt the stream by `imucal apply` or `imucal corrupt`",
            terms.join(", ")
        ))
    };
    SensorKind::ALL.into_iter().filter_map(of).collect()
}
