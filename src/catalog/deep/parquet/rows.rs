//! The stars of groups of rows.

use super::cells::CellColumn;
use super::guard::guarded;
use super::layout::Layout;
use super::reach::Reach;
use crate::base::interrupt::Interrupt;
use crate::catalog::deep::error::Damage;
use crate::catalog::import::Rejection;
use crate::catalog::table::GeneralRow;
use crate::catalog::{PlaceId, Star, StarId};
use std::borrow::Cow;

/// Rows that are in memory at once.
const ROWS_AT_ONCE: u64 = 1 << 13;

/// A column, and its cell.
type Column = (usize, Box<dyn CellColumn>);

/// The columns in use of a group of rows.
pub(super) struct Group {
    first_row: u64,
    rows: u64,
    pub(super) positions: Vec<Column>,
    pub(super) others: Vec<Column>,
}

impl Group {
    pub(super) fn new(first_row: u64, rows: u64) -> Self {
        Self {
            first_row,
            rows,
            positions: Vec::new(),
            others: Vec::new(),
        }
    }
}

/// A star with an identifier that no other file gives: that of a name is the number of its row.
fn identified(star: Star) -> Star {
    let id = match star.id {
        StarId::Named(_) => StarId::Place(PlaceId::of(&star.direction)),
        id => id,
    };
    Star { id, ..star }
}

/// Makes stars of rows.
pub(super) struct Rows<'a> {
    layout: &'a Layout,
    /// Of one row; its strings are used again.
    cells: Vec<Cow<'static, str>>,
    parsed: u64,
    unreadable: u64,
    /// The first defect.
    defect: Option<String>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(layout: &'a Layout) -> Self {
        Self {
            layout,
            cells: vec![Cow::Borrowed(""); layout.leaves.len()],
            parsed: 0,
            unreadable: 0,
            defect: None,
        }
    }

    /// Calls `add` with the stars of a group that may lie in a region.
    pub(super) fn read(
        &mut self,
        group: &mut Group,
        reach: &Reach,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        let mut chosen: Vec<usize> = Vec::new();
        // Rows that the other columns are behind.
        let mut behind = 0;
        let mut at = 0;
        while at < group.rows {
            interrupt.check().map_err(|_| Damage::Interrupted)?;
            let count = (group.rows - at).min(ROWS_AT_ONCE) as usize;
            guarded(|| {
                let mut columns = group.positions.iter_mut();
                columns.try_for_each(|(_, column)| column.read(count))
            })?;
            chosen.clear();
            let near = |row: &usize| self.may_lie_in(reach, &group.positions, *row);
            chosen.extend((0..count).filter(near));
            if chosen.is_empty() {
                behind += count;
            } else {
                guarded(|| {
                    group.others.iter_mut().try_for_each(|(_, column)| {
                        column.skip(behind)?;
                        column.read(count)
                    })
                })?;
                behind = 0;
                for &row in &chosen {
                    let number = group.first_row + at + row as u64 + 1;
                    self.fill(group, row);
                    self.parse(number, add);
                }
            }
            at += count as u64;
        }
        Ok(())
    }

    /// Whether a row's position may lie in a region. Without one it does not.
    fn may_lie_in(&self, reach: &Reach, positions: &[Column], row: usize) -> bool {
        let [ra, dec] = self
            .layout
            .columns
            .position_cells()
            .map(|(cell, unit_deg)| {
                let column = positions.iter().find(|(of, _)| *of == cell);
                let column = column.map(|(_, column)| column);
                match column {
                    Some(column) if column.has_numbers() => {
                        column.number(row).map(|number| number * unit_deg)
                    }
                    // Text: only parsing tells.
                    _ => Some(f64::NAN),
                }
            });
        matches!((ra, dec), (Some(ra), Some(dec)) if reach.may_have(ra, dec))
    }

    /// Fills the cells with a row.
    fn fill(&mut self, group: &Group, row: usize) {
        for (cell, column) in group.positions.iter().chain(&group.others) {
            if let Some(cell) = self.cells.get_mut(*cell) {
                let text = cell.to_mut();
                text.clear();
                column.write(row, text);
            }
        }
    }

    fn parse(&mut self, number: u64, add: &mut dyn FnMut(Star)) {
        let row = GeneralRow {
            columns: &self.layout.columns,
            line: number,
            cells: &self.cells,
        };
        self.parsed += 1;
        match row.star() {
            Ok((star, _)) => add(identified(star)),
            Err(rejection) => {
                if let Rejection::Unreadable(error) = *rejection {
                    self.unreadable += 1;
                    self.defect.get_or_insert_with(|| error.to_string());
                }
            }
        }
    }

    /// Refuses a file of which more than 1 % of the rows cannot be read.
    pub(super) fn check(&self) -> Result<(), Damage> {
        /// As many may be unreadable of a few rows: a region may have no more.
        const FEW: u64 = 20;
        let Self {
            parsed, unreadable, ..
        } = *self;
        let is_much = unreadable * 100 > parsed && (unreadable > FEW || unreadable == parsed);
        match &self.defect {
            Some(defect) if is_much => Err(Damage::Invalid(format!(
                "{unreadable} of {parsed} rows cannot be read, first {defect}"
            ))),
            _ => Ok(()),
        }
    }
}
