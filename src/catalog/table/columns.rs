//! The columns of a general table.

use super::headings::{Heading, HeadingUnit, find_column};
use super::roles::{Epoch, IdColumns, MagnitudeColumns, MotionColumns, PositionColumns};
#[cfg(feature = "archive")]
use crate::catalog::Band;
use crate::catalog::error::RecordLocation;
use std::sync::atomic::{AtomicBool, Ordering};

/// The columns of a table by what they hold.
pub(in crate::catalog) struct GeneralColumns {
    /// The headings as in the file.
    pub(super) texts: Vec<String>,
    pub(super) id: IdColumns,
    pub(super) name: Option<usize>,
    pub(super) position: PositionColumns,
    pub(super) magnitude: MagnitudeColumns,
    pub(super) b_minus_v: Option<usize>,
    pub(super) motion: Option<MotionColumns>,
    pub(super) epoch: Epoch,
    /// An angle was sexagesimal, so its unit is certain.
    pub(super) sexagesimal_seen: AtomicBool,
}

impl GeneralColumns {
    /// Finds the columns from `headings`. `note_of` gives what the file says about a column. Without identifiers, a star
    /// may be called by its place in tables of Gaia, and in others that may lack them.
    ///
    /// # Errors
    /// The missing columns; none if the table does not seem to be one of stars.
    pub(in crate::catalog) fn find(
        headings: &[Heading],
        note_of: impl Fn(&str) -> Option<String>,
        may_lack_ids: bool,
    ) -> Result<Self, Vec<&'static str>> {
        let magnitude = MagnitudeColumns::find(headings);
        let is_of_gaia = magnitude
            .as_ref()
            .is_some_and(MagnitudeColumns::are_of_gaia);
        let id = IdColumns::find(headings, is_of_gaia, may_lack_ids)
            .ok_or("of identifiers (id, name, hip, tyc, source_id, ...)");
        let position = PositionColumns::find(headings)
            .ok_or("of right ascensions and declinations (ra and dec, raj2000 and dej2000, ...)");
        let magnitude = magnitude.ok_or("of magnitudes (vmag, mag, vtmag, phot_g_mean_mag, ...)");
        let (id, position, magnitude) = match (id, position, magnitude) {
            (Ok(id), Ok(position), Ok(magnitude)) => (id, position, magnitude),
            (_, Err(_), Err(_)) => return Err(Vec::new()),
            (id, position, magnitude) => {
                let missing = [id.err(), position.err(), magnitude.err()];
                return Err(missing.into_iter().flatten().collect());
            }
        };
        let ra = &headings[position.ra.cell];
        let note = note_of(&ra.text).unwrap_or_default();
        let epoch = Epoch::find(headings, ra, &note, is_of_gaia);
        let name = find_column(headings, "name proper");
        Ok(Self {
            texts: headings
                .iter()
                .map(|heading| heading.text.clone())
                .collect(),
            name: name.filter(|cell| !id.cells.contains(cell)),
            id,
            position,
            magnitude,
            b_minus_v: find_column(headings, "b-v b_v bv b_minus_v"),
            motion: MotionColumns::find(headings),
            epoch,
            sexagesimal_seen: AtomicBool::new(false),
        })
    }

    /// The columns used, for people.
    pub(in crate::catalog) fn description(&self) -> String {
        let text = |cell: usize| self.texts[cell].as_str();
        let id: Vec<&str> = self.id.cells.iter().map(|&cell| text(cell)).collect();
        let motion = match &self.motion {
            Some(motion) => format!("proper motion {} and {}", text(motion.ra), text(motion.dec)),
            None => "no proper motion".to_owned(),
        };
        let epoch = match self.epoch {
            Epoch::Column(cell) => format!("epoch {}", text(cell)),
            Epoch::Year(year) => format!("epoch J{year}"),
        };
        let id = if id.is_empty() {
            "the place".to_owned()
        } else {
            id.join("-")
        };
        format!(
            "identifier {id}, position {} and {}, {}, {motion}, {epoch}",
            text(self.position.ra.cell),
            text(self.position.dec.cell),
            self.magnitude.description(text),
        )
    }

    /// Where in a row the identifier is, and its heading.
    pub(in crate::catalog) fn id_location(&self) -> (RecordLocation, String) {
        let cell = self
            .id
            .cells
            .first()
            .copied()
            .unwrap_or(self.position.ra.cell);
        (RecordLocation::Column(cell + 1), self.texts[cell].clone())
    }

    /// Whether all right ascensions are decimal numbers, read as degrees.
    pub(super) fn has_decimal_degrees(&self) -> bool {
        let decimal = !self.sexagesimal_seen.load(Ordering::Relaxed);
        decimal && matches!(self.position.ra.unit, None | Some(HeadingUnit::Degrees))
    }
}

/// What readers of other tables than text ask.
#[cfg(feature = "archive")]
impl GeneralColumns {
    /// The cells of which a star is made, its name left out; some may be there twice.
    pub fn used_cells(&self) -> Vec<usize> {
        let mut cells = self.id.cells.clone();
        cells.extend([self.position.ra.cell, self.position.dec.cell]);
        match self.magnitude {
            MagnitudeColumns::Johnson { observed, derived } => {
                cells.push(observed);
                cells.extend(derived);
            }
            MagnitudeColumns::Tycho { bt, vt } => {
                cells.push(vt);
                cells.extend(bt);
            }
            MagnitudeColumns::Gaia { g, color } => {
                cells.push(g);
                cells.extend(color.cells());
            }
            MagnitudeColumns::Approximate { cell, .. } => cells.push(cell),
        }
        cells.extend(self.b_minus_v);
        if let Some(motion) = &self.motion {
            cells.extend([motion.ra, motion.dec]);
        }
        cells.extend(self.epoch_cell());
        cells
    }

    /// The cells of right ascension and declination, and the degrees in the unit of their numbers.
    pub fn position_cells(&self) -> [(usize, f64); 2] {
        [&self.position.ra, &self.position.dec].map(|column| {
            let unit = column.unit.unwrap_or(HeadingUnit::Degrees);
            (column.cell, unit.to_degrees(1.0))
        })
    }

    /// The headings as in the file.
    pub fn texts(&self) -> &[String] {
        &self.texts
    }

    /// The bands of the magnitudes.
    pub const fn band(&self) -> Band {
        self.magnitude.band()
    }

    /// The cell of the epoch, if each row has its own.
    pub const fn epoch_cell(&self) -> Option<usize> {
        match self.epoch {
            Epoch::Column(cell) => Some(cell),
            Epoch::Year(_) => None,
        }
    }

    /// The epoch of all rows, if they have the same.
    pub const fn epoch_year(&self) -> Option<f64> {
        match self.epoch {
            Epoch::Column(_) => None,
            Epoch::Year(year) => Some(year),
        }
    }
}
