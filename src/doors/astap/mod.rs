//! What do callers of ASTAP state and read?
//!
//! Hints as its command line has them → [`Hints`]; [`Solution`](crate::solve::Solution) → [`Plate`], its linear
//! solution at the frame's centre → the text of `.ini`, the header of `.wcs` and of a file whose header is updated;
//! sources → [`StarList`], their half-flux diameters as `.csv`.
//!
//! Pixels are those of FITS: the centre of the first one is (1, 1), and the first row is that which ASTAP reads
//! first ([`row_order`]).
//!
//! # Reference
//! ASTAP 2022.12 (Debian) and 2026.05: what it prints and writes; its help; <https://www.hnsky.org/astap.htm>.

mod cards;
mod hfd;
mod hints;
mod ini;
mod plate;

pub use cards::solved_cards;
pub use hfd::StarList;
pub use hints::Hints;
pub use ini::{Failure, Ini};
pub use plate::{Plate, row_order};
