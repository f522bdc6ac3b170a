//! The columns of a VOTable.

use super::xml::attribute;
use crate::catalog::table::roles::{EPOCH_YEARS, epoch_in};
use quick_xml::events::BytesStart;

/// What a FIELD says about its column.
pub(super) struct Field {
    /// The name, with the unit in brackets.
    pub(super) heading: String,
    /// `None` if not known.
    pub(super) datatype: Option<Datatype>,
    pub(super) count: Count,
    /// The text of a cell without a value; empty if none is declared.
    pub(super) null: String,
    /// The beginning of its DESCRIPTION.
    pub(super) description: String,
    /// What it refers to, perhaps a coordinate system.
    reference: String,
}

impl Field {
    pub(super) fn new(tag: &BytesStart) -> Self {
        let name = match attribute(tag, "name") {
            name if name.is_empty() => attribute(tag, "ID"),
            name => name,
        };
        // Brackets would be taken for those of the unit, as in `RA(ICRS)`.
        let name = name.replace(['(', '['], "_").replace([')', ']'], "");
        let unit = attribute(tag, "unit").replace('"', "");
        let heading = match unit.as_str() {
            "" => name,
            unit => format!("{name} ({unit})"),
        };
        Self {
            heading: heading.replace(['\t', '\n', '\r', '\0'], " "),
            datatype: Datatype::parse(&attribute(tag, "datatype")),
            count: Count::parse(&attribute(tag, "arraysize")),
            null: String::new(),
            description: String::new(),
            reference: attribute(tag, "ref").into_owned(),
        }
    }

    /// Adds to the description.
    pub(super) fn describe(&mut self, text: &str) {
        const MAX_BYTES: usize = 4096;
        if self.description.len() + text.len() <= MAX_BYTES {
            self.description.push_str(text);
        }
    }

    /// The epoch of the positions in this column, as a Julian year.
    pub(super) fn epoch(&self, systems: &[CoordinateSystem]) -> Option<f64> {
        if let Some(system) = systems.iter().find(|system| system.id == self.reference) {
            return system.epoch.or_else(|| epoch_in(&self.description));
        }
        epoch_in(&self.description).or_else(|| match systems {
            // Of positions computed for 2000, the epoch is in the name.
            [only] if !self.heading.contains("2000") => only.epoch,
            _ => None,
        })
    }

    /// The bytes of a cell of fixed size.
    pub(super) fn fixed_bytes(&self) -> Option<usize> {
        match (self.datatype?, self.count) {
            (datatype, Count::Fixed(count)) => Some(datatype.bytes_of(count)),
            _ => None,
        }
    }
}

/// A coordinate system.
pub(super) struct CoordinateSystem {
    id: String,
    /// As a Julian year; `None` if not given.
    epoch: Option<f64>,
}

impl CoordinateSystem {
    pub(super) fn new(tag: &BytesStart) -> Self {
        let epoch = attribute(tag, "epoch");
        let year = epoch.trim_start_matches(['J', 'j']).parse().ok();
        Self {
            id: attribute(tag, "ID").into_owned(),
            epoch: year.filter(|year| EPOCH_YEARS.contains(year)),
        }
    }
}

/// What the items of a cell are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Datatype {
    Boolean,
    Bit,
    UnsignedByte,
    Short,
    Int,
    Long,
    Char,
    UnicodeChar,
    Float,
    Double,
    FloatComplex,
    DoubleComplex,
}

impl Datatype {
    fn parse(text: &str) -> Option<Self> {
        Some(match text {
            "boolean" => Self::Boolean,
            "bit" => Self::Bit,
            "unsignedByte" => Self::UnsignedByte,
            "short" => Self::Short,
            "int" => Self::Int,
            "long" => Self::Long,
            "char" => Self::Char,
            "unicodeChar" => Self::UnicodeChar,
            "float" => Self::Float,
            "double" => Self::Double,
            "floatComplex" => Self::FloatComplex,
            "doubleComplex" => Self::DoubleComplex,
            _ => return None,
        })
    }

    /// The bytes of so many items.
    pub(super) fn bytes_of(self, items: usize) -> usize {
        items.saturating_mul(match self {
            Self::Bit => return items.div_ceil(8),
            Self::Boolean | Self::UnsignedByte | Self::Char => 1,
            Self::Short | Self::UnicodeChar => 2,
            Self::Int | Self::Float => 4,
            Self::Long | Self::Double | Self::FloatComplex => 8,
            Self::DoubleComplex => 16,
        })
    }

    /// Whether NaN stands for no value.
    pub(super) fn is_floating(self) -> bool {
        matches!(self, Self::Float | Self::Double)
    }
}

/// The number of items of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    Fixed(usize),
    /// Given in each cell.
    Variable,
}

impl Count {
    fn parse(arraysize: &str) -> Self {
        if arraysize.ends_with('*') {
            return Self::Variable;
        }
        let sizes = arraysize.split('x').filter(|size| !size.is_empty());
        // What is not a number makes the cell too large to be read.
        let sizes = sizes.map(|size| size.trim().parse().unwrap_or(usize::MAX));
        Self::Fixed(sizes.fold(1, usize::saturating_mul))
    }
}
