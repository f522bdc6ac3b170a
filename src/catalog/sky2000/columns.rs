//! The columns of a SKY2000 record.

/// A column of the fixed-width record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::catalog) struct FixedColumn {
    /// The label of the published format description.
    pub(in crate::catalog) label: &'static str,
    /// First byte, from 1.
    pub(super) first_byte: usize,
    /// Last byte, included.
    last_byte: usize,
}

impl FixedColumn {
    pub(super) const fn new(label: &'static str, first_byte: usize, last_byte: usize) -> Self {
        Self {
            label,
            first_byte,
            last_byte,
        }
    }

    /// The column's bytes in `record`, which is of full length.
    pub(super) fn cut<'a>(&self, record: &'a [u8]) -> &'a [u8] {
        &record[self.first_byte - 1..self.last_byte]
    }
}

/// The columns that a star is made of, as indices of [`FIXED_COLUMNS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::catalog) enum StarColumn {
    Id,
    Name,
    VariableName,
    RaH,
    RaM,
    RaS,
    DecSign,
    DecD,
    DecM,
    DecS,
    BlendedPosition,
    PmRa,
    PmDec,
    VObserved,
    VDerived,
    BlendedV,
    BMinusV,
    Separation,
    MagDifference,
    MaximumMag,
    MinimumMag,
    Amplitude,
    VariableType,
}

/// The number of columns that a star is made of.
pub(in crate::catalog) const COLUMN_COUNT: usize = 23;

/// Each [`StarColumn`] in a fixed-width record.
pub(in crate::catalog) const FIXED_COLUMNS: [FixedColumn; COLUMN_COUNT] = [
    FixedColumn::new("ID", 28, 35),
    FixedColumn::new("Name", 99, 108),
    FixedColumn::new("Vname", 109, 118),
    FixedColumn::new("RAh", 119, 120),
    FixedColumn::new("RAm", 121, 122),
    FixedColumn::new("RAs", 123, 129),
    FixedColumn::new("DE-", 130, 130),
    FixedColumn::new("DEd", 131, 132),
    FixedColumn::new("DEm", 133, 134),
    FixedColumn::new("DEs", 135, 140),
    FixedColumn::new("f_pos", 147, 147),
    FixedColumn::new("pmRA", 150, 157),
    FixedColumn::new("pmDE", 158, 165),
    FixedColumn::new("Vmag", 233, 238),
    FixedColumn::new("Vder", 239, 243),
    FixedColumn::new("f_Vmag", 249, 249),
    FixedColumn::new("B-V", 259, 264),
    FixedColumn::new("sep", 342, 348),
    FixedColumn::new("Dmag", 349, 353),
    FixedColumn::new("magMax", 412, 416),
    FixedColumn::new("magMin", 417, 421),
    FixedColumn::new("varAmp", 422, 426),
    FixedColumn::new("varTyp", 444, 446),
];

impl StarColumn {
    /// The column in a fixed-width record.
    pub(super) const fn fixed(self) -> FixedColumn {
        FIXED_COLUMNS[self as usize]
    }

    /// The label of the published format description.
    pub(in crate::catalog) const fn label(self) -> &'static str {
        self.fixed().label
    }
}

/// The columns of the position.
pub(in crate::catalog) const POSITION: [StarColumn; 7] = [
    StarColumn::RaH,
    StarColumn::RaM,
    StarColumn::RaS,
    StarColumn::DecSign,
    StarColumn::DecD,
    StarColumn::DecM,
    StarColumn::DecS,
];

/// The columns that a table must have.
pub(in crate::catalog) fn required_columns() -> impl Iterator<Item = StarColumn> {
    let (first, last) = ([StarColumn::Id], [StarColumn::VObserved]);
    first.into_iter().chain(POSITION).chain(last)
}
