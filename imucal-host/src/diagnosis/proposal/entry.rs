//! A formula as effects of a user's file, with the values that were fitted.

use std::{fmt::Write, path::Path};

use super::term::Formulated;
use crate::{
    effect::{Act, Effect, XYZ, user},
    recording::SensorKind,
    simulator::Dose,
};

/// Endings of the ids of a formula of two terms.
const TERMS: [&str; 2] = ["_cos", "_sin"];
/// A proposal's amplitude matters from this share of its fitted size on.
const MATERIAL: f64 = 0.2;

/// The text of the file: an effect a term. `amounts` are the amplitudes with their standard errors, term by term, axis by
/// axis, of the given axes; `origin` is the recording.
pub fn toml(
    kind: SensorKind,
    formula: &Formulated,
    axes: &[usize],
    amounts: &[(f64, f64)],
    origin: &str,
) -> String {
    let mut text = String::new();
    for (term, amounts) in amounts.chunks(axes.len()).enumerate() {
        // Writing to a string cannot fail.
        let _ = write_entry(&mut text, kind, formula, term, axes, amounts, origin);
    }
    text
}

fn write_entry(
    text: &mut String,
    kind: SensorKind,
    formula: &Formulated,
    term: usize,
    axes: &[usize],
    amounts: &[(f64, f64)],
    origin: &str,
) -> std::fmt::Result {
    let ending = if formula.terms.len() > 1 { TERMS[term] } else { "" };
    let quoted =
        |list: &[String]| list.iter().map(|text| format!("\"{text}\"")).collect::<Vec<_>>().join(", ");
    let names: Vec<String> = axes.iter().map(|axis| XYZ[*axis].to_owned()).collect();
    let texts = formula.texts(term, axes);
    let size = amounts.iter().fold(1e-29f64, |most, (value, _)| most.max(value.abs()));
    writeln!(text, "[[effect]]")?;
    writeln!(text, "id = \"{kind}.proposed_{}{ending}\"", formula.name)?;
    writeln!(text, "sensor = \"{kind}\"")?;
    writeln!(text, "axes = [{}]", quoted(&names))?;
    match &texts[..] {
        [one] => writeln!(text, "formula = \"{one}\"")?,
        each => writeln!(text, "formula = [{}]", quoted(each))?,
    }
    writeln!(text, "unit = \"{}\"", formula.amplitude_unit(kind))?;
    writeln!(text, "amplitude = {{ typical = {size:.3e}, material = {:.3e} }}", MATERIAL * size)?;
    if let Some(shape) = &formula.shape {
        let (low, high) = shape.range;
        let unit = if shape.unit.is_empty() { "-" } else { &shape.unit };
        writeln!(
            text,
            "shape = {{ {} = {{ typical = {:e}, low = {low:e}, high = {high:e}, unit = \"{unit}\" }} }}",
            shape.name, shape.value
        )?;
    }
    let fitted = |(name, value, error): (&str, f64, f64)| {
        format!("{name} = {{ value = {value:e}, std_error = {error:e} }}")
    };
    let amplitudes = axes.iter().zip(amounts).map(|(axis, (value, error))| (XYZ[*axis], *value, *error));
    let shape = formula.shape.iter().map(|s| (&*s.name, s.value, s.std_error.unwrap_or(0.0)));
    let all: Vec<String> = amplitudes.chain(shape).map(fitted).collect();
    writeln!(text, "fitted = {{ {} }}", all.join(", "))?;
    let printed: String =
        origin.chars().filter(|c| !c.is_control() && !"\"\\".contains(*c)).take(200).collect();
    writeln!(text, "cause = \"not known; a formula that a diagnosis of `{printed}` has proposed\"")?;
    writeln!(text, "remedy = \"confirm it with a second recording, then find what acts like this\"\n")
}

/// The effects of such a text; none where it cannot be read.
pub fn effects(text: &str) -> Vec<&'static Effect> {
    user::parse(text, Path::new("proposed.toml")).unwrap_or_default()
}

/// An effect with the values that its entry gives; `None` where one is missing.
pub fn fitted(effect: &'static Effect) -> Option<Dose> {
    let Act::Formula(_, formula) = effect.act else { return None };
    let values = formula.fitted().iter().map(|fitted| fitted.map(|fitted| fitted.value));
    Some(Dose { effect, values: values.collect::<Option<Vec<f64>>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::proposal::grammar::{Held, formulas, tests::taken};

    #[test]
    fn every_formula_reads_back_as_effects_with_its_fitted_values() {
        let held = Held { gimbals: true, temperature: Some(25.0), field: true };
        for kind in SensorKind::ALL {
            for formula in formulas(kind, held, &taken) {
                for axes in [&[1][..], &[0, 2], &[0, 1, 2]] {
                    let amounts = vec![(1.25e-3, 1e-5); axes.len() * formula.terms.len()];
                    let text = toml(kind, &formula, axes, &amounts, "walk \"one\".csv");
                    let read = user::parse(&text, Path::new("proposed.toml"));
                    let read = read.unwrap_or_else(|fault| panic!("{fault}\n{text}"));
                    assert_eq!(read.len(), formula.terms.len());
                    for effect in read {
                        let Act::Formula(of, formula) = effect.act else { panic!("{effect:?}") };
                        assert_eq!(of, kind);
                        assert_eq!(effect.amplitudes().count(), axes.len());
                        assert!(formula.fitted().iter().all(Option::is_some));
                        assert_eq!(formula.fitted()[0].map(|fitted| fitted.value), Some(1.25e-3));
                    }
                }
            }
        }
    }
}
