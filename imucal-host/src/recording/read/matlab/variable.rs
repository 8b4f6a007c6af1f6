//! Variables of a MAT-file: arrays of numbers, structures of them, and what is neither.

use super::element::{ByteOrder, Element, Elements, Fault, INT8, MATRIX, Numbers, text_of};
use crate::recording::read::memory::Memory;

/// Structures within structures are followed to here.
const DEEPEST: usize = 8;
/// Bytes of the flags, of the sizes or of the length of names: 64 dimensions have no more.
const LONGEST: usize = 256;
/// What holds no number.
const EMPTY: &str = "empty";
/// Bit of an array's flags: its numbers are complex.
const COMPLEX: u32 = 0x0800;

/// A variable, or a field of a structure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) content: Content,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    Array(Array),
    Structure(Vec<Variable>),
    /// Something else, in MATLAB's word for it.
    Other(String),
}

/// Real numbers in rows and columns, of which there are no more than rows, stored column by column or row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    pub(super) rows: usize,
    pub(super) columns: usize,
    numbers: Numbers,
    /// The file has samples side by side, not one below the other.
    is_turned: bool,
}

impl Array {
    pub(super) fn column(&self, at: usize) -> Numbers {
        match self.is_turned {
            true => self.numbers.every(at, self.columns, self.rows),
            false => self.numbers.every(at * self.rows, 1, self.rows),
        }
    }
}

impl Variable {
    /// Understands an `miMATRIX`, whose numbers may take so much memory.
    pub(super) fn of(element: Element<'_>, order: ByteOrder, memory: &Memory<'_>) -> Result<Self, Fault> {
        within(element, order, memory, None, DEEPEST)
    }
}

/// A field's name stands in its structure.
fn within(
    element: Element<'_>,
    order: ByteOrder,
    memory: &Memory<'_>,
    field: Option<String>,
    depth: usize,
) -> Result<Variable, Fault> {
    if element.kind != MATRIX {
        return Err(Fault("an element that is no array"));
    }
    let mut parts = Elements::new(order, element.data);
    let Some(flags) = parts.next()? else {
        // An empty field has no parts.
        let content = Content::Other(EMPTY.to_owned());
        return Ok(Variable { name: field.unwrap_or_default(), content });
    };
    let flags = description(flags, order)?.first().copied().unwrap_or_default() as u32;
    let class = flags & 0xff;
    if class == OPAQUE {
        let name = parts.text()?;
        let (_, class) = (parts.text()?, parts.text()?);
        return Ok(Variable { name: field.unwrap_or(name), content: Content::Other(class) });
    }
    let sizes = sizes(parts.expect()?, order)?;
    let name = parts.text()?;
    let name = field.unwrap_or(name);
    let content = match class {
        STRUCTURE if sizes.iter().all(|size| *size == 1) && depth > 0 => {
            Content::Structure(fields(&mut parts, memory, depth - 1)?)
        }
        6..=15 if flags & COMPLEX == 0 => {
            let numbers = parts.expect()?;
            if !memory.take(Numbers::size_of(numbers)) {
                return Err(Fault("numbers that take more memory than allowed"));
            }
            array(Numbers::of(numbers, order)?, &sizes)?
        }
        6..=15 => Content::Other("complex numbers".to_owned()),
        class => Content::Other(word(class).to_owned()),
    };
    Ok(Variable { name, content })
}

/// Class of an array (`mxSTRUCT_CLASS`, and so on).
const STRUCTURE: u32 = 2;
const OPAQUE: u32 = 17;

/// MATLAB's word for a class that holds no numbers.
fn word(class: u32) -> &'static str {
    match class {
        1 => "cell",
        2 => "struct array",
        4 => "char",
        5 => "sparse",
        16 => "function_handle",
        _ => "object",
    }
}

/// The few integers that describe an array.
fn description(element: Element<'_>, order: ByteOrder) -> Result<Vec<i64>, Fault> {
    if element.data.len() > LONGEST {
        return Err(Fault("an array whose description is longer than any"));
    }
    match Numbers::of(element, order)? {
        Numbers::Integers(numbers) => Ok(numbers),
        Numbers::Doubles(_) => Err(Fault("an array that is described by no integers")),
    }
}

fn sizes(element: Element<'_>, order: ByteOrder) -> Result<Vec<usize>, Fault> {
    let sizes = description(element, order)?.into_iter();
    sizes.map(|size| usize::try_from(size).map_err(|_| Fault("a negative size"))).collect()
}

fn fields(parts: &mut Elements<'_>, memory: &Memory<'_>, depth: usize) -> Result<Vec<Variable>, Fault> {
    let length = description(parts.expect()?, parts.order)?.first().copied();
    let length = length.and_then(|length| usize::try_from(length).ok());
    let length = length.filter(|length| *length > 0).ok_or(Fault("names of fields without a length"))?;
    let names = parts.expect()?;
    if names.kind != INT8 {
        return Err(Fault("names of fields that are no text"));
    }
    let named = names.data.chunks_exact(length).map(text_of);
    named.map(|name| within(parts.expect()?, parts.order, memory, Some(name), depth)).collect()
}

/// Sizes of one do not count, as Simulink has them.
fn array(numbers: Numbers, sizes: &[usize]) -> Result<Content, Fault> {
    let count = sizes.iter().try_fold(1usize, |count, size| count.checked_mul(*size));
    if count != Some(numbers.len()) {
        return Err(Fault("an array whose sizes do not agree with its numbers"));
    }
    if numbers.len() == 0 {
        return Ok(Content::Other(EMPTY.to_owned()));
    }
    let of: Vec<usize> = sizes.iter().copied().filter(|size| *size != 1).collect();
    let (rows, columns, is_turned) = match of[..] {
        [] => (1, 1, false),
        [rows] => (rows, 1, false),
        [rows, columns] if rows >= columns => (rows, columns, false),
        [columns, rows] => (rows, columns, true),
        _ => return Ok(Content::Other(format!("array of {} dimensions", of.len()))),
    };
    Ok(Content::Array(Array { rows, columns, numbers, is_turned }))
}
