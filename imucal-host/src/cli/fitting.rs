//! Which models a command fits, and what it accepts.

use clap::Args;

use crate::calibrate::request::{ModelOf, Request};

/// What is asked of a calibration.
#[derive(Args, Clone, Debug)]
pub(super) struct Fitting {
    /// Models by sensor, e.g. acc=T9,gyr=K9,mag=E9: a letter and the number of parameters. From rests: acc=T9 (gain and
    /// bias) or T6 (scale and bias, from six faces), gyr=K9 (gain), mag=E9 (ellipsoid). On a rig: acc=I14 (gain, bias and
    /// tilt of the base) or T12, I17, I20, I23; gyr=G12 (gain and bias) or G21; mag=X21 (gain, bias, hard iron on gimbals
    /// and field) or M12, M15, X18. With an optical reference: gyr=G12 or G21, mag=M15 or M12. The exit status is 0 only
    /// if every sensor named here is accepted, or suspect with --accept-suspect, and no other is suspect without that option
    #[arg(long, value_delimiter = ',')]
    model: Vec<ModelOf>,
    /// Use this multiple of the initial rest's variance for the rest test instead of trying 2 to 10
    #[arg(long, value_name = "MULTIPLE", value_parser = multiple)]
    threshold: Option<f64>,
    /// Do not estimate how bias and scale follow the temperature, where the recording has a column temp
    #[arg(long)]
    no_temperature: bool,
    /// Also write suspect sensors: their fit is within all limits, but its residual is not the noise
    #[arg(long)]
    accept_suspect: bool,
}

impl Fitting {
    /// The request; `compare` climbs the ladders.
    pub(super) fn request(&self, compare: bool) -> anyhow::Result<Request> {
        let mut request = Request::default().with_models(&self.model)?;
        request.compare = compare;
        request.threshold = self.threshold;
        request.no_temperature = self.no_temperature;
        request.accept_suspect = self.accept_suspect;
        Ok(request)
    }
}

fn multiple(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|m: &f64| m.is_finite() && *m > 0.0)
        .ok_or_else(|| "expected a number above 0".into())
}
