//! Every number of a calibration, and of its noise, a row each.
//!
//! Convention: calibrated = f ∘ gain · sense(raw − bias), as the core has it. Columns: sensor, entry, row, column, value, standard
//! error (empty where none is known), unit. Rows and columns count from 0: sensor or calibrated axis, raw axis.

use std::fmt::Write;

use super::{Document, ExportError, Inputs};
use crate::{
    recording::SensorKind,
    store::{StoredTriad, noise_file::NoiseOfAxis},
};

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let calibration = inputs.calibration.ok_or(ExportError::NoCalibration { target: "csv" })?;
    let mut text = String::from(
        "# calibrated = f * gain * sense(raw - bias); f, sense: temperature and nonlinear terms\n",
    );
    text.push_str("sensor,entry,row,column,value,std,unit\n");
    for kind in SensorKind::ALL {
        if let Some(triad) = calibration.triad(kind) {
            of_triad(&mut text, kind, triad);
        }
        let axes = inputs.noise.and_then(|noise| noise.sensor(kind)).map_or(&[][..], |sensor| &sensor.axes);
        for (row, axis) in axes.iter().enumerate() {
            axis.iter().for_each(|axis| of_noise(&mut text, kind, row, axis));
        }
    }
    let cannot =
        vec!["correlations between the errors: the JSON of `imucal calibrate` has their covariance".into()];
    Ok(Document { text, cannot })
}

fn of_triad(text: &mut String, kind: SensorKind, triad: &StoredTriad) {
    let (raw, out) = (triad.unit_in, triad.unit_out);
    matrix(text, kind, "gain", &triad.gain, &triad.gain_std, &format!("({out})/({raw})"));
    vector(text, kind, "bias", &triad.bias, Some(&triad.bias_std), &raw.to_string());
    if let Some(terms) = &triad.temperature {
        entry(text, kind, "temperature_reference", (None, None), terms.reference, None, "degC");
        let quality = terms.quality.as_ref();
        let unit = format!("({raw})/K");
        vector(
            text,
            kind,
            "bias_slope",
            &terms.bias_slope,
            quality.map(|quality| &quality.bias_slope_std),
            &unit,
        );
        vector(
            text,
            kind,
            "scale_slope",
            &terms.scale_slope,
            quality.map(|quality| &quality.scale_slope_std),
            "1/K",
        );
        if let Some(curved) = &terms.curvature {
            vector(
                text,
                kind,
                "bias_quadratic",
                &curved.bias,
                Some(&curved.bias_std),
                &format!("({raw})/K^2"),
            );
            vector(text, kind, "scale_quadratic", &curved.scale, Some(&curved.scale_std), "1/K^2");
        }
    }
    if let Some(bent) = &triad.nonlinearity {
        entry(text, kind, "range", (None, None), bent.range, None, &raw.to_string());
        vector(text, kind, "quadratic", &bent.quadratic, Some(&bent.quadratic_std), &format!("1/({raw})"));
        vector(text, kind, "cubic", &bent.cubic, Some(&bent.cubic_std), &format!("1/({raw})^2"));
        matrix(text, kind, "cross", &bent.cross, &bent.cross_std, &format!("1/({raw})"));
    }
}

fn of_noise(text: &mut String, kind: SensorKind, row: usize, axis: &NoiseOfAxis) {
    for (name, figure) in [
        ("noise_white", &axis.white),
        ("noise_bias_instability", &axis.bias_instability),
        ("noise_random_walk", &axis.random_walk),
        ("noise_quantisation", &axis.quantisation),
        ("noise_bias_std", &axis.bias_std),
        ("noise_correlation_time", &axis.correlation_time),
    ] {
        if let Some(value) = figure.value {
            // That of a value whose square has so many degrees of freedom.
            let std = figure.edf.map(|edf| value / (2.0 * edf).sqrt());
            entry(text, kind, name, (Some(row), None), value, std, &figure.unit);
        }
    }
}

fn vector(
    text: &mut String,
    kind: SensorKind,
    name: &str,
    values: &[f64; 3],
    std: Option<&[f64; 3]>,
    unit: &str,
) {
    for (row, value) in values.iter().enumerate() {
        entry(text, kind, name, (Some(row), None), *value, std.map(|std| std[row]), unit);
    }
}

fn matrix(
    text: &mut String,
    kind: SensorKind,
    name: &str,
    values: &[[f64; 3]; 3],
    std: &[[f64; 3]; 3],
    unit: &str,
) {
    for (row, column) in (0..9).map(|at| (at / 3, at % 3)) {
        entry(text, kind, name, (Some(row), Some(column)), values[row][column], Some(std[row][column]), unit);
    }
}

fn entry(
    text: &mut String,
    kind: SensorKind,
    name: &str,
    (row, column): (Option<usize>, Option<usize>),
    value: f64,
    std: Option<f64>,
    unit: &str,
) {
    let index = |at: Option<usize>| at.map_or(String::new(), |at| at.to_string());
    let std = std.map_or(String::new(), |std| format!("{std:e}"));
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{kind},{name},{},{},{value:e},{std},{unit}", index(row), index(column));
}
