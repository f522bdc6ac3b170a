//! The values of a column, some rows at a time.

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{
    ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::{ParquetError, Result};
use std::fmt::Write;

/// A column of a group of rows, of which some rows are in memory.
pub(super) trait CellColumn {
    /// Reads the next rows, in the place of those before.
    fn read(&mut self, rows: usize) -> Result<()>;
    /// Passes over the next rows.
    fn skip(&mut self, rows: usize) -> Result<()>;
    /// Whether its values are numbers, not text.
    fn has_numbers(&self) -> bool;
    /// A number; `None` where there is no finite one.
    fn number(&self, row: usize) -> Option<f64>;
    /// Adds a value as text; nothing where there is none.
    fn write(&self, row: usize, text: &mut String);
}

/// The column that a reader reads; `None` if its values are of no use here.
pub(super) fn cell_column(reader: ColumnReader, nullable: bool) -> Option<Box<dyn CellColumn>> {
    Some(match reader {
        ColumnReader::DoubleColumnReader(reader) => Typed::<DoubleType>::boxed(reader, nullable),
        ColumnReader::FloatColumnReader(reader) => Typed::<FloatType>::boxed(reader, nullable),
        ColumnReader::Int64ColumnReader(reader) => Typed::<Int64Type>::boxed(reader, nullable),
        ColumnReader::Int32ColumnReader(reader) => Typed::<Int32Type>::boxed(reader, nullable),
        ColumnReader::ByteArrayColumnReader(reader) => {
            Typed::<ByteArrayType>::boxed(reader, nullable)
        }
        _ => return None,
    })
}

/// A column with values of one type.
struct Typed<T: DataType> {
    reader: ColumnReaderImpl<T>,
    nullable: bool,
    values: Vec<T::T>,
    /// 1 for each row with a value; empty unless some have none.
    levels: Vec<i16>,
    /// The place of each row's value.
    places: Vec<Option<u32>>,
}

impl<T: DataType> Typed<T>
where
    T::T: Value + 'static,
{
    fn boxed(reader: ColumnReaderImpl<T>, nullable: bool) -> Box<dyn CellColumn> {
        Box::new(Self {
            reader,
            nullable,
            values: Vec::new(),
            levels: Vec::new(),
            places: Vec::new(),
        })
    }

    fn value(&self, row: usize) -> Option<&T::T> {
        let place = match self.nullable {
            true => (*self.places.get(row)?)? as usize,
            false => row,
        };
        self.values.get(place)
    }
}

impl<T: DataType> CellColumn for Typed<T>
where
    T::T: Value + 'static,
{
    fn read(&mut self, rows: usize) -> Result<()> {
        self.values.clear();
        self.levels.clear();
        let levels = self.nullable.then_some(&mut self.levels);
        let (read, _, _) = self
            .reader
            .read_records(rows, levels, None, &mut self.values)?;
        if read != rows || (self.nullable && self.levels.len() != rows) {
            return Err(too_short());
        }
        self.places.clear();
        let mut next = 0;
        self.places.extend(self.levels.iter().map(|&level| {
            let has_value = level > 0;
            let place = has_value.then_some(next);
            next += u32::from(has_value);
            place
        }));
        Ok(())
    }

    fn skip(&mut self, rows: usize) -> Result<()> {
        match self.reader.skip_records(rows)? == rows {
            true => Ok(()),
            false => Err(too_short()),
        }
    }

    fn has_numbers(&self) -> bool {
        T::T::IS_NUMBER
    }

    fn number(&self, row: usize) -> Option<f64> {
        self.value(row)?.number()
    }

    fn write(&self, row: usize, text: &mut String) {
        if let Some(value) = self.value(row) {
            value.write(text);
        }
    }
}

fn too_short() -> ParquetError {
    ParquetError::EOF("a column has fewer rows than the file says".to_owned())
}

/// A value of a column.
trait Value {
    /// Whether it is a number, not text.
    const IS_NUMBER: bool;
    /// As a finite number, if it is one.
    fn number(&self) -> Option<f64>;
    /// Adds it as text, a number as the shortest decimal; nothing for a number that is not finite.
    fn write(&self, text: &mut String);
}

macro_rules! number {
    ($($kind:ty)*) => {$(
        impl Value for $kind {
            const IS_NUMBER: bool = true;

            fn number(&self) -> Option<f64> {
                let number = *self as f64;
                number.is_finite().then_some(number)
            }

            fn write(&self, text: &mut String) {
                if self.number().is_some() {
                    // Writing to a string does not fail.
                    let _ = write!(text, "{self}");
                }
            }
        }
    )*};
}

number!(f64 f32 i64 i32);

impl Value for ByteArray {
    const IS_NUMBER: bool = false;

    fn number(&self) -> Option<f64> {
        None
    }

    fn write(&self, text: &mut String) {
        text.push_str(&String::from_utf8_lossy(self.data()));
    }
}
