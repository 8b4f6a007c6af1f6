//! Data elements of a MAT-file of level 5: tags, and the numbers behind them.
//!
//! Source: MathWorks, "MAT-File Format", R2023, chapter 1, "Level 5 MAT-File Format".

/// Bytes that a MAT-file does not have; says what is wrong with them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fault(pub(super) &'static str);

/// In which order the bytes of a number stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// Type of an element (`miCOMPRESSED`, and so on).
pub(super) const INT8: u32 = 1;
pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// One element: its type and its data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element<'a> {
    pub(super) kind: u32,
    pub(super) data: &'a [u8],
}

/// Elements one after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elements<'a> {
    pub(super) order: ByteOrder,
    rest: &'a [u8],
}

impl<'a> Elements<'a> {
    pub(super) fn new(order: ByteOrder, bytes: &'a [u8]) -> Self {
        Self { order, rest: bytes }
    }

    /// The next element; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Element<'a>>, Fault> {
        let Some((&tag, behind)) = self.rest.split_first_chunk::<4>() else {
            return Ok(None);
        };
        let tag = self.number(tag);
        // Of up to four bytes size and data stand in the tag.
        if tag >> 16 != 0 {
            let (kind, size) = (tag & 0xffff, (tag >> 16) as usize);
            let (field, rest) = behind.split_first_chunk::<4>().ok_or(ENDS_EARLY)?;
            self.rest = rest;
            let data = field.get(..size).ok_or(Fault("a short element of more than four bytes"))?;
            return Ok(Some(Element { kind, data }));
        }
        let (&size, behind) = behind.split_first_chunk::<4>().ok_or(ENDS_EARLY)?;
        let size = self.number(size) as usize;
        let (data, rest) = behind.split_at_checked(size).ok_or(ENDS_EARLY)?;
        // What is not compressed begins at multiples of eight.
        let padding = if tag == COMPRESSED { 0 } else { size.next_multiple_of(8) - size };
        self.rest = rest.get(padding..).unwrap_or_default();
        Ok(Some(Element { kind: tag, data }))
    }

    /// The next element, which has to be there.
    pub(super) fn expect(&mut self) -> Result<Element<'a>, Fault> {
        self.next()?.ok_or(ENDS_EARLY)
    }

    /// A text of bytes.
    pub(super) fn text(&mut self) -> Result<String, Fault> {
        let Element { data, .. } = self.expect()?;
        Ok(text_of(data))
    }

    fn number(&self, bytes: [u8; 4]) -> u32 {
        match self.order {
            ByteOrder::Little => u32::from_le_bytes(bytes),
            ByteOrder::Big => u32::from_be_bytes(bytes),
        }
    }
}

const ENDS_EARLY: Fault = Fault("an element that ends beyond the file");

/// A text that ends at its first zero, as a terminal can show it.
pub(super) fn text_of(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).replace(char::is_control, "?")
}

/// Numbers as they are stored: integers are exact.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Numbers {
    Integers(Vec<i64>),
    Doubles(Vec<f64>),
}

impl Numbers {
    /// The numbers of an element, of any type of numbers. An array of doubles that are integers may be stored as such.
    pub(super) fn of(element: Element<'_>, order: ByteOrder) -> Result<Self, Fault> {
        let Element { kind, data } = element;
        Ok(match kind {
            1 => Self::Integers(each(data, order, |bytes| i8::from_le_bytes(bytes).into())),
            2 => Self::Integers(each(data, order, |bytes| u8::from_le_bytes(bytes).into())),
            3 => Self::Integers(each(data, order, |bytes| i16::from_le_bytes(bytes).into())),
            4 => Self::Integers(each(data, order, |bytes| u16::from_le_bytes(bytes).into())),
            5 => Self::Integers(each(data, order, |bytes| i32::from_le_bytes(bytes).into())),
            6 => Self::Integers(each(data, order, |bytes| u32::from_le_bytes(bytes).into())),
            7 => Self::Doubles(each(data, order, |bytes| f32::from_le_bytes(bytes).into())),
            9 => Self::Doubles(each(data, order, f64::from_le_bytes)),
            12 => Self::Integers(each(data, order, i64::from_le_bytes)),
            13 => {
                let numbers = each(data, order, u64::from_le_bytes);
                let exact = numbers.iter().map(|number| i64::try_from(*number)).collect();
                match exact {
                    Ok(integers) => Self::Integers(integers),
                    Err(_) => Self::Doubles(numbers.into_iter().map(|number| number as f64).collect()),
                }
            }
            _ => return Err(Fault("numbers of an unknown type")),
        })
    }

    /// Bytes that the numbers of an element take in memory.
    pub(super) fn size_of(element: Element<'_>) -> u64 {
        let width = match element.kind {
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => 1,
        };
        (element.data.len() / width * size_of::<f64>()) as u64
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::Integers(numbers) => numbers.len(),
            Self::Doubles(numbers) => numbers.len(),
        }
    }

    /// Every `step`-th number from `first` on, `count` of them.
    pub(super) fn every(&self, first: usize, step: usize, count: usize) -> Self {
        fn picked<V: Copy>(all: &[V], first: usize, step: usize, count: usize) -> Vec<V> {
            all.iter().skip(first).step_by(step.max(1)).take(count).copied().collect()
        }
        match self {
            Self::Integers(numbers) => Self::Integers(picked(numbers, first, step, count)),
            Self::Doubles(numbers) => Self::Doubles(picked(numbers, first, step, count)),
        }
    }

    /// Each as a text, with the fewest digits that say it.
    pub(super) fn texts(&self) -> Vec<String> {
        match self {
            Self::Integers(numbers) => numbers.iter().map(i64::to_string).collect(),
            Self::Doubles(numbers) => numbers.iter().map(f64::to_string).collect(),
        }
    }

    /// Each as a double.
    pub(super) fn doubles(&self) -> Vec<f64> {
        match self {
            Self::Integers(numbers) => numbers.iter().map(|number| *number as f64).collect(),
            Self::Doubles(numbers) => numbers.clone(),
        }
    }
}

/// Each number of `N` bytes, which `value` makes of them from the least one on.
fn each<const N: usize, V>(data: &[u8], order: ByteOrder, value: impl Fn([u8; N]) -> V) -> Vec<V> {
    let (numbers, _) = data.as_chunks::<N>();
    let ordered = |mut bytes: [u8; N]| {
        if order == ByteOrder::Big {
            bytes.reverse();
        }
        bytes
    };
    numbers.iter().map(|bytes| value(ordered(*bytes))).collect()
}
