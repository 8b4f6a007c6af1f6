//! The calibration as JSON, by the contract `imucal-calibration/1`.

use nalgebra::{DMatrix, Matrix3, Vector3};
use serde_json::{Value, json};

use crate::{
    calibrate::{
        Calibration, FitSummary, SegmentationReport, SensorOutcome,
        fit::{alignment::Alignment, compare::Comparison, search::Search},
        nonlinear_terms::NonlinearFinding,
        outcome::entry_name,
        temperature::{TemperatureFinding, Terms, finding::Part},
    },
    recording::SensorKind,
    store::FORMAT,
};

/// The whole document.
pub fn calibration(calibration: &Calibration) -> Value {
    let sensors: serde_json::Map<String, Value> = calibration
        .sensors
        .iter()
        .map(|outcome| (outcome.kind.prefix().to_owned(), sensor(outcome)))
        .collect();
    json!({
        "format": FORMAT,
        "recording": calibration.recording,
        "sensor": {"name": calibration.sensor_name, "serial": calibration.serial},
        "sensors": sensors,
        "segmentation": calibration.segmentation.as_ref().map(segmentation),
        "compare": calibration.comparisons.iter().map(comparison).collect::<Vec<_>>(),
        "warnings": calibration.read_warnings.iter().chain(&calibration.warnings).collect::<Vec<_>>(),
    })
}

/// The document's text, as `imucal calibrate --json` writes it.
pub fn text(found: &Calibration) -> String {
    // `Value` shows itself as JSON, indented by `#`; nothing of it cannot be written.
    format!("{:#}\n", calibration(found))
}

fn rows(m: &Matrix3<f64>) -> Value {
    json!((0..3).map(|i| [m[(i, 0)], m[(i, 1)], m[(i, 2)]]).collect::<Vec<_>>())
}

fn covariance_rows(m: &DMatrix<f64>) -> Value {
    json!(m.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>())
}

fn vector(v: &Vector3<f64>) -> Value {
    json!([v.x, v.y, v.z])
}

fn sensor(outcome: &SensorOutcome) -> Value {
    let mut value = match &outcome.fit {
        Some(fit) => fit_value(outcome.kind, fit),
        None => json!({}),
    };
    let (reason, detail, advice) = match &outcome.verdict {
        Ok(()) => (None, None, None),
        Err(refused) => (Some(refused.refusal.reason()), outcome.detail(), Some(refused.advice.as_str())),
    };
    if let Some(fields) = value.as_object_mut() {
        let follows: Vec<&str> = outcome.suspicions.iter().map(|found| found.follows.name()).collect();
        let suspicions: Vec<&str> = outcome.suspicions.iter().map(|found| found.detail.as_str()).collect();
        fields.insert("status".into(), json!(outcome.status().name()));
        fields.insert("follows".into(), json!(follows));
        fields.insert("suspicions".into(), json!(suspicions));
        fields.insert("reason".into(), json!(reason));
        fields.insert("detail".into(), json!(detail));
        fields.insert("advice".into(), json!(advice));
        fields.insert("model".into(), json!(outcome.model));
    }
    value
}

fn fit_value(kind: SensorKind, fit: &FitSummary) -> Value {
    let triad = fit.raw_triad();
    let (gain_std, bias_std) = fit.raw_std();
    let rms_unit = match kind {
        SensorKind::Gyr => "rad".into(),
        _ => fit.rms_unit().to_string(),
    };
    let rig = rig(kind, fit);
    json!({
        "gain": rows(&triad.gain),
        "bias": vector(&triad.bias),
        "gain_std": rows(&gain_std),
        "bias_std": vector(&bias_std),
        "covariance": covariance_rows(&fit.raw_covariance()),
        "covariance_of": fit.covariance_of.iter().map(|entry| entry_name(*entry)).collect::<Vec<_>>(),
        "unit_in": fit.unit_in.to_string(),
        "unit_out": fit.unit_out.to_string(),
        "observations": fit.observations,
        "parameters": fit.parameters,
        "rms": fit.rms,
        "held_out_rms": fit.held_out_rms,
        "rms_unit": rms_unit,
        "condition": fit.condition,
        "coverage": fit.coverage,
        "nonlinearity": fit.nonlinearity,
        "std_inflation": fit.inflation,
        "iterations": fit.iterations,
        "termination": fit.termination.name(),
        "field_norm": fit.field_norm,
        "left_out": fit.left_out,
        "gain_spread_over_thresholds": fit.gain_spread,
        "bias_interpolated": fit.bias_wander.map(|w| w.interpolated),
        "alignment": fit.alignment.as_ref().map(alignment),
        "search": fit.search.as_ref().map(search),
        "temperature": fit.temperature.as_ref().map(|found| temperature(found, fit.raw_terms())),
        "nonlinear": fit.raw_nonlinear().as_ref().map(nonlinear),
        "rig": rig,
    })
}

/// The magnetometer's rotation into the accelerometer's axes.
fn alignment(found: &Alignment) -> Value {
    json!({
        "rotation_vector": vector(&found.phi),
        "rotation_std": vector(&found.axes.covariance.diagonal().map(f64::sqrt)),
        "dip": found.dip.0,
        "dip_std": found.dip.1,
        "dip_rms": found.rms,
        "dip_held_out_rms": found.held_out_rms,
        "rests": found.rests.len(),
        "unit": "rad",
    })
}

/// How bias and scale follow the temperature; `terms` are those of raw values, with their standard errors.
fn temperature(found: &TemperatureFinding, terms: Option<(Terms, Terms)>) -> Value {
    let parts: Vec<Value> = found.parts.iter().map(part).collect();
    json!({
        "status": found.status(),
        "reason": found.refusal.map(|refusal| refusal.reason()),
        "detail": found.refusal.map(|refusal| refusal.to_string()),
        "advice": found.refusal.map(|refusal| refusal.advice()),
        "span": [finite(found.span.0), finite(found.span.1)],
        "reference": finite(found.reference),
        "bias_slope": terms.map(|(value, _)| value.linear.bias_slope),
        "bias_slope_std": terms.map(|(_, std)| std.linear.bias_slope),
        "scale_slope": terms.map(|(value, _)| value.linear.scale_slope),
        "scale_slope_std": terms.map(|(_, std)| std.linear.scale_slope),
        "bias_quadratic": terms.map(|(value, _)| vector(&value.bias_quadratic)),
        "bias_quadratic_std": terms.map(|(_, std)| vector(&std.bias_quadratic)),
        "scale_quadratic": terms.map(|(value, _)| vector(&value.scale_quadratic)),
        "scale_quadratic_std": terms.map(|(_, std)| vector(&std.scale_quadratic)),
        "tried_on": parts,
    })
}

/// Terms tried on one kind of observation.
fn part(part: &Part) -> Value {
    let groups: Vec<Value> = part
        .tried
        .iter()
        .map(|tried| {
            json!({
                "group": tried.group.name(),
                "p_value": tried.chance,
                "held_out_rms": tried.held_out,
                "kept": tried.kept,
            })
        })
        .collect();
    json!({
        "observations": part.of,
        "unit": part.unit,
        "groups": groups,
        "held_out_rms_without": part.held_out.0,
        "held_out_rms": part.held_out.1,
    })
}

/// A number; null where it is none.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// How a gyroscope's fit was reached.
fn search(found: &Search) -> Value {
    let swarm = found.swarm.map(|swarm| {
        json!({
            "termination": swarm.termination.name(),
            "converged": swarm.termination.was_successful(),
            "iterations": swarm.iterations,
            "evaluations": swarm.evaluations,
            "spread": swarm.spread,
            "parameters_at_bound": swarm.at_bound,
            "rms": swarm.rms,
            "kept": swarm.kept,
        })
    });
    json!({
        "direct": {"termination": found.direct.0.name(), "rms": found.direct.1},
        "swarm": swarm,
        "note": found.note(),
    })
}

/// What belongs to the machine; null where it was not estimated.
fn rig(kind: SensorKind, fit: &FitSummary) -> Value {
    let found = fit.rig.as_ref();
    let unobservable = found.map(|rig| &rig.unobservable);
    match kind {
        SensorKind::Acc => {
            let tilt = found.and_then(|rig| rig.tilt);
            json!({
                "tilt_x": tilt.map(|(tilt, _)| tilt[0]),
                "tilt_y": tilt.map(|(tilt, _)| tilt[1]),
                "tilt_std": tilt.map(|(_, std)| std),
                "not_told": unobservable,
                "higher_order": fit.nonlinear.as_ref().map(higher_order),
            })
        }
        SensorKind::Gyr => found.map_or(Value::Null, |rig| {
            let sensitivity = rig.g_sensitivity.as_ref();
            json!({
                "notes": rig.notes,
                "g_sensitivity": sensitivity.map(|(value, _)| rows(value)),
                "g_sensitivity_std": sensitivity.map(|(_, std)| rows(std)),
            })
        }),
        SensorKind::Mag => {
            let sources = found.and_then(|rig| rig.sources);
            json!({
                "outer_hard_iron": sources.map(|[outer, _]| vector(&outer.0)),
                "outer_hard_iron_std": sources.map(|[outer, _]| vector(&outer.1)),
                "middle_hard_iron": sources.map(|[_, middle]| vector(&middle.0)),
                "middle_hard_iron_std": sources.map(|[_, middle]| vector(&middle.1)),
                "field_n": found.and_then(|rig| rig.field_n).as_ref().map(vector),
                "not_told": unobservable,
                "notes": found.map(|rig| &rig.notes),
            })
        }
    }
}

/// Nonlinear terms in nominal SI by kind, and what a reader of gain and bias alone leaves of them, calibrated unit.
fn higher_order(found: &NonlinearFinding) -> Value {
    let terms: serde_json::Map<String, Value> = found
        .by_kind()
        .map(|(name, value, std)| (name.to_owned(), json!({"value": vector(&value), "std": vector(&std)})))
        .collect();
    json!({"terms": terms, "stored": true, "uncorrected": found.largest})
}

/// Quadratic, cubic and cross terms of raw values, as TOML and record have them.
fn nonlinear(found: &NonlinearFinding) -> Value {
    let (terms, std) = (&found.terms, &found.std);
    json!({
        "range": found.range,
        "quadratic": terms.quadratic,
        "cubic": terms.cubic,
        "cross": terms.cross,
        "quadratic_std": std.quadratic,
        "cubic_std": std.cubic,
        "cross_std": std.cross,
        "largest": found.largest,
    })
}

fn comparison(comparison: &Comparison) -> Value {
    let rungs: Vec<Value> = comparison
        .rungs
        .iter()
        .map(|(step, p_value)| {
            json!({
                "model": step.name,
                "adds": step.adds,
                "parameters": step.free,
                "rms": step.rms,
                "held_out_rms": step.held_out_rms,
                "second_half_rms": step.second_half_rms,
                "p_value": p_value,
            })
        })
        .collect();
    json!({"sensor": comparison.kind.prefix(), "rungs": rungs, "use": comparison.chosen, "why": comparison.why})
}

fn segmentation(segmentation: &SegmentationReport) -> Value {
    let trials: Vec<Value> = segmentation
        .trials
        .iter()
        .map(|trial| {
            json!({
                "multiplier": trial.multiplier,
                "rests": trial.rests,
                "acc_gain": trial.acc_gain.as_ref().map(vector),
                "acc_rms": trial.acc_rms,
                "gyr_gain": trial.gyr_gain.as_ref().map(vector),
            })
        })
        .collect();
    json!({
        "rests": segmentation.rests.len(),
        "intervals": segmentation.rests.iter().map(|r| [r.start, r.end]).collect::<Vec<_>>(),
        "multiplier": segmentation.multiplier,
        "threshold": segmentation.threshold,
        "from_initial_rest": segmentation.from_initial_rest,
        "gain_spread_over_thresholds": segmentation.gain_spread,
        "thresholds": trials,
    })
}
