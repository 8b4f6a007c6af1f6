//! A formula as a tree, evaluated column by column.

use super::{
    function,
    history::History,
    quantity::{Quantity, Rows},
};

/// A part of a formula.
#[derive(Clone, Debug)]
pub(crate) enum Expression {
    /// A number.
    Number(f64),
    /// A shape, by its place among those of the effect.
    Shape(usize),
    /// An input.
    Input(Quantity),
    /// A function of one argument.
    Unary(function::Unary, Box<Expression>),
    /// An operation or function of two.
    Binary(function::Binary, Box<[Expression; 2]>),
    /// What a part was before; the time, s, is a number or a shape.
    History(History, Box<[Expression; 2]>),
}

/// Values of a part, row by row.
#[derive(Clone, Debug)]
pub(crate) enum Column {
    /// The same in every row.
    Same(f64),
    /// One a row.
    Each(Vec<f64>),
}

impl Column {
    /// The value of a row.
    pub(crate) fn at(&self, row: usize) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(values) => values[row],
        }
    }
}

impl Expression {
    /// At rows, with these shapes.
    pub(crate) fn column(&self, rows: &Rows<'_>, shapes: &[f64]) -> Column {
        match self {
            Self::Number(value) => Column::Same(*value),
            Self::Shape(at) => Column::Same(shapes.get(*at).copied().unwrap_or(f64::NAN)),
            Self::Input(quantity) => Column::Each(rows.column(*quantity)),
            Self::Unary(function, of) => match of.column(rows, shapes) {
                Column::Same(value) => Column::Same(function(value)),
                Column::Each(mut values) => {
                    values.iter_mut().for_each(|value| *value = function(*value));
                    Column::Each(values)
                }
            },
            Self::Binary(function, of) => {
                combined(*function, of[0].column(rows, shapes), of[1].column(rows, shapes))
            }
            Self::History(history, of) => match (of[0].column(rows, shapes), of[1].column(rows, shapes)) {
                (Column::Each(values), Column::Same(tau)) => {
                    Column::Each(history.of(&rows.times(), &values, tau))
                }
                (steady, _) => steady,
            },
        }
    }

    /// Every part, itself first.
    pub(crate) fn parts(&self) -> Vec<&Self> {
        let mut parts = vec![self];
        let mut at = 0;
        while at < parts.len() {
            match parts[at] {
                Self::Unary(_, of) => parts.push(of),
                Self::Binary(_, of) | Self::History(_, of) => parts.extend(of.iter()),
                Self::Number(_) | Self::Shape(_) | Self::Input(_) => {}
            }
            at += 1;
        }
        parts
    }

    /// Its inputs.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = Quantity> {
        self.parts().into_iter().filter_map(|part| match part {
            Self::Input(quantity) => Some(*quantity),
            _ => None,
        })
    }

    /// It is another for each axis.
    pub(crate) fn depends_on_axis(&self) -> bool {
        self.inputs().any(|quantity| matches!(quantity, Quantity::Vector(_, None)))
    }
}

fn combined(function: function::Binary, left: Column, right: Column) -> Column {
    match (left, right) {
        (Column::Same(a), Column::Same(b)) => Column::Same(function(a, b)),
        (Column::Each(mut values), Column::Same(b)) => {
            values.iter_mut().for_each(|a| *a = function(*a, b));
            Column::Each(values)
        }
        (Column::Same(a), Column::Each(mut values)) => {
            values.iter_mut().for_each(|b| *b = function(a, *b));
            Column::Each(values)
        }
        (Column::Each(mut values), Column::Each(others)) => {
            values.iter_mut().zip(others).for_each(|(a, b)| *a = function(*a, b));
            Column::Each(values)
        }
    }
}
