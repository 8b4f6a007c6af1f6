//! What a user's effect adds to a sensor's output: an amplitude an axis, times a formula.

use std::fmt;

use nalgebra::Vector3;

use super::{
    entry::Fitted,
    expression::{Column, Expression},
    fault::FormulaFault,
    parser,
    quantity::{Quantity, Rows},
};
use crate::effect::{Input, Needs, SensorRun};

/// Larger values of a formula are none, since their squares would swamp a fit.
const LARGEST: f64 = 1e12;

/// For each axis of the sensor: which amplitude, and which part it multiplies. `None` where the axis is left as it is.
pub(super) type Layout = [Option<(usize, usize)>; 3];

/// A formula of a user's effect, ready to be evaluated.
#[derive(Debug)]
pub struct Formula {
    /// Id of the effect.
    pub(super) effect: String,
    /// Its parts, as they were written.
    pub(super) texts: Vec<String>,
    pub(super) parts: Vec<Expression>,
    /// What acts on each axis.
    pub(super) axes: Layout,
    /// Number of amplitudes; shapes follow them in the parameter vector.
    pub(super) amplitudes: usize,
    /// What a diagnosis has found of each parameter, in their order.
    pub(super) fitted: Vec<Option<Fitted>>,
}

/// A formula that has no value that can be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{effect}: found {value} from its formula `{formula}` on axis {axis} in row {row} (t = {time} s), expected a number \
     between -1e12 and 1e12; keep what functions are given within their range, as in sqrt(max(a_x, 0))"
)]
#[allow(missing_docs)] // The fields are those of the message.
pub struct NotFinite {
    pub effect: String,
    pub formula: String,
    pub value: f64,
    pub axis: char,
    /// Counted from one.
    pub row: usize,
    pub time: f64,
}

impl fmt::Display for Formula {
    /// As it was written, part by part.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.texts.join(", "))
    }
}

impl NotFinite {
    /// The same, for a run at other points than the recording's rows.
    pub fn without_row(&self) -> String {
        format!(
            "its formula `{}` gives {} on axis {} at {} s, expected a number between -1e12 and 1e12",
            self.formula, self.value, self.axis, self.time
        )
    }
}

impl Formula {
    /// A formula of its own for each axis of a sensor, with an amplitude an axis; `shapes` names the parameters that it may
    /// have in addition.
    ///
    /// # Errors
    ///
    /// [`FormulaFault`], of the first text that cannot be understood.
    pub fn of_axes(texts: &[String; 3], shapes: &[String]) -> Result<Self, FormulaFault> {
        // A text that is the same on all axes is one part.
        let one = texts.iter().all(|text| *text == texts[0]);
        let texts = if one { texts[..1].to_vec() } else { texts.to_vec() };
        let parts = texts.iter().map(|text| parser::parse(text, shapes)).collect::<Result<Vec<_>, _>>()?;
        let axes = [0, 1, 2].map(|axis| Some((axis, if one { 0 } else { axis })));
        let fitted = vec![None; 3 + shapes.len()];
        Ok(Self { effect: String::new(), texts, parts, axes, amplitudes: 3, fitted })
    }

    /// What a diagnosis has found of each parameter, in the order of the effect's; `None` where the file does not say.
    pub fn fitted(&self) -> &[Option<Fitted>] {
        &self.fitted
    }

    /// Adds to each row's output.
    ///
    /// # Errors
    ///
    /// [`NotFinite`], of the first such row of an axis with an amplitude.
    pub fn add(&self, values: &[f64], run: &mut SensorRun<'_>) -> Result<(), NotFinite> {
        let amplitude = |axis: usize| {
            let (amplitude, _) = self.axes[axis]?;
            values.get(amplitude).copied().filter(|amplitude| *amplitude != 0.0)
        };
        let shapes = values.get(self.amplitudes..).unwrap_or_default();
        let columns = self.columns(run.input, run.sensed, shapes, |axis| amplitude(axis).is_some())?;
        for (axis, column) in columns.into_iter().enumerate() {
            let (Some(column), Some(amplitude)) = (column, amplitude(axis)) else { continue };
            for (row, output) in run.output.iter_mut().enumerate() {
                output[axis] += amplitude * column.at(row);
            }
        }
        Ok(())
    }

    /// What is multiplied on each axis that has an amplitude, point by point, with these shapes.
    ///
    /// # Errors
    ///
    /// [`NotFinite`].
    pub fn factors(
        &self,
        input: &[Input],
        sensed: &[Vector3<f64>],
        shapes: &[f64],
    ) -> Result<Vec<Vec<f64>>, NotFinite> {
        let columns = self.columns(input, sensed, shapes, |_| true)?;
        let whole = |column: Column| (0..input.len()).map(|row| column.at(row)).collect();
        Ok(columns.into_iter().flatten().map(whole).collect())
    }

    /// The same axes have amplitudes, in common or each its own.
    pub fn is_laid_out_like(&self, other: &Self) -> bool {
        let amplitudes = |formula: &Self| formula.axes.map(|axis| axis.map(|(amplitude, _)| amplitude));
        amplitudes(self) == amplitudes(other)
    }

    /// What each axis' amplitude multiplies, row by row, with these shapes.
    fn columns(
        &self,
        input: &[Input],
        sensed: &[Vector3<f64>],
        shapes: &[f64],
        is_asked: impl Fn(usize) -> bool,
    ) -> Result<[Option<Column>; 3], NotFinite> {
        let mut columns: [Option<Column>; 3] = [const { None }; 3];
        // The part that is the same on each axis, and its column.
        let mut shared: Option<(usize, Column)> = None;
        for (axis, asked) in columns.iter_mut().enumerate() {
            let Some((_, part)) = self.axes[axis].filter(|_| is_asked(axis)) else { continue };
            let known = shared.as_ref().filter(|(of, _)| *of == part).map(|(_, column)| column.clone());
            let column = match known {
                Some(column) => column,
                None => {
                    let rows = Rows { input, sensed, axis };
                    let column = self.parts[part].column(&rows, shapes);
                    self.check(&column, part, &rows)?;
                    column
                }
            };
            if !self.parts[part].depends_on_axis() {
                shared = Some((part, column.clone()));
            }
            *asked = Some(column);
        }
        Ok(columns)
    }

    fn check(&self, column: &Column, part: usize, rows: &Rows<'_>) -> Result<(), NotFinite> {
        let is_usable = |row: &usize| (-LARGEST..=LARGEST).contains(&column.at(*row));
        match (0..rows.input.len()).find(|row| !is_usable(row)) {
            None => Ok(()),
            Some(row) => Err(NotFinite {
                effect: self.effect.clone(),
                formula: self.texts[part].clone(),
                value: column.at(row),
                axis: ['x', 'y', 'z'][rows.axis],
                row: row + 1,
                time: rows.input.get(row).map_or(0.0, |input: &Input| input.time),
            }),
        }
    }

    fn inputs(&self) -> impl Iterator<Item = Quantity> {
        self.parts.iter().flat_map(Expression::inputs)
    }

    /// What a recording must hold so that the formula's inputs are known.
    pub(super) fn needs(&self) -> Needs {
        let any = |of: fn(&Quantity) -> bool| self.inputs().any(|quantity| of(&quantity));
        Needs {
            gimbals: any(|q| matches!(q, Quantity::Angle(_) | Quantity::AngleRate(_))),
            thermometer: any(|q| matches!(q, Quantity::Temperature | Quantity::TemperatureRate)),
            heading: any(Quantity::is_magnetic),
            ..Needs::NOTHING
        }
    }

    /// It depends on a shape.
    pub(super) fn has_shape(&self, shape: usize) -> bool {
        let is_it = |part: &&Expression| matches!(part, Expression::Shape(at) if *at == shape);
        self.parts.iter().any(|part| part.parts().iter().any(is_it))
    }

    /// A shape is the time of `lag` or `mean`.
    pub(super) fn is_time(&self, shape: usize) -> bool {
        let is_it = |part: &Expression| match part {
            Expression::History(_, of) => matches!(of[1], Expression::Shape(at) if at == shape),
            _ => false,
        };
        self.parts.iter().any(|part| part.parts().into_iter().any(is_it))
    }
}
