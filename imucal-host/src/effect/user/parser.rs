//! From a formula's text to its tree.
//!
//! ```text
//! comparison:  sum [(< | <= | > | >= | ==) sum]
//! sum:         product {(+ | −) product}
//! product:     sign {(* | /) sign}
//! sign:        [+ | −] sign | power
//! power:       atom [(^ | **) sign]          −x^2 is −(x^2), 2^3^2 is 2^(3^2)
//! atom:        number | name | name(comparison {, comparison}) | (comparison)
//! ```
//!
//! Length, depth and operations are limited while the text is read, before anything is made of it that could be large.

use super::{
    expression::Expression,
    fault::FormulaFault,
    function::{self, Binary, COMPARISONS, power},
    history::History,
    quantity,
};
use crate::recording::manifest::spelling::nearest;

/// Longest text, bytes.
pub(super) const LONGEST: usize = 1000;
/// Deepest nesting of parentheses, functions and signs.
pub(super) const DEEPEST: usize = 24;
/// Most operations and functions.
pub(super) const MOST: usize = 200;
/// Deepest nesting of `lag` and `mean`.
pub(super) const DEEPEST_HISTORY: usize = 3;
/// Edits within which a misspelt name is taken for a known one.
const NEAR: usize = 2;

/// Understands a formula; `shapes` names the parameters it may have in addition to the inputs.
pub(super) fn parse(text: &str, shapes: &[String]) -> Result<Expression, FormulaFault> {
    if text.len() > LONGEST {
        return Err(FormulaFault::TooLong { found: text.len(), most: LONGEST });
    }
    let mut parser = Parser { text, at: 0, shapes, depth: 0, histories: 0, operations: 0 };
    let expression = parser.comparison()?;
    match parser.peek() {
        None => Ok(expression),
        Some(_) => Err(parser.unexpected("an operator or the end of the formula")),
    }
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    shapes: &'t [String],
    depth: usize,
    histories: usize,
    operations: usize,
}

impl<'t> Parser<'t> {
    /// The next character that is no blank.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, token: &str) -> bool {
        self.peek();
        let is_next = self.text[self.at..].starts_with(token);
        if is_next {
            self.at += token.len();
        }
        is_next
    }

    fn expect(&mut self, token: &'static str) -> Result<(), FormulaFault> {
        if self.take(token) { Ok(()) } else { Err(self.unexpected(token)) }
    }

    fn column(&self) -> usize {
        self.text[..self.at].chars().count() + 1
    }

    fn unexpected(&mut self, expected: &'static str) -> FormulaFault {
        let found = self.peek().map_or("the end".to_owned(), |next| format!("`{}`", next.escape_default()));
        FormulaFault::Unexpected { column: self.column(), found, expected }
    }

    fn operation(&mut self) -> Result<(), FormulaFault> {
        self.operations += 1;
        if self.operations > MOST { Err(FormulaFault::TooManyOperations { most: MOST }) } else { Ok(()) }
    }

    fn binary(
        &mut self,
        function: Binary,
        left: Expression,
        right: Expression,
    ) -> Result<Expression, FormulaFault> {
        self.operation()?;
        Ok(Expression::Binary(function, Box::new([left, right])))
    }

    /// A part one level further inside.
    fn inside(
        &mut self,
        part: impl FnOnce(&mut Self) -> Result<Expression, FormulaFault>,
    ) -> Result<Expression, FormulaFault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(FormulaFault::TooDeep { most: DEEPEST });
        }
        let part = part(self)?;
        self.depth -= 1;
        Ok(part)
    }

    fn comparison(&mut self) -> Result<Expression, FormulaFault> {
        let left = self.sum()?;
        match COMPARISONS.iter().find(|(token, _)| self.take(token)) {
            Some((_, compare)) => {
                let right = self.sum()?;
                self.binary(*compare, left, right)
            }
            None => Ok(left),
        }
    }

    fn sum(&mut self) -> Result<Expression, FormulaFault> {
        let mut left = self.product()?;
        loop {
            let function: Binary = match self.peek() {
                Some('+') => |a, b| a + b,
                Some('-') => |a, b| a - b,
                _ => return Ok(left),
            };
            self.at += 1;
            let right = self.product()?;
            left = self.binary(function, left, right)?;
        }
    }

    fn product(&mut self) -> Result<Expression, FormulaFault> {
        let mut left = self.sign()?;
        loop {
            let function: Binary = match self.peek() {
                Some('*') => |a, b| a * b,
                Some('/') => |a, b| a / b,
                _ => return Ok(left),
            };
            self.at += 1;
            let right = self.sign()?;
            left = self.binary(function, left, right)?;
        }
    }

    fn sign(&mut self) -> Result<Expression, FormulaFault> {
        if self.take("+") {
            self.operation()?;
            return self.inside(Self::sign);
        }
        if self.take("-") {
            self.operation()?;
            return Ok(Expression::Unary(|x| -x, Box::new(self.inside(Self::sign)?)));
        }
        let base = self.atom()?;
        if self.take("^") || self.take("**") {
            let exponent = self.inside(Self::sign)?;
            return self.binary(power, base, exponent);
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<Expression, FormulaFault> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let part = self.inside(Self::comparison)?;
                self.expect(")")?;
                Ok(part)
            }
            Some(next) if next.is_ascii_digit() || next == '.' => self.number(),
            Some(next) if next.is_ascii_alphabetic() || next == '_' => self.name(),
            _ => Err(self.unexpected("a number, a name or `(`")),
        }
    }

    /// `2`, `0.5`, `.5`, `1e-3`.
    fn number(&mut self) -> Result<Expression, FormulaFault> {
        let bytes = self.text.as_bytes();
        let is_sign = |at: usize| {
            at > self.at && matches!(bytes[at - 1], b'e' | b'E') && matches!(bytes[at], b'+' | b'-')
        };
        let belongs = |at: &usize| bytes[*at].is_ascii_alphanumeric() || bytes[*at] == b'.' || is_sign(*at);
        let end = (self.at..bytes.len()).take_while(belongs).last().map_or(self.at, |last| last + 1);
        let text = &self.text[self.at..end];
        let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
        let found = || FormulaFault::Number { column: self.column(), found: text.to_owned() };
        let number = number.ok_or_else(found)?;
        self.at = end;
        Ok(Expression::Number(number))
    }

    fn name(&mut self) -> Result<Expression, FormulaFault> {
        let column = self.column();
        let rest = &self.text[self.at..];
        let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let name = &rest[..length];
        self.at += length;
        if self.take("(") {
            return self.call(name, column);
        }
        let shape = self.shapes.iter().position(|shape| shape == name);
        match (shape, quantity::find(name), name) {
            (Some(at), ..) => Ok(Expression::Shape(at)),
            (None, Some(quantity), _) => Ok(Expression::Input(quantity)),
            (None, None, "pi") => Ok(Expression::Number(std::f64::consts::PI)),
            (None, None, _) => Err(self.unknown(name, column)),
        }
    }

    fn unknown(&self, name: &str, column: usize) -> FormulaFault {
        let inputs: Vec<String> = quantity::all().into_iter().map(|(name, _)| name).collect();
        let names = inputs.iter().chain(self.shapes).map(String::as_str).chain(["pi"]);
        FormulaFault::UnknownName {
            column,
            found: name.to_owned(),
            nearest: nearest(name, names, NEAR).map(str::to_owned),
        }
    }

    fn call(&mut self, name: &str, column: usize) -> Result<Expression, FormulaFault> {
        self.operation()?;
        if let Some(history) = History::find(name) {
            return self.history(history, name, column);
        }
        if let Some(function) = function::unary(name) {
            let [of] = self.arguments(name, column)?;
            return Ok(Expression::Unary(function, Box::new(of)));
        }
        if let Some(function) = function::binary(name) {
            return Ok(Expression::Binary(function, Box::new(self.arguments(name, column)?)));
        }
        let names = function::names().chain(["lag", "mean"]);
        Err(FormulaFault::UnknownFunction {
            column,
            found: name.to_owned(),
            nearest: nearest(name, names, NEAR).map(str::to_owned),
        })
    }

    fn history(&mut self, history: History, name: &str, column: usize) -> Result<Expression, FormulaFault> {
        self.histories += 1;
        if self.histories > DEEPEST_HISTORY {
            return Err(FormulaFault::HistoryTooDeep { most: DEEPEST_HISTORY });
        }
        let of: [Expression; 2] = self.arguments(name, column)?;
        self.histories -= 1;
        match &of[1] {
            Expression::Number(tau) if *tau > 0.0 => {}
            Expression::Shape(_) => {}
            _ => return Err(FormulaFault::Time { column, function: name.to_owned() }),
        }
        Ok(Expression::History(history, Box::new(of)))
    }

    /// So many arguments, up to the closing parenthesis.
    fn arguments<const N: usize>(
        &mut self,
        name: &str,
        column: usize,
    ) -> Result<[Expression; N], FormulaFault> {
        let mut arguments = vec![self.inside(Self::comparison)?];
        while self.take(",") {
            arguments.push(self.inside(Self::comparison)?);
        }
        self.expect(")")?;
        let found = arguments.len();
        arguments.try_into().map_err(|_| FormulaFault::Arguments {
            column,
            function: name.to_owned(),
            found,
            expected: N,
        })
    }
}
