//! An open file of Parquet.

use super::cells::{CellColumn, cell_column};
use super::guard::guarded;
use super::layout::Layout;
use super::reach::{Extent, Reach};
use super::rows::{Group, Rows};
use crate::base::files;
use crate::base::interrupt::Interrupt;
use crate::catalog::Star;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::region::Region;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::statistics::Statistics;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// An open file.
pub(super) struct OpenTable {
    reader: SerializedFileReader<File>,
    pub(super) layout: Layout,
}

impl OpenTable {
    /// Opens a file.
    pub(super) fn open(path: &Path) -> Result<Self, Damage> {
        let mut file = files::open(path)?;
        check_ends(&mut file)?;
        let reader = guarded(|| SerializedFileReader::new(file))?;
        let metadata = reader.metadata();
        let layout = Layout::find(metadata.file_metadata().schema_descr())?;
        for group in metadata.row_groups() {
            check_group(group, &layout)?;
        }
        Ok(Self { reader, layout })
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> u64 {
        let groups = self.reader.metadata().row_groups().iter();
        groups.map(rows_of).sum()
    }

    /// The epoch of the positions: the one of the table, or of its first row.
    pub(super) fn epoch_year(&self) -> Option<f64> {
        let columns = &self.layout.columns;
        let Some(cell) = columns.epoch_cell() else {
            return columns.epoch_year();
        };
        let read = || {
            let group = self.reader.get_row_group(0)?;
            let mut column = column_of(&*group, *self.layout.leaves.get(cell).unwrap_or(&0))?;
            column.read(1)?;
            Ok(column.number(0))
        };
        // A table without rows has no epoch.
        guarded(read).ok().flatten()
    }

    /// Calls `add` with the stars that may lie in a region, and some around it.
    pub(super) fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        let reach = Reach::of(region);
        let mut rows = Rows::new(&self.layout);
        let mut first_row = 0;
        for (index, metadata) in self.reader.metadata().row_groups().iter().enumerate() {
            let count = rows_of(metadata);
            if self.may_meet(&reach, metadata) {
                let mut group = self.group(index, first_row, count)?;
                rows.read(&mut group, &reach, interrupt, add)?;
            }
            first_row += count;
        }
        rows.check()
    }

    /// Calls `visit` with right ascension and declination of every row that has them as numbers, in degrees.
    pub(super) fn for_each_position(&self, visit: &mut dyn FnMut(f64, f64)) -> Result<(), Damage> {
        const ROWS_AT_ONCE: u64 = 1 << 13;
        let [ra, dec] = self.layout.columns.position_cells();
        let leaf = |cell: usize| self.layout.leaves.get(cell).copied().unwrap_or_default();
        for (index, metadata) in self.reader.metadata().row_groups().iter().enumerate() {
            let open = || {
                let group = self.reader.get_row_group(index)?;
                let ras = column_of(&*group, leaf(ra.0))?;
                Ok((ras, column_of(&*group, leaf(dec.0))?))
            };
            let (mut ras, mut decs) = guarded(open)?;
            let mut left = rows_of(metadata);
            while left > 0 {
                let count = left.min(ROWS_AT_ONCE) as usize;
                guarded(|| ras.read(count).and_then(|()| decs.read(count)))?;
                for row in 0..count {
                    if let (Some(ra_number), Some(dec_number)) = (ras.number(row), decs.number(row))
                    {
                        visit(ra_number * ra.1, dec_number * dec.1);
                    }
                }
                left -= count as u64;
            }
        }
        Ok(())
    }

    /// Whether rows of a group may lie in a region.
    fn may_meet(&self, reach: &Reach, group: &RowGroupMetaData) -> bool {
        let [ra, dec] = self
            .layout
            .columns
            .position_cells()
            .map(|(cell, unit_deg)| {
                let leaf = *self.layout.leaves.get(cell)?;
                let [least, greatest] = extent(group.columns().get(leaf)?.statistics()?)?;
                Some([least * unit_deg, greatest * unit_deg])
            });
        reach.may_meet(ra, dec)
    }

    /// The columns in use of a group of rows.
    fn group(&self, index: usize, first_row: u64, rows: u64) -> Result<Group, Damage> {
        let positions = self.layout.columns.position_cells();
        guarded(|| {
            let reader = self.reader.get_row_group(index)?;
            let mut group = Group::new(first_row, rows);
            for (cell, leaf) in self.layout.used() {
                let column = column_of(&*reader, leaf)?;
                match positions
                    .iter()
                    .any(|(of_position, _)| *of_position == cell)
                {
                    true => group.positions.push((cell, column)),
                    false => group.others.push((cell, column)),
                }
            }
            Ok(group)
        })
    }
}

fn column_of(group: &dyn RowGroupReader, leaf: usize) -> ParquetResult<Box<dyn CellColumn>> {
    let descriptor = group.metadata().schema_descr().column(leaf);
    let nullable = descriptor.max_def_level() > 0;
    let column = cell_column(group.get_column_reader(leaf)?, nullable);
    column.ok_or_else(|| ParquetError::General("a column has another type".to_owned()))
}

fn rows_of(group: &RowGroupMetaData) -> u64 {
    u64::try_from(group.num_rows()).unwrap_or(0)
}

/// Checks what the file says of itself, before memory is taken for it.
fn check_ends(file: &mut File) -> Result<(), Damage> {
    /// A catalogue of the whole sky in one file has a tenth of it.
    const DIRECTORY_BYTES_MAX: u64 = 1 << 28;
    const ENDING: u64 = 8;
    let length = file.metadata()?.len();
    if length < 3 * ENDING / 2 {
        return Err(Damage::Truncated);
    }
    file.seek(SeekFrom::Start(length - ENDING))?;
    let mut ending = [0; ENDING as usize];
    file.read_exact(&mut ending)?;
    let [a, b, c, d, magic @ ..] = ending;
    if &magic == b"PARE" {
        return Err(Damage::Unsupported("encrypted columns".to_owned()));
    }
    if &magic != b"PAR1" {
        return Err(Damage::Truncated);
    }
    let directory = u64::from(u32::from_le_bytes([a, b, c, d]));
    if directory + ENDING > length || directory > DIRECTORY_BYTES_MAX {
        let found = format!("its list of columns has {directory} bytes");
        return Err(Damage::Invalid(found));
    }
    Ok(())
}

/// Checks the sizes of the columns in use.
fn check_group(group: &RowGroupMetaData, layout: &Layout) -> Result<(), Damage> {
    const COLUMN_BYTES_MAX: i64 = 1 << 33;
    let invalid = |found: &str| Err(Damage::Invalid(found.to_owned()));
    if group.num_rows() < 0 {
        return invalid("a group of rows has fewer than none");
    }
    for (_, leaf) in layout.used() {
        let Some(column) = group.columns().get(leaf) else {
            return invalid("a group of rows lacks a column");
        };
        let sizes = [column.compressed_size(), column.uncompressed_size()];
        if sizes
            .iter()
            .any(|size| !(0..COLUMN_BYTES_MAX).contains(size))
        {
            return invalid("a column is larger than 8 GB, or has fewer bytes than none");
        }
    }
    Ok(())
}

/// The least and the greatest number of a column.
fn extent(statistics: &Statistics) -> Extent {
    let (least, greatest) = match statistics {
        Statistics::Double(found) => (*found.min_opt()?, *found.max_opt()?),
        Statistics::Float(found) => (f64::from(*found.min_opt()?), f64::from(*found.max_opt()?)),
        Statistics::Int64(found) => (*found.min_opt()? as f64, *found.max_opt()? as f64),
        Statistics::Int32(found) => (f64::from(*found.min_opt()?), f64::from(*found.max_opt()?)),
        _ => return None,
    };
    // Also where one is not a number.
    (least <= greatest).then_some([least, greatest])
}
