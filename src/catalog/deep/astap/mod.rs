//! The star databases of ASTAP and HNSKY: files of small areas of the sky, with positions of 0.08″ and
//! magnitudes of 0.1.
//!
//! Proper motions are already in the positions, to the epoch that the text in each file states. They are
//! taken for those of J2000: of most stars they differ by less than the exactness of the files.
//!
//! # Reference
//! The description of the formats in the help of HNSKY, and the programs of their author (han-k59/astap,
//! `unit_star_database.pas`; Debian's package astap, `star_database_creation`).

mod database;
mod records;
mod tiling;
mod wide;

pub use database::AreaDatabase;
pub use wide::WideDatabase;
