//! Columns of tables: name, type, meaning, and the value in a row.

use super::format::table_name;
use std::io;

/// The value of a field of a row; none if the field is empty.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValue {
    /// A whole number. Of unsigned ones the bits.
    Integer(Option<i64>),
    /// A number.
    Number(Option<f64>),
    /// Yes or no.
    Bool(Option<bool>),
    /// Words.
    Text(Option<String>),
}

impl FieldValue {
    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        matches!(
            self,
            Self::Integer(None) | Self::Number(None) | Self::Bool(None) | Self::Text(None)
        )
    }

    /// The text, if it is one.
    pub(crate) fn into_text(self) -> Option<String> {
        match self {
            Self::Text(text) => text,
            _ => None,
        }
    }

    /// The value as CSV has it.
    pub(crate) fn to_csv(&self) -> String {
        /// Smaller numbers have an exponent.
        const MIN_WITHOUT_EXPONENT: f64 = 1e-4;
        match self {
            Self::Integer(value) => value.map(|value| value.cast_unsigned().to_string()),
            Self::Number(value) => value.map(|value| {
                if value != 0.0 && value.abs() < MIN_WITHOUT_EXPONENT {
                    format!("{value:e}")
                } else {
                    value.to_string()
                }
            }),
            Self::Bool(value) => value.map(|value| value.to_string()),
            Self::Text(value) => value.as_deref().map(table_name),
        }
        .unwrap_or_default()
    }
}

/// Writes a row as CSV.
///
/// # Errors
/// Errors of the writer.
pub(crate) fn write_row<R, W: io::Write>(
    writer: &mut csv::Writer<W>,
    columns: &[Column<R>],
    row: &R,
) -> csv::Result<()> {
    writer.write_record(columns.iter().map(|column| (column.value)(row).to_csv()))
}

/// Rows as CSV, after the names of their columns if there is a heading.
///
/// # Errors
/// As for [`finished`], and errors of the writer.
pub fn csv_of<'r, R: TableRow + 'r>(
    rows: impl IntoIterator<Item = &'r R>,
    has_heading: bool,
) -> io::Result<String> {
    let columns = R::columns();
    let mut writer = csv::Writer::from_writer(Vec::new());
    if has_heading {
        writer.write_record(columns.iter().map(|column| column.name))?;
    }
    for row in rows {
        write_row(&mut writer, &columns, row)?;
    }
    finished(writer)
}

/// The table that `writer` has written, with names as terminals and spreadsheets may show them: on one
/// line, and no formulas ([`table_name`]).
///
/// # Errors
/// What is written not being a table of UTF-8.
pub fn finished(writer: csv::Writer<Vec<u8>>) -> io::Result<String> {
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(bytes.as_slice());
    let mut shown = csv::WriterBuilder::new()
        .flexible(true)
        .from_writer(Vec::with_capacity(bytes.len()));
    for row in rows.records() {
        shown.write_record(row?.iter().map(table_name))?;
    }
    let bytes = shown
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    String::from_utf8(bytes).map_err(io::Error::other)
}

/// What the values of a column mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Meaning {
    /// Unit, as VOTables write it; empty where there is none.
    pub unit: &'static str,
    /// Unified content descriptor of the International Virtual Observatory Alliance.
    pub ucd: &'static str,
    /// One line.
    pub description: &'static str,
}

/// A column of a table with rows `R`.
pub struct Column<R> {
    /// Its name.
    pub name: &'static str,
    /// The value in a row.
    pub value: fn(&R) -> FieldValue,
    /// An empty value of the column's type.
    pub empty: FieldValue,
    /// Whether some values may be empty.
    pub is_optional: bool,
    /// What the values mean.
    pub meaning: Meaning,
}

/// Characters of the longest text of each column.
pub(crate) fn widths<R>(columns: &[Column<R>], rows: &[R]) -> Vec<usize> {
    let width = |column: &Column<R>| {
        let texts = rows
            .iter()
            .filter_map(|row| (column.value)(row).into_text());
        texts.map(|text| text.chars().count()).max().unwrap_or(0)
    };
    columns.iter().map(width).collect()
}

/// A type of the fields of rows.
pub trait Field {
    /// Whether there may be no value.
    const OPTIONAL: bool = false;
    /// Whether it is a text, which is empty where there is none.
    const IS_TEXT: bool = false;
    /// The value of this field.
    fn value(&self) -> FieldValue;
    /// An empty value of this type.
    fn empty() -> FieldValue;
}

/// Makes types fields: how a value becomes a [`FieldValue`].
macro_rules! field {
    ($($type:ty => $kind:ident, |$value:ident| $made:expr;)*) => {$(
        impl $crate::base::table::Field for $type {
            fn value(&self) -> $crate::base::table::FieldValue {
                let $value = self;
                $crate::base::table::FieldValue::$kind(Some($made))
            }
            fn empty() -> $crate::base::table::FieldValue {
                $crate::base::table::FieldValue::$kind(None)
            }
        }
    )*};
}
pub(crate) use field;

field! {
    // Keeps the bits: a seed may have all 64 of them.
    u64 => Integer, |value| value.cast_signed();
    u32 => Integer, |value| i64::from(*value);
    f64 => Number, |value| *value;
    bool => Bool, |value| *value;
    Vec<&'static str> => Text, |value| value.join(" ");
}

impl Field for String {
    const IS_TEXT: bool = true;
    fn value(&self) -> FieldValue {
        FieldValue::Text(Some(self.clone()))
    }
    fn empty() -> FieldValue {
        FieldValue::Text(None)
    }
}

impl<T: Field> Field for Option<T> {
    const OPTIONAL: bool = !T::IS_TEXT;
    fn value(&self) -> FieldValue {
        match self {
            Some(value) => value.value(),
            None if T::IS_TEXT => FieldValue::Text(Some(String::new())),
            None => T::empty(),
        }
    }
    fn empty() -> FieldValue {
        T::empty()
    }
}

/// An empty value of a field's type, and whether the field is optional.
pub(crate) fn type_of<R, F: Field>(_: fn(&R) -> &F) -> (FieldValue, bool) {
    (F::empty(), F::OPTIONAL)
}

/// The last name of a path of fields.
macro_rules! last_name {
    ($last:ident) => {
        stringify!($last)
    };
    ($first:ident . $($rest:ident).+) => {
        $crate::base::table::last_name!($($rest).+)
    };
}
pub(crate) use last_name;

/// A column of the rows `$row` from a field, or a field of it, with its [`Meaning`].
macro_rules! column {
    ($row:ty, $($field:ident).+, $meaning:expr) => {{
        let (empty, is_optional) = $crate::base::table::type_of(|row: &$row| &row.$($field).+);
        $crate::base::table::Column {
            name: $crate::base::table::last_name!($($field).+),
            value: |row: &$row| $crate::base::table::Field::value(&row.$($field).+),
            empty,
            is_optional,
            meaning: $meaning,
        }
    }};
}
pub(crate) use column;

/// The columns of the rows `$row`: field, unit, UCD, description.
macro_rules! columns {
    ($row:ty: $($($field:ident).+, $unit:literal, $ucd:literal, $description:literal;)*) => {
        vec![$($crate::base::table::column!($row, $($field).+, $crate::base::table::Meaning {
            unit: $unit,
            ucd: $ucd,
            description: $description,
        })),*]
    };
}
pub(crate) use columns;

/// A row of a table.
pub trait TableRow: Sized {
    /// The table's name.
    const TABLE: &'static str;

    /// Its columns, in their order.
    fn columns() -> Vec<Column<Self>>;
}

/// A row of the table `$table`: each field with its unit, UCD and description; and fields that are no columns.
macro_rules! table_row {
    ($(#[$attribute:meta])* $row:ident in $table:literal {
        $($field:ident: $type:ty, $unit:literal, $ucd:literal, $description:literal;)*
    } $(and { $($(#[$about:meta])* $other:ident: $other_type:ty,)* })?) => {
        $(#[$attribute])*
        pub struct $row {
            $(
                #[doc = $description]
                pub $field: $type,
            )*
            $($($(#[$about])* pub $other: $other_type,)*)?
        }

        impl $crate::base::table::TableRow for $row {
            const TABLE: &'static str = $table;

            fn columns() -> Vec<$crate::base::table::Column<Self>> {
                $crate::base::table::columns! { Self: $($field, $unit, $ucd, $description;)* }
            }
        }
    };
}
pub(crate) use table_row;
