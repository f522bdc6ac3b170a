//! Columns of tables: name, type, meaning, and the value in a row.

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

/// A type of the fields of rows.
pub trait Field {
    /// Whether there may be no value.
    const OPTIONAL: bool = false;
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
    f64 => Number, |value| *value;
    bool => Bool, |value| *value;
    String => Text, |value| value.clone();
}

impl<T: Field> Field for Option<T> {
    const OPTIONAL: bool = true;
    fn value(&self) -> FieldValue {
        self.as_ref().map_or_else(T::empty, Field::value)
    }
    fn empty() -> FieldValue {
        T::empty()
    }
}

/// An empty value of a field's type, and whether the field is optional.
pub(crate) fn type_of<R, F: Field>(_: fn(&R) -> &F) -> (FieldValue, bool) {
    (F::empty(), F::OPTIONAL)
}

/// A column of the rows `$row` from a field, with its [`Meaning`].
macro_rules! column {
    ($row:ty, $field:ident, $meaning:expr) => {{
        let (empty, is_optional) = $crate::base::table::type_of(|row: &$row| &row.$field);
        $crate::base::table::Column {
            name: stringify!($field),
            value: |row: &$row| $crate::base::table::Field::value(&row.$field),
            empty,
            is_optional,
            meaning: $meaning,
        }
    }};
}
pub(crate) use column;

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
pub(crate) use columns;
