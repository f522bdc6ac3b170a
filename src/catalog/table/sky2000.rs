//! SKY2000's columns in a table.

use super::cells::unquoted;
use super::columns::GeneralColumns;
use super::headings::Heading;
use crate::catalog::StarId;
use crate::catalog::error::RecordLocation;
use crate::catalog::import::{NamedStar, Parsed};
use crate::catalog::sky2000::{
    COLUMN_COUNT, FIXED_COLUMNS, POSITION, Sky2000Record, StarColumn, required_columns,
};
use std::borrow::Cow;

/// SKY2000's columns in a table.
pub(super) struct Sky2000Columns {
    /// The cell of each [`StarColumn`].
    cell_of: [Option<usize>; COLUMN_COUNT],
    /// The identifier is only a record number.
    id_is_record_number: bool,
}

impl Sky2000Columns {
    /// Finds the columns; `None` if `labels` are not SKY2000's.
    ///
    /// # Errors
    /// The labels of missing columns.
    pub(super) fn find(labels: &[Cow<str>]) -> Option<Result<Self, Vec<&'static str>>> {
        let position = |wanted: &str| labels.iter().position(|label| unquoted(label) == wanted);
        let mut cell_of = FIXED_COLUMNS.map(|column| position(column.label));
        let parts = POSITION.iter();
        let parts = parts.filter(|&&part| cell_of[part as usize].is_some());
        let parts = parts.count();
        // Other catalogues have one or two of these labels, or some beside another position.
        if parts < 3 || (parts < POSITION.len() && has_other_position(labels)) {
            return None;
        }
        let id = &mut cell_of[StarColumn::Id as usize];
        *id = id.or_else(|| position("Skymap"));
        let record_number = position("recno").filter(|_| id.is_none());
        *id = id.or(record_number);
        let missing: Vec<&str> = required_columns()
            .filter(|&column| cell_of[column as usize].is_none())
            .map(StarColumn::label)
            .collect();
        Some(if missing.is_empty() {
            Ok(Self {
                cell_of,
                id_is_record_number: record_number.is_some(),
            })
        } else {
            Err(missing)
        })
    }

    /// The location of a column in a row.
    pub(super) fn location_of(&self, column: StarColumn) -> RecordLocation {
        RecordLocation::Column(self.cell_of[column as usize].map_or(0, |cell| cell + 1))
    }

    pub(super) fn parse(&self, line: u64, cells: &[Cow<str>]) -> Parsed<NamedStar> {
        let record = Sky2000Record {
            line,
            cells: self
                .cell_of
                .map(|cell| cell.map_or(&[][..], |cell| cells[cell].as_bytes())),
            location_of: &|column| self.location_of(column),
        };
        let (mut star, name) = record.parse()?;
        if self.id_is_record_number
            && let StarId::Skymap(number) = star.id
        {
            star.id = StarId::Number(u64::from(number));
        }
        Ok((star, name))
    }
}

fn has_other_position(labels: &[Cow<str>]) -> bool {
    let headings: Vec<Heading> = labels.iter().map(|label| Heading::new(label, "")).collect();
    GeneralColumns::find(&headings, |_| None, false).is_ok()
}
