//! The detections of a frame as a table that other programs read.
//!
//! ([`FrameReport`], [`Solution`]) → bytes. Nothing is read or written.
//!
//! - FITS, VOTable, ECSV: the columns of [`StarRow`].
//! - `.corr`, `.rdls`, `.axy`: the tables of astrometry.net.

mod astrometry_net;
mod ecsv;
mod fits_table;
#[doc(hidden)]
pub mod votable;

use super::{FrameReport, StarRow};
use crate::base::table::TableRow;
use crate::solve::Solution;

/// The kind of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableFormat {
    /// A binary table of FITS.
    Fits,
    /// A VOTable of the International Virtual Observatory Alliance.
    VoTable,
    /// Enhanced CSV, as astropy writes it.
    Ecsv,
    /// The pairs of detections and stars, as astrometry.net writes them.
    Corr,
    /// The directions of the identified stars, as astrometry.net writes them.
    Rdls,
    /// The places of the detections, as astrometry.net writes them.
    #[doc(hidden)]
    Axy,
    /// Where the identified stars are expected, as astrometry.net writes it.
    #[doc(hidden)]
    IndexXyls,
    /// How good the identification is, as astrometry.net writes it.
    #[doc(hidden)]
    Match,
}

impl TableFormat {
    /// The extension of its files.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Fits => "stars.fits",
            Self::VoTable => "stars.vot",
            Self::Ecsv => "stars.ecsv",
            Self::Corr => "corr",
            Self::Rdls => "rdls",
            Self::Axy => "axy",
            Self::IndexXyls => "xyls",
            Self::Match => "match",
        }
    }
}

/// The table of a frame's detections, brightest first.
pub fn stars(report: &FrameReport, solution: &Solution, format: TableFormat) -> Vec<u8> {
    let columns = StarRow::columns();
    let rows = || StarRow::of_frame(report).collect::<Vec<_>>();
    match format {
        TableFormat::Fits => fits_table::file("STARS", &columns, &rows()),
        TableFormat::VoTable => votable::document("stars", &columns, &rows()).into_bytes(),
        TableFormat::Ecsv => ecsv::document(&columns, &rows()).into_bytes(),
        TableFormat::Corr => astrometry_net::corr(report, solution),
        TableFormat::Rdls => astrometry_net::rdls(report),
        TableFormat::Axy => astrometry_net::axy(report, solution),
        TableFormat::IndexXyls => astrometry_net::index_xyls(report, solution),
        TableFormat::Match => astrometry_net::matched(report, solution),
    }
}

/// Whether the file that begins with `head` is a VOTable or ECSV written by starpipe.
pub fn is_text_table(head: &[u8]) -> bool {
    [votable::MARK, ecsv::MARK]
        .iter()
        .any(|mark| memchr::memmem::find(head, mark.as_bytes()).is_some())
}

#[cfg(test)]
mod tests;
