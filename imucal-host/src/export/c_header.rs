//! A C99 header that corrects samples, with the bits of the core in `f32`.
//!
//! Convention: that of the core, [`imucal_core::corrector`]; raw and calibrated units are those of the calibration and stand
//! in the header. Constants are the shortest decimals that are the stored `f32`. The order of all operations is the core's; a
//! compiler that fuses a product and a sum into one rounding changes bits, which `-ffp-contract=off` prevents.
//!
//! `tests/export.rs` compiles the header and compares its bits with the core's.

use std::fmt::Write;

use imucal_core::nonlinearity::Linearizer;

use super::{Document, ExportError, Inputs};
use crate::{
    recording::SensorKind,
    store::{StoredCalibration, StoredTriad},
};

const TARGET: &str = "c-header";

/// Types and the correction.
const CODE: &str = include_str!("c_header.txt");

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let calibration = inputs.calibration.ok_or(ExportError::NoCalibration { target: TARGET })?;
    let mut text = String::from("#ifndef IMUCAL_CALIBRATION_H\n#define IMUCAL_CALIBRATION_H\n\n");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "/* {} */", described(calibration));
    text.push_str(CODE);
    for kind in SensorKind::ALL {
        if let Some(triad) = calibration.triad(kind) {
            of_triad(&mut text, kind, triad)?;
        }
    }
    text.push_str("\n#endif\n");
    let cannot = vec![
        "how certain the numbers are, and whose record they are: a record (`imucal calibrate --record`) has a checksum, a \
         serial and standard errors"
            .to_owned(),
    ];
    Ok(Document { text, cannot })
}

fn described(calibration: &StoredCalibration) -> String {
    let clean = |text: &str| match text {
        "" => "unknown".to_owned(),
        text => text.replace("*/", "* /").replace(['\n', '\\'], " "),
    };
    let sensor = &calibration.sensor;
    format!(
        "Sensor {}, serial {}, calibrated on {}.",
        clean(&sensor.name),
        clean(&sensor.serial),
        calibration.date
    )
}

fn of_triad(text: &mut String, kind: SensorKind, triad: &StoredTriad) -> Result<(), ExportError> {
    let (vector, matrix) = (
        |values: &[f64; 3]| list(values),
        |rows: &[[f64; 3]; 3]| format!("{{{}}}", rows.iter().map(list).collect::<Vec<_>>().join(", ")),
    );
    let zero = [0.0; 3];
    let warm = triad.temperature.as_ref();
    let curved = warm.and_then(|terms| terms.curvature.as_ref());
    let bent = triad.nonlinearity.as_ref();
    let undone = bent.map(|bent| Linearizer::new(bent.nonlinearity())).transpose().map_err(|steep| {
        ExportError::NotKnown { target: TARGET, sensor: kind, what: "correction", why: steep.to_string() }
    })?;
    let crossed = bent.is_some_and(|bent| bent.cross.as_flattened().iter().any(|entry| *entry as f32 != 0.0));
    let _ = writeln!(text, "\n/* {kind}: raw in {}, calibrated in {} */", triad.unit_in, triad.unit_out);
    let _ = writeln!(text, "static const imucal_triad imucal_{kind} IMUCAL_UNUSED = {{");
    // A bias of -0 is 0 in the core.
    let bias = triad.bias.map(|value| value + 0.0);
    let _ = writeln!(text, "    {}, /* gain, calibrated per raw unit, by rows */", matrix(&triad.gain));
    let _ = writeln!(text, "    {}, /* bias, raw unit */", vector(&bias));
    let _ = writeln!(
        text,
        "    {}, {}, {}, /* has temperature terms; reference, degC */",
        u8::from(warm.is_some()),
        u8::from(curved.is_some()),
        number(warm.map_or(0.0, |terms| terms.reference))
    );
    let lines = [
        (warm.map_or(&zero, |terms| &terms.bias_slope), "raw unit/K"),
        (warm.map_or(&zero, |terms| &terms.scale_slope), "1/K"),
        (curved.map_or(&zero, |terms| &terms.bias), "raw unit/K^2"),
        (curved.map_or(&zero, |terms| &terms.scale), "1/K^2"),
    ];
    for (values, unit) in lines {
        let _ = writeln!(text, "    {}, /* {unit} */", vector(values));
    }
    let _ = writeln!(
        text,
        "    {}, {}, {}, /* rounds of the inverse, has products of axes; range, raw unit */",
        undone.as_ref().map_or(0, Linearizer::rounds),
        u8::from(crossed),
        number(bent.map_or(0.0, |bent| bent.range))
    );
    let _ = writeln!(
        text,
        "    {}, /* quadratic, 1/raw unit */",
        vector(bent.map_or(&zero, |bent| &bent.quadratic))
    );
    let _ =
        writeln!(text, "    {}, /* cubic, 1/raw unit^2 */", vector(bent.map_or(&zero, |bent| &bent.cubic)));
    let none = [zero; 3];
    let _ = writeln!(
        text,
        "    {} /* cross, 1/raw unit: xy, yz, zx */",
        matrix(bent.map_or(&none, |bent| &bent.cross))
    );
    text.push_str("};\n");
    Ok(())
}

fn list(values: &[f64; 3]) -> String {
    format!("{{{}}}", values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
}

/// The stored `f32`, as the core has it, in digits that read back as its bits.
fn number(value: f64) -> String {
    format!("{:e}f", value as f32)
}
