//! Rows in the encodings BINARY and BINARY2, in base64.

use super::cells::{Line, MAX_ROW_BYTES, boolean, too_large};
use super::fields::{Count, Datatype, Field};
use super::xml::{Xml, invalid};
use base64::Engine;
use base64::engine::general_purpose::STANDARD_PAD_INDIFFERENT as BASE64;
use std::fmt::{Display, Write as _};
use std::io;

/// Reads rows out of the text of a STREAM.
#[derive(Default)]
pub(super) struct BinaryRows {
    /// Each row begins with a flag for each cell that has no value: BINARY2.
    pub(super) has_null_flags: bool,
    bytes: Base64Text,
    flags: Vec<u8>,
    cell: String,
}

impl BinaryRows {
    /// # Errors
    /// A column is of a type that is not known, or the rows have no bytes.
    pub(super) fn new(fields: &[Field], has_null_flags: bool) -> io::Result<Self> {
        if let Some(field) = fields.iter().find(|field| field.datatype.is_none()) {
            let message = format!("the datatype of {} is not known", field.heading);
            return Err(invalid(message));
        }
        if fields.iter().all(|field| field.fixed_bytes() == Some(0)) {
            return Err(invalid("the rows of the VOTable have no bytes"));
        }
        Ok(Self {
            has_null_flags,
            ..Self::default()
        })
    }

    /// Reads a row to `line`; `false` if there is none.
    pub(super) fn next(
        &mut self,
        xml: &mut Xml,
        fields: &[Field],
        line: &mut Line,
    ) -> io::Result<bool> {
        if !self.bytes.has(xml, 1)? {
            return Ok(false);
        }
        self.flags.clear();
        if self.has_null_flags {
            let flags = self.bytes.take(xml, fields.len().div_ceil(8))?;
            self.flags.extend_from_slice(flags);
        }
        for (cell, field) in fields.iter().enumerate() {
            let count = match field.count {
                Count::Fixed(count) => count,
                Count::Variable => {
                    let count = self.bytes.take(xml, 4)?;
                    integer(count).try_into().map_err(|_| too_large())?
                }
            };
            let datatype = field.datatype.unwrap_or(Datatype::Char);
            let bytes = self.bytes.take(xml, datatype.bytes_of(count))?;
            let flags = self.flags.get(cell / 8);
            self.cell.clear();
            if flags.is_none_or(|flags| flags << (cell % 8) & 0x80 == 0) {
                write_items(&mut self.cell, datatype, bytes, count);
            }
            line.push_value(fields, &self.cell)?;
        }
        Ok(true)
    }
}

/// Writes the items of a cell, with blanks between them.
fn write_items(text: &mut String, datatype: Datatype, bytes: &[u8], count: usize) {
    let mut list = List { text };
    match datatype {
        Datatype::Char => {
            let end = bytes.iter().position(|&byte| byte == 0);
            let bytes = &bytes[..end.unwrap_or(bytes.len())];
            list.text.push_str(&String::from_utf8_lossy(bytes));
        }
        Datatype::UnicodeChar => {
            let units = bytes.as_chunks().0.iter().copied().map(u16::from_be_bytes);
            let letters = char::decode_utf16(units.take_while(|&unit| unit != 0));
            let letters = letters.map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
            list.text.extend(letters);
        }
        Datatype::Bit => (0..count).for_each(|bit| {
            let byte = bytes.get(bit / 8).copied().unwrap_or_default();
            list.push(byte >> (7 - bit % 8) & 1);
        }),
        Datatype::Boolean => {
            { bytes.iter() }.for_each(|byte| list.push(boolean(&char::from(*byte).to_string())))
        }
        Datatype::UnsignedByte => bytes.iter().for_each(|byte| list.push(byte)),
        Datatype::Short => {
            { bytes.as_chunks().0.iter() }.for_each(|bytes| list.push(i16::from_be_bytes(*bytes)))
        }
        Datatype::Int => {
            { bytes.as_chunks().0.iter() }.for_each(|bytes| list.push(i32::from_be_bytes(*bytes)))
        }
        Datatype::Long => {
            { bytes.as_chunks().0.iter() }.for_each(|bytes| list.push(i64::from_be_bytes(*bytes)))
        }
        Datatype::Float | Datatype::FloatComplex => { bytes.as_chunks().0.iter() }
            .for_each(|bytes| list.push_number(f32::from_be_bytes(*bytes))),
        Datatype::Double | Datatype::DoubleComplex => { bytes.as_chunks().0.iter() }
            .for_each(|bytes| list.push_number(f64::from_be_bytes(*bytes))),
    }
}

/// A list with blanks between the items.
struct List<'t> {
    text: &'t mut String,
}

impl List<'_> {
    fn push(&mut self, item: impl Display) {
        if !self.text.is_empty() {
            self.text.push(' ');
        }
        // Writing to a text does not fail.
        let _ = write!(self.text, "{item}");
    }

    /// Adds a floating-point number in as few digits as give it again.
    fn push_number<T: Display + std::fmt::LowerExp + Copy + Into<f64>>(&mut self, number: T) {
        let size = number.into().abs();
        if size != 0.0 && size.is_finite() && !(1e-5..1e16).contains(&size) {
            self.push(format_args!("{number:e}"));
        } else {
            self.push(number);
        }
    }
}

/// The unsigned integer in `bytes`, the highest first.
fn integer(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0, |sum, &byte| sum << 8 | u64::from(byte))
}

/// The bytes that a text is in base64.
#[derive(Default)]
struct Base64Text {
    /// Letters that were not decoded yet.
    letters: Vec<u8>,
    /// Bytes decoded, and how many of them were taken.
    bytes: Vec<u8>,
    taken: usize,
    is_ended: bool,
}

impl Base64Text {
    /// The next `count` bytes.
    fn take(&mut self, xml: &mut Xml, count: usize) -> io::Result<&[u8]> {
        if count > MAX_ROW_BYTES {
            return Err(too_large());
        }
        if !self.has(xml, count)? {
            let message = "the VOTable is cut off: its STREAM ends within a row";
            return Err(invalid(message));
        }
        let start = self.taken;
        self.taken += count;
        Ok(&self.bytes[start..self.taken])
    }

    /// Whether there are `count` more bytes.
    fn has(&mut self, xml: &mut Xml, count: usize) -> io::Result<bool> {
        while self.bytes.len() - self.taken < count {
            if self.is_ended {
                return Ok(false);
            }
            self.is_ended = !xml.read_text(&mut self.letters)?;
            let whole = if self.is_ended {
                self.letters.len()
            } else {
                self.letters.len() / 4 * 4
            };
            self.bytes.drain(..self.taken);
            self.taken = 0;
            let decoded = BASE64.decode_vec(&self.letters[..whole], &mut self.bytes);
            decoded.map_err(|error| invalid(format!("damaged base64 in the STREAM: {error}")))?;
            self.letters.drain(..whole);
        }
        Ok(true)
    }
}
