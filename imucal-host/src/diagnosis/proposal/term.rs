//! One formula that is tried: what each axis' amplitude multiplies, and how it is spelt.

use crate::{
    effect::{
        XYZ, si,
        user::{Formula, FormulaFault},
    },
    recording::SensorKind,
};

/// A quantity that a formula is a function of.
#[derive(Clone, Debug, PartialEq)]
pub struct Driver {
    /// What it is, in letters that an id may have.
    pub name: String,
    /// Its text for the axes x, y and z.
    pub texts: [String; 3],
    /// Its unit.
    pub unit: String,
}

/// A parameter by which a formula bends, or its time constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name in the formula.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Standard error of the value; none before it is fitted.
    pub std_error: Option<f64>,
    /// Values that it may have.
    pub range: (f64, f64),
}

/// A formula that is tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Formulated {
    /// What it is, in letters that an id may have; the same whatever its shape.
    pub name: String,
    /// Texts for x, y and z of each term; an amplitude an axis and term.
    pub terms: Vec<[String; 3]>,
    /// Its shape.
    pub shape: Option<Shape>,
    /// Unit of what an amplitude multiplies.
    pub unit: String,
    /// How much there is to it: the fewer the simpler.
    pub complexity: usize,
}

impl Driver {
    /// The same on all axes.
    pub fn scalar(name: &str, text: &str, unit: &str) -> Self {
        Self { name: name.to_owned(), texts: [0; 3].map(|_| text.to_owned()), unit: unit.to_owned() }
    }

    /// The component of a vector along the axis itself, or so many axes further on.
    pub fn vector(name: &str, next: usize, unit: &str) -> Self {
        let text = |axis: usize| match next {
            0 => name.to_owned(),
            next => format!("{name}_{}", XYZ[(axis + next) % 3]),
        };
        let which = ["own", "next", "last"][next];
        Self {
            name: format!("{}_{which}", name.to_lowercase()),
            texts: [0, 1, 2].map(text),
            unit: unit.to_owned(),
        }
    }

    /// Gain and misalignment hold it: it is the axis' own input, or one component of that on all axes.
    pub fn is_in_baseline(&self) -> bool {
        let is_component = |text: &str| text.strip_prefix("y_").is_some_and(|axis| XYZ.contains(&axis));
        self.texts.iter().all(|text| text == "y")
            || self.texts.iter().all(|text| *text == self.texts[0] && is_component(text))
    }

    /// Its product with another.
    pub fn times(&self, other: &Self) -> Self {
        Self {
            name: format!("{}_by_{}", self.name, other.name),
            texts: [0, 1, 2].map(|axis| format!("{} * {}", self.texts[axis], other.texts[axis])),
            unit: format!("{} {}", self.unit, other.unit),
        }
    }

    /// The formula that is the driver.
    pub fn itself(&self, complexity: usize) -> Formulated {
        Formulated {
            name: self.name.clone(),
            terms: vec![self.texts.clone()],
            shape: None,
            unit: self.unit.clone(),
            complexity,
        }
    }

    /// A function of it; `$` in its text stands for the driver.
    pub fn function(&self, name: &str, text: &str, complexity: usize, shape: Option<Shape>) -> Formulated {
        let power = match text {
            "$^2" | "lag($^2, tau)" => "^2",
            "$^3" => "^3",
            _ => "",
        };
        let unit = match text {
            "tanh($ / s)" => String::new(),
            _ if power.is_empty() => self.unit.clone(),
            _ if self.unit.contains(['/', ' ']) => format!("({}){power}", self.unit),
            _ => format!("{}{power}", self.unit),
        };
        Formulated {
            name: format!("{name}_of_{}", self.name),
            terms: vec![self.texts.each_ref().map(|driver| text.replace('$', driver))],
            shape,
            unit,
            complexity,
        }
    }
}

impl Shape {
    /// In the unit of a driver.
    pub fn about(name: &str, driver: &Driver, value: f64, range: (f64, f64)) -> Self {
        Self { name: name.to_owned(), unit: driver.unit.clone(), value, std_error: None, range }
    }

    /// A time constant, s.
    pub fn time(value: f64) -> Self {
        let (name, unit) = ("tau".to_owned(), "s".to_owned());
        Self { name, unit, value, std_error: None, range: (0.1, 400.0) }
    }

    /// It is no further than its error from an end of its range: a likelier value may lie beyond.
    pub fn is_at_end(&self) -> bool {
        let error = self.std_error.unwrap_or(0.0);
        self.value - self.range.0 <= error || self.range.1 - self.value <= error
    }
}

impl Formulated {
    /// A sinusoid of an angle, with so many periods a turn: a cosine and a sine.
    pub fn sinusoid(angle: &str, periods: f64) -> Self {
        let term = |function: &str| [0; 3].map(|_| format!("{function}({periods} * {angle})"));
        let name = format!("sinusoid_of_{angle}_{}", format!("{periods}").replace('.', "_"));
        Self { name, terms: vec![term("cos"), term("sin")], shape: None, unit: String::new(), complexity: 3 }
    }

    /// Values of its shape, as an evaluation takes them.
    pub fn shapes(&self) -> Vec<f64> {
        self.shape.iter().map(|shape| shape.value).collect()
    }

    /// With another value of its shape.
    #[must_use]
    pub fn with_shape(&self, value: f64) -> Self {
        let shape = self.shape.clone().map(|shape| Shape { value, ..shape });
        Self { shape, ..self.clone() }
    }

    /// Its terms, ready to be evaluated.
    ///
    /// # Errors
    ///
    /// [`FormulaFault`]; none is known.
    pub fn parsed(&self) -> Result<Vec<Formula>, FormulaFault> {
        let names: Vec<String> = self.shape.iter().map(|shape| shape.name.clone()).collect();
        self.terms.iter().map(|texts| Formula::of_axes(texts, &names)).collect()
    }

    /// The texts of a term on an axis, where `y` and the like name no axis, with the axis named.
    fn on_axis(&self, term: usize, axis: usize) -> String {
        named_on(&self.terms[term][axis], axis)
    }

    /// As it is printed, with the names of its amplitudes; `axes` are those on which it acts.
    pub fn spelt(&self, axes: &[usize]) -> String {
        let of_axis = |axis: &usize| {
            let amplitude = |term: usize| match axes.len() {
                1 => AMPLITUDES[term].to_owned(),
                _ => format!("{}_{}", AMPLITUDES[term], XYZ[*axis]),
            };
            let term = |at: usize| format!("{} * {}", amplitude(at), factor(&self.on_axis(at, *axis)));
            (0..self.terms.len()).map(term).collect::<Vec<_>>().join(" + ")
        };
        match axes {
            [axis] => of_axis(axis),
            axes => {
                let line = |axis: &usize| format!("{}: {}", XYZ[*axis], of_axis(axis));
                axes.iter().map(line).collect::<Vec<_>>().join("; ")
            }
        }
    }

    /// Name of an amplitude in what [`Self::spelt`] prints.
    pub fn amplitude_name(term: usize, axis: usize, axes: usize) -> String {
        if axes == 1 { AMPLITUDES[term].to_owned() } else { format!("{}_{}", AMPLITUDES[term], XYZ[axis]) }
    }

    /// A term's text in a user's file, of one axis or of all three.
    pub fn texts(&self, term: usize, axes: &[usize]) -> Vec<String> {
        let texts = &self.terms[term];
        match axes {
            [axis] => vec![self.on_axis(term, *axis)],
            _ if texts.iter().all(|text| *text == texts[0]) => texts[..1].to_vec(),
            _ => texts.to_vec(),
        }
    }

    /// Unit of its amplitudes.
    pub fn amplitude_unit(&self, kind: SensorKind) -> String {
        let sensor = si(kind);
        let is_one = self.unit.starts_with('(') || !self.unit.contains('/');
        match self.unit.is_empty() {
            true => sensor,
            false if is_one && !self.unit.contains(' ') => format!("{sensor}/{}", self.unit),
            false => format!("{sensor}/({})", self.unit),
        }
    }
}

/// Names of amplitudes, by term.
const AMPLITUDES: [&str; 2] = ["k", "l"];

/// A text as a factor of a product.
fn factor(text: &str) -> String {
    if text.contains(" - ") && text.starts_with(|c: char| c != '(') && !text.starts_with("max(") {
        format!("({text})")
    } else {
        text.to_owned()
    }
}

/// A text with `y`, `a`, `w`, `wd` and `B` named as the components of an axis.
fn named_on(text: &str, axis: usize) -> String {
    let mut named = String::new();
    let mut word = String::new();
    for c in text.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        named.push_str(&word);
        if ["y", "a", "w", "wd", "B"].contains(&word.as_str()) {
            named.push('_');
            named.push_str(XYZ[axis]);
        }
        word.clear();
        named.push(c);
    }
    named.pop();
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_formula_is_spelt_with_its_amplitudes_and_axes() {
        let next = Driver::vector("y", 1, "uT");
        let cube = next.function("cube", "$^3", 2, None);
        assert_eq!(cube.spelt(&[2]), "k * y_x^3");
        assert_eq!(cube.spelt(&[0, 1]), "x: k_x * y_y^3; y: k_y * y_z^3");
        assert_eq!(cube.amplitude_unit(SensorKind::Mag), "uT/uT^3");
        let own = Driver::vector("a", 0, "m/s^2").times(&next).itself(2);
        assert_eq!(own.spelt(&[1]), "k * a_y * y_z");
        assert_eq!(own.texts(0, &[1]), ["a_y * y_z"]);
        assert_eq!(own.texts(0, &[0, 1, 2]), ["a * y_y", "a * y_z", "a * y_x"]);
        let sinusoid = Formulated::sinusoid("inner", 2.5);
        assert_eq!(sinusoid.spelt(&[0]), "k * cos(2.5 * inner) + l * sin(2.5 * inner)");
    }

    #[test]
    fn a_shape_within_its_error_of_an_end_is_at_the_end() {
        let shape = |value: f64, std_error: Option<f64>| Shape { std_error, ..Shape::time(value) };
        assert!(shape(0.1, Some(0.01)).is_at_end() && shape(399.0, Some(2.0)).is_at_end());
        assert!(shape(0.1, None).is_at_end() && shape(0.11, Some(0.02)).is_at_end());
        assert!(!shape(0.2, Some(0.05)).is_at_end() && !shape(12.0, Some(1.0)).is_at_end());
    }
}
