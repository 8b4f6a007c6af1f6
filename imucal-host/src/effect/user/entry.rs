//! One entry of a user's file, checked and made an effect.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{
    fault::EntryFault,
    formula::{Formula, Layout},
    function,
    history::History,
    parser, quantity,
};
use crate::{
    effect::{Act, CATALOGUE, Confusable, Effect, NUISANCES, Parameter, Role, Words, XYZ},
    recording::SensorKind,
};

/// Most shapes: each of a few values is tried with each of the others.
const MOST_SHAPES: usize = 2;
/// Longest id, name or unit, and longest sentence, characters.
const SHORT: usize = 60;
const LONG: usize = 400;
/// Most ids in `like`.
const MOST_LIKE: usize = 20;
/// Amplitudes are of this size.
const SIZES: (f64, f64) = (1e-30, 1e30);
/// Shapes are at most of this size.
const LARGEST_SHAPE: f64 = 1e9;

/// An entry as it is written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    pub(super) id: String,
    sensor: String,
    #[serde(default)]
    axes: Axes,
    formula: Texts,
    unit: String,
    amplitude: Amplitude,
    #[serde(default)]
    shape: BTreeMap<String, Shape>,
    /// What a diagnosis has found, by parameter.
    #[serde(default)]
    fitted: BTreeMap<String, Fitted>,
    cause: String,
    remedy: String,
    #[serde(default)]
    like: Vec<String>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "`axes` to be \"each\", \"common\" or a list such as [\"x\", \"z\"]")]
enum Axes {
    Named(String),
    Listed(Vec<String>),
}

impl Default for Axes {
    fn default() -> Self {
        Self::Named("each".to_owned())
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "`formula` to be a text, or three of them for x, y and z")]
enum Texts {
    One(String),
    Three([String; 3]),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Amplitude {
    typical: f64,
    material: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shape {
    typical: f64,
    low: f64,
    high: f64,
    unit: String,
}

/// A parameter as it was estimated from a recording.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fitted {
    /// Its value, in the unit of the parameter.
    pub value: f64,
    /// Standard error of the value.
    pub std_error: f64,
}

/// A value that is not what was expected.
pub(super) fn wrong(key: &str, found: impl std::fmt::Display, expected: &'static str) -> EntryFault {
    let found = found.to_string().chars().take(SHORT).flat_map(char::escape_default).collect();
    EntryFault::Value { key: key.to_owned(), found, expected }
}

impl Entry {
    /// Ids that it is like.
    pub(super) fn like(&self) -> &[String] {
        &self.like
    }

    /// The effect. Its words live as long as the process.
    pub(super) fn effect(&self) -> Result<Effect, EntryFault> {
        let sensor = self.sensor()?;
        self.check_texts()?;
        let (names, axes) = self.amplitudes()?;
        if self.shape.len() > MOST_SHAPES {
            return Err(wrong("shape", format!("a table of {}", self.shape.len()), "at most two shapes"));
        }
        let shapes: Vec<String> = self.shape.keys().cloned().collect();
        shapes.iter().try_for_each(|name| check_name(name))?;
        let texts = match &self.formula {
            Texts::One(text) => vec![text.clone()],
            Texts::Three(texts) => texts.to_vec(),
        };
        let parse = |text: &String| {
            parser::parse(text, &shapes).map_err(|cause| EntryFault::Formula {
                text: text.chars().take(SHORT).flat_map(char::escape_default).collect(),
                cause,
            })
        };
        let parts = texts.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
        let fitted = self.fitted(names.iter().chain(&shapes))?;
        let formula =
            Formula { effect: self.id.clone(), texts, parts, axes, amplitudes: names.len(), fitted };
        let mut parameters = self.amplitude_parameters(&names)?;
        for (at, (name, shape)) in self.shape.iter().enumerate() {
            if !formula.has_shape(at) {
                return Err(EntryFault::Unused { name: name.clone() });
            }
            parameters.push(shape.parameter(name, formula.is_time(at))?);
        }
        let words = Words {
            cause: leaked(&self.cause),
            remedy: leaked(&self.remedy),
            needs: leaked(&format!("Motion or change that makes `{}` vary.", formula.texts.join("`, `"))),
        };
        let needs = formula.needs();
        let act = Act::Formula(sensor, Box::leak(Box::new(formula)));
        let like = |id: &String| Confusable { id: id.clone(), parted_by: "" };
        let mut effect = Effect::new(&self.id, act, parameters, words).needing(needs);
        effect.confusables = self.like.iter().map(like).collect();
        Ok(effect)
    }

    /// What was found of each parameter, in their order.
    fn fitted<'n>(&self, names: impl Iterator<Item = &'n String>) -> Result<Vec<Option<Fitted>>, EntryFault> {
        let names: Vec<&String> = names.collect();
        for (name, fitted) in &self.fitted {
            if !names.contains(&name) {
                return Err(wrong("fitted", name, "amplitudes and shapes of this entry, such as x"));
            }
            let is_sound = fitted.value.abs() <= SIZES.1 && (0.0..=SIZES.1).contains(&fitted.std_error);
            if !is_sound {
                let key = format!("fitted.{name}");
                let found = format!("{} with std_error {}", fitted.value, fitted.std_error);
                return Err(wrong(&key, found, "numbers up to 1e30, and no negative std_error"));
            }
        }
        Ok(names.into_iter().map(|name| self.fitted.get(name).copied()).collect())
    }

    fn sensor(&self) -> Result<SensorKind, EntryFault> {
        let kind = SensorKind::ALL.into_iter().find(|kind| kind.prefix() == self.sensor);
        let kind = kind.ok_or_else(|| wrong("sensor", &self.sensor, "acc, gyr or mag"))?;
        let name = self.id.strip_prefix(kind.prefix()).and_then(|rest| rest.strip_prefix('.'));
        if !name.is_some_and(is_name) {
            return Err(wrong(
                "id",
                &self.id,
                "the sensor, a dot and a name of a-z, 0-9 and _ that begins with a letter, such as gyr.cable_torque",
            ));
        }
        if CATALOGUE.iter().chain(NUISANCES.iter()).any(|effect| effect.id == self.id) {
            return Err(EntryFault::Taken);
        }
        Ok(kind)
    }

    fn check_texts(&self) -> Result<(), EntryFault> {
        let expected = "a unit such as rad/s, or - for none; up to 60 characters";
        is_printed(&self.unit, SHORT).then_some(()).ok_or_else(|| wrong("unit", &self.unit, expected))?;
        for (key, text) in [("cause", &self.cause), ("remedy", &self.remedy)] {
            let expected = "a sentence of up to 400 characters in one line";
            is_printed(text, LONG).then_some(()).ok_or_else(|| wrong(key, text, expected))?;
        }
        if self.like.len() > MOST_LIKE {
            return Err(wrong("like", self.like.len(), "at most 20 ids"));
        }
        match self.like.iter().find(|id| !is_id(id) || **id == self.id) {
            Some(id) => Err(wrong("like", id, "ids of other effects, such as gyr.g_sensitivity")),
            None => Ok(()),
        }
    }

    /// Names of the amplitudes, and for each axis which of them multiplies which part.
    fn amplitudes(&self) -> Result<(Vec<String>, Layout), EntryFault> {
        let expected = "\"each\", \"common\" or a list of x, y and z, each once";
        let part = |axis: usize| if matches!(self.formula, Texts::Three(_)) { axis } else { 0 };
        match &self.axes {
            Axes::Named(each) if each == "each" => {
                Ok((XYZ.map(str::to_owned).to_vec(), [0, 1, 2].map(|axis| Some((axis, part(axis))))))
            }
            Axes::Named(common) if common == "common" => {
                Ok((vec!["k".to_owned()], [0, 1, 2].map(|axis| Some((0, part(axis))))))
            }
            Axes::Named(other) => Err(wrong("axes", other, expected)),
            Axes::Listed(list) => {
                let known = |name: &String| XYZ.contains(&name.as_str());
                let once = list.iter().enumerate().all(|(at, name)| !list[..at].contains(name));
                if list.is_empty() || !once || !list.iter().all(known) {
                    return Err(wrong("axes", format!("[{}]", list.join(", ")), expected));
                }
                let of = |axis: usize| {
                    list.iter().position(|name| *name == XYZ[axis]).map(|place| (place, part(axis)))
                };
                Ok((list.clone(), [0, 1, 2].map(of)))
            }
        }
    }

    fn amplitude_parameters(&self, names: &[String]) -> Result<Vec<Parameter>, EntryFault> {
        let Amplitude { typical, material } = self.amplitude;
        for (key, value) in [("amplitude.typical", typical), ("amplitude.material", material)] {
            if !(SIZES.0..=SIZES.1).contains(&value) {
                return Err(wrong(key, value, "a positive number from 1e-30 to 1e30"));
            }
        }
        let of = |name: &String| Parameter { material, ..Parameter::amplitude(name, &self.unit, typical) };
        Ok(names.iter().map(of).collect())
    }
}

impl Shape {
    fn parameter(&self, name: &str, is_time: bool) -> Result<Parameter, EntryFault> {
        let key = |of: &str| format!("shape.{name}{of}");
        if !is_printed(&self.unit, SHORT) {
            return Err(wrong(&key(".unit"), &self.unit, "a unit such as m/s^2, or - for none"));
        }
        let Self { typical, low, high, .. } = *self;
        let is_sound = [typical, low, high].iter().all(|value| value.abs() <= LARGEST_SHAPE)
            && low < high
            && (low..=high).contains(&typical);
        if !is_sound {
            let found = format!("{low} <= {typical} <= {high}");
            return Err(wrong(
                &key(""),
                found,
                "numbers up to 1e9 with low <= typical <= high and low < high",
            ));
        }
        if low >= 0.0 && low < SIZES.0 {
            return Err(wrong(
                &key(".low"),
                low,
                "a number above zero, or below zero for a shape of either sign",
            ));
        }
        if is_time && low <= 0.0 {
            return Err(wrong(&key(".low"), low, "a number above zero, since it is a time of lag or mean"));
        }
        let prior_scale = if low > 0.0 { 0.5 * typical } else { 0.25 * (high - low) };
        Ok(Parameter {
            name: name.to_owned(),
            unit: self.unit.clone(),
            role: Role::Shape { usual: typical },
            prior_scale,
            range: (low, high),
            is_bounded: false,
            material: 0.0,
        })
    }
}

/// A shape's name must mean nothing else.
fn check_name(name: &str) -> Result<(), EntryFault> {
    let is_free = !XYZ.contains(&name)
        && !["k", "pi"].contains(&name)
        && quantity::find(name).is_none()
        && !function::names().any(|own| own == name)
        && History::find(name).is_none();
    let expected =
        "a name of a-z, 0-9 and _ that begins with a letter and is no input, function, x, y, z, k or pi";
    if is_name(name) && is_free { Ok(()) } else { Err(wrong("shape", name, expected)) }
}

/// A name of a-z, 0-9 and `_` that begins with a letter.
fn is_name(text: &str) -> bool {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(letters) && text.len() <= SHORT
}

/// `acc.bias`.
fn is_id(text: &str) -> bool {
    text.split_once('.').is_some_and(|(sensor, name)| is_name(sensor) && is_name(name))
}

/// It can be printed in a line, and is not empty.
fn is_printed(text: &str, longest: usize) -> bool {
    !text.trim().is_empty() && text.chars().count() <= longest && !text.chars().any(char::is_control)
}

fn leaked(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}
