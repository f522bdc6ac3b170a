//! Tycho-2 as the CDS distributes it: one star a line, fields separated by bars.
//!
//! `tyc2.dat` (whole, or in the twenty parts `tyc2.dat.00` to `.19`) and the supplements
//! `suppl_1.dat`, `suppl_2.dat` → stars at J2000.
//!
//! - The identifier is the TYC number. A component of a Hipparcos double star in a supplement
//!   shares its TYC number with a star of the main catalogue, so it has its Hipparcos number and
//!   letter.
//! - V and B−V are converted from BT and VT (or Hp, which replaces VT in a supplement), and flagged
//!   as derived.
//! - The mean position is used. Where it is that of the photocentre of two entries (`P`), each has
//!   its own observed position, moved by the common proper motion, so that no two stars coincide.
//!   Where there is none (`X`), the observed position is used, and the proper motion is unknown.
//! - Positions of the supplements, at J1991.25, are moved to J2000 where the proper motion is
//!   known.
//!
//! # Reference
//! Høg et al. 2000, A&A 355, L27 (CDS I/259, whose description gives layout and magnitudes).

mod johnson;
mod layout;
mod record;

pub(super) use johnson::johnson;
pub(super) use layout::Tycho2;

use super::error::RecordLocation;
use super::import::{NamedStar, Parsed, Row, RowParser};
use record::Tycho2Record;

impl RowParser for Tycho2 {
    fn catalog(&self) -> Option<&'static str> {
        Some("Tycho-2 Catalogue")
    }

    fn kind(&self) -> String {
        let part = match self {
            Self::Main => "main catalog",
            Self::Supplement1 => "supplement 1",
            Self::Supplement2 => "supplement 2",
        };
        format!("Tycho-2, {part}")
    }

    fn id_location(&self) -> (RecordLocation, String) {
        (RecordLocation::Byte(1), layout::ID.label.to_owned())
    }

    fn parse(&self, row: Row) -> Parsed<NamedStar> {
        let star = Tycho2Record::split(*self, row)?.star()?;
        Ok((star, None))
    }
}
