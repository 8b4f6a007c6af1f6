//! What was found of a sensor's temperature, for reports and for the record.

use super::{ladder::Climbed, ladder::Tried, refusal::TemperatureRefusal, terms::Terms};

/// Of one sensor.
#[derive(Clone, Debug)]
pub struct TemperatureFinding {
    /// Lowest and highest temperature of the observations, °C; NaN without any.
    pub span: (f64, f64),
    /// Their mean, to which gain and bias refer where terms are kept, °C.
    pub reference: f64,
    /// Why none are estimated.
    pub refusal: Option<TemperatureRefusal>,
    /// What the terms were tried on.
    pub parts: Vec<Part>,
    /// Terms kept, nominal SI, and their standard errors.
    pub terms: Option<(Terms, Terms)>,
}

/// Terms tried on one kind of observation.
#[derive(Clone, Debug)]
pub struct Part {
    /// What the observations are: rests, turns, poses, motions.
    pub of: &'static str,
    /// Unit of its residuals.
    pub unit: &'static str,
    /// Groups tried, in order.
    pub tried: Vec<Tried>,
    /// Rms residual at temperatures held out, without terms and with those kept.
    pub held_out: (Option<f64>, Option<f64>),
}

impl Part {
    /// Of a ladder.
    pub fn of(climbed: &Climbed, of: &'static str, unit: &'static str) -> Self {
        Self { of, unit, tried: climbed.tried.clone(), held_out: climbed.held_out }
    }
}

impl TemperatureFinding {
    /// Of observations at these temperatures, nothing estimated yet.
    pub fn new(temperatures: &[f64]) -> Self {
        let measured: Vec<f64> = temperatures.iter().copied().filter(|t| t.is_finite()).collect();
        let span = match measured.is_empty() {
            true => (f64::NAN, f64::NAN),
            false => imucal_core::temperature::course::span(&measured),
        };
        let reference = measured.iter().sum::<f64>() / measured.len() as f64;
        Self { span, reference, refusal: None, parts: Vec::new(), terms: None }
    }

    /// Takes terms of the scale, and their standard errors, next to those of the bias.
    pub fn add_scale(&mut self, terms: Terms, std: Terms) {
        let none = Terms::none(self.reference);
        let (of_bias, std_of_bias) = self.terms.unwrap_or((none, none));
        self.terms = Some((of_bias.with_scale_of(&terms), std_of_bias.with_scale_of(&std)));
    }

    /// `kept`, `not-borne-out` or `refused`.
    pub fn status(&self) -> &'static str {
        match (&self.refusal, &self.terms) {
            (Some(_), _) => "refused",
            (None, Some(_)) => "kept",
            (None, None) => "not-borne-out",
        }
    }

    /// Refused.
    #[must_use]
    pub fn refused(self, refusal: TemperatureRefusal) -> Self {
        Self { refusal: Some(refusal), ..self }
    }
}
