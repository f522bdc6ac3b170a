//! Which stars are in a catalogue, and which of them are near a direction?
//!
//! A catalogue file or directory of any kind below → [`Catalog`]; its stars →
//! [`sky_grid::SkyGrid`].
//!
//! Conventions: positions are ICRS at epoch J2000.0; proper motions are in milliarcseconds a year,
//! that in right ascension times cos(declination); magnitudes are Johnson V. Stars are ordered by
//! magnitude, then identifier, so the stars brighter than a limit are a prefix.
//!
//! 1. [`Catalog::built_in`] decodes the embedded SKY2000.
//! 2. [`Catalog::read`] reads any file or directory; its kind is detected from the content.
//! 3. [`read()`] and [`import()`] also report what became of each record.
//! 4. [`Catalog::write_compact`] and [`sky2000::write_bright_csv`] write files that others read.
//!
//! # Kinds
//! All may be compressed with gzip.
//!
//! - The compact form, which is read fastest.
//! - SKY2000, version 4 or 5, in fixed-width records of 520 bytes.
//! - Tycho-2 as the CDS distributes it, `tyc2.dat` (whole or in parts) and the supplements: a file,
//!   or a directory, of which all parts and supplement 1 are read together. Supplement 2, whose
//!   entries are probably not stars, is read only if it is named.
//! - A table with SKY2000's column labels, as [`sky2000::write_bright_csv`] or VizieR write it.
//! - Any other table with headings, columns in any order, separated by commas, semicolons, bars or
//!   tabs: an identifier (`id`, `hip`, `tyc`, `source_id`, `name`, …), a position (`ra` and `dec`,
//!   `raj2000` and `dej2000`, …; in degrees, in hours where the heading or a line of units says so,
//!   or sexagesimal like `05:34:48.0`, `05 34 48.0`, `05h34m48.0s`), a magnitude (Johnson V
//!   preferred to VT, VT to any other) and optionally proper motion (`pmra`, `pmdec`) and epoch
//!   (`ref_epoch`, `epoch`, or the epoch in VizieR's comments). [`SourceFile::kind`] reports the
//!   columns used.
//! - Such a table as a VOTable of an archive, VizieR or TOPCAT, with its rows in TABLEDATA, BINARY
//!   or BINARY2. The epoch is also taken from its coordinate system.
//! - A directory with one file of any other kind.
//!
//! A valid record without a position or a magnitude gives no star; a record that cannot be parsed,
//! or repeats an identifier, is unreadable. Both are counted; a file of which more than 1 % is
//! unreadable is rejected.
//!
//! Caveats: SKY2000 is complete to V ≈ 8.5 for all purposes, to 9 for most, and half complete at V
//! = 10. Its Skymap number is an opaque key, which disagrees with the position of one star in a
//! hundred. A star's V may be that of a pair ([`StarFlags::BLENDED_MAGNITUDE`]). Magnitudes of
//! other systems than Johnson's approximate V ([`StarFlags::DERIVED_MAGNITUDE`]).
//!
//! # Reference
//! Myers, Sande, Miller, Warren, Tracewell 2001, SKY2000 Catalog, Version 4 (CDS V/109); 2006,
//! Version 5 (CDS V/145); NASA Goddard Space Flight Center, Flight Dynamics Division.

mod band;
mod bayer;
pub(crate) mod boundaries;
mod compact;
mod contents;
pub mod deep;
mod error;
mod folder;
mod gaia;
mod id;
mod import;
mod numbers;
#[cfg(feature = "overlay")]
pub(crate) mod objects;
mod parts;
mod place_id;
mod position;
mod proper_names;
mod read;
#[doc(hidden)]
pub mod sky2000;
pub(crate) mod sky_cells;
#[doc(hidden)]
pub mod sky_grid;
mod star;
mod star_catalog;
mod table;
mod tycho2;

pub use band::Band;
pub use error::CatalogError;
pub use error::{CompactError, RecordError, RecordLocation};
pub use id::{HipparcosId, StarId, TychoId};
pub use import::{ImportSummary, LoadedCatalog, SourceFile};
pub use numbers::StarNumbers;
pub use place_id::PlaceId;
pub use read::read_until;
pub use read::{import, read};
pub use star::{Star, StarFlags, StarIndex};
pub use star_catalog::Catalog;
