//! What does `solve-field` of astrometry.net print, and what is in its files?
//!
//! [`Solution`](crate::solve::Solution) → the [`lines`] that its callers read; a FITS image and a header → the
//! image [`with_coordinates`]. Its tables are those of [`tables`](crate::report::tables).
//!
//! # Reference
//! astrometry.net 0.93: `solve-field.c`, `new-wcs.c`.

mod c_format;
mod lines;
mod new_fits;

pub use lines::{Names, lines};
pub use new_fits::with_coordinates;
