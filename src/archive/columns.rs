//! Columns with what they mean.

/// The columns of the rows `$row`: field, unit, UCD, description.
macro_rules! columns {
    ($row:ty: $($field:ident, $unit:literal, $ucd:literal, $description:literal;)*) => {
        vec![$($crate::base::table::column!($row, $field, $crate::base::table::Meaning {
            unit: $unit,
            ucd: $ucd,
            description: $description,
        })),*]
    };
}
pub(super) use columns;
