//! Tables of stars: comma- or tab-separated files from anywhere, and VizieR's exports.
//!
//! Text with a line of headings → stars at J2000.
//!
//! 1. [`CatalogTable`] takes the first line that is neither empty nor a comment (`#`) as headings, and the
//!    separator (tab, semicolon, bar or comma) from it. It skips lines of units and dashes under
//!    the headings, and repeated headings.
//! 2. With SKY2000's labels the columns are SKY2000's; otherwise the general columns are found from
//!    the headings (compared without case) and their units, in brackets or in a line of their own.
//! 3. Each row is parsed to a star.
//! 4. The whole is checked for swapped coordinates, and for hours read as degrees.

mod cells;
mod columns;
mod headings;
mod plausibility;
mod reader;
mod roles;
mod row;
mod sky2000;
mod votable;

#[cfg(feature = "archive")]
pub(super) use columns::GeneralColumns;
#[cfg(feature = "archive")]
pub(super) use headings::Heading;
pub(super) use reader::CatalogTable;
#[cfg(feature = "archive")]
pub(super) use row::GeneralRow;
pub(super) use votable::{VotableText, is_votable};
