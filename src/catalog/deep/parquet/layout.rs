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
    /// The cell, after those of the file, that has the number of the row: in tables without identifiers.
    pub(super) row_cell: Option<usize>,
    /// Whether identifiers without a catalogue are Gaia's.
    pub(super) has_gaia_ids: bool,
}

impl Layout {
    /// # Errors
    /// [`Damage::NoColumns`].
    pub(super) fn find(schema: &SchemaDescriptor) -> Result<Self, Damage> {
        let columns = schema.columns().iter().enumerate();
        let columns = columns.filter(|(_, column)| has_cells(column));
        let (leaves, mut headings): (Vec<usize>, Vec<Heading>) = columns
            .map(|(leaf, column)| (leaf, Heading::new(column.name(), "")))
            .unzip();
        let has = |headings: &[Heading], labels: &[&str]| {
            let known = |heading: &Heading| labels.contains(&heading.label());
            headings.iter().any(known)
        };
        let is_gaia = has(&headings, &["gmag", "phot_g_mean_mag"]);
        let note_of = |label: &str| {
            let is_of_release = ["ra", "ra_icrs"].contains(&label.to_ascii_lowercase().as_str());
            // Without a column of epochs: that of the third release.
            (is_gaia && is_of_release).then(|| "Ep=2016.0".to_owned())
        };
        let mut row_cell = None;
        let mut found = GeneralColumns::find(&headings, note_of);
        if found.is_err() {
            row_cell = Some(headings.len());
            headings.push(Heading::new("recno", ""));
            found = GeneralColumns::find(&headings, note_of);
        }
        let columns = found.map_err(|mut missing| {
            if missing.is_empty() {
                missing.push("of positions and magnitudes of stars");
            }
            Damage::NoColumns(missing.join(" and "))
        })?;
        let id = columns.id_location().1;
        Ok(Self {
            columns,
            leaves,
            row_cell,
            has_gaia_ids: is_gaia && id.eq_ignore_ascii_case("source"),
        })
    }

    /// The names of the columns.
    pub(super) fn names(&self) -> &[String] {
        self.columns.texts()
    }

    /// The cells of which a star is made that are columns of the file, and those columns.
    pub(super) fn used(&self) -> impl Iterator<Item = (usize, usize)> {
        let mut cells = self.columns.used_cells();
        cells.sort_unstable();
        cells.dedup();
        let leaf = |cell: usize| Some((cell, *self.leaves.get(cell)?));
        cells.into_iter().filter_map(leaf)
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
