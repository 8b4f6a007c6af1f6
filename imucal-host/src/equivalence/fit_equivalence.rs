//! How two fits of the same observations differ: the core's in `f32`, the reference's in `f64`.

use imucal_core::solver::Termination;

use crate::recording::SensorKind;

/// A parameter of the device's fit may differ by this share of its standard error.
pub const LIMIT: f64 = 0.1;
/// Or by this share of the parameter's scale, which `f32` cannot better on any sensor.
pub const FLOOR: f64 = 1e-5;

/// One parameter, fitted twice.
#[derive(Clone, Debug)]
pub struct ParameterDifference {
    /// Entry of gain or bias.
    pub name: String,
    /// The core's, in `f32`.
    pub device: f64,
    /// The reference's, in `f64`.
    pub reference: f64,
    /// The difference in units of the last place of `f32`.
    pub ulp: f64,
    /// Standard error.
    pub std: f64,
    /// Size the parameter is measured against: one for a gain, the calibrated norm for a bias.
    pub scale: f64,
}

/// One sensor's fit, made twice; parameters in nominal SI.
#[derive(Clone, Debug)]
pub struct FitEquivalence {
    /// Which sensor.
    pub kind: SensorKind,
    /// Why the device's solver stopped.
    pub termination: Termination,
    /// Parameters.
    pub parameters: Vec<ParameterDifference>,
}

impl ParameterDifference {
    fn passes(&self) -> bool {
        (self.device - self.reference).abs() <= (LIMIT * self.std).max(FLOOR * self.scale)
    }
}

impl FitEquivalence {
    /// The device's fit ends where the reference's does.
    pub fn passes(&self) -> bool {
        self.termination.was_successful() && self.parameters.iter().all(ParameterDifference::passes)
    }
}
