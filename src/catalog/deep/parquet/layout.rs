//! Which columns of a file a star is made of.

use crate::catalog::deep::error::Damage;
use crate::catalog::table::{GeneralColumns, Heading};
use parquet::basic::{ConvertedType, LogicalType, Type as PhysicalType};
use parquet::schema::types::{ColumnDescriptor, SchemaDescriptor};

/// The columns of a file by what they hold.
pub(super) struct Layout {
    pub(super) columns: GeneralColumns,
    /// The file's column for each cell of a row.
    pub(super) leaves: Vec<usize>,
}

impl Layout {
    /// # Errors
    /// [`Damage::NoColumns`].
    pub(super) fn find(schema: &SchemaDescriptor) -> Result<Self, Damage> {
        let columns = schema.columns().iter().enumerate();
        let columns = columns.filter(|(_, column)| has_cells(column));
        let (leaves, headings): (Vec<usize>, Vec<Heading>) = columns
            .map(|(leaf, column)| (leaf, Heading::new(column.name(), "")))
            .unzip();
        let found = GeneralColumns::find(&headings, |_| None, true);
        let columns = found.map_err(|mut missing| {
            if missing.is_empty() {
                missing.push("of positions and magnitudes of stars");
            }
            Damage::NoColumns(missing.join(" and "))
        })?;
        Ok(Self { columns, leaves })
    }

    /// The names of the columns.
    pub(super) fn names(&self) -> &[String] {
        self.columns.texts()
    }

    /// The cells of which a star is made, and their columns of the file.
    pub(super) fn used(&self) -> impl Iterator<Item = (usize, usize)> {
        let mut cells = self.columns.used_cells();
        cells.sort_unstable();
        cells.dedup();
        cells.into_iter().map(|cell| (cell, self.leaves[cell]))
    }
}

/// Whether a column has one value a row, a number or text.
fn has_cells(column: &ColumnDescriptor) -> bool {
    let is_flat = column.path().parts().len() == 1
        && column.max_rep_level() == 0
        && column.max_def_level() <= 1;
    let is_scaled = column.converted_type() == ConvertedType::DECIMAL
        || matches!(column.logical_type_ref(), Some(LogicalType::Decimal { .. }));
    let is_known = matches!(
        column.physical_type(),
        PhysicalType::DOUBLE
            | PhysicalType::FLOAT
            | PhysicalType::INT64
            | PhysicalType::INT32
            | PhysicalType::BYTE_ARRAY
    );
    is_flat && is_known && !is_scaled
}
