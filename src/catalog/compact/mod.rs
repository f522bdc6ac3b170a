//! The compact form: a whole catalogue in 21 or 22 bytes a star, decoded in milliseconds.
//!
//! All numbers are little-endian. In order, without gaps (n stars, m names):
//!
//! | Bytes | Content |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | version, `u32`: 1 or 2 |
//! | 4, 4 | n and m, `u32` each |
//! | 4, 4 | bytes of the title and of all names, `u32` each |
//! | 8 | epoch of the positions, Julian year, `f64` |
//! | … | title, UTF-8 |
//! | 4 n | Skymap number, `u32` (version 1); or identifier, see below (version 2) |
//! | 4 n | right ascension, 0.5 mas, `u32` |
//! | 4 n | declination, 0.5 mas, `i32` |
//! | 2 n | proper motion in right ascension times cos(declination), mas a year, `i16` |
//! | 2 n | proper motion in declination, mas a year, `i16` |
//! | 2 n | V, 0.001 mag, `i16` |
//! | 2 n | B−V, 0.001 mag, `i16`; −32768 where unknown |
//! | n | flags ([`StarFlags`](super::StarFlags)) |
//! | 4 m | index of the named star, `u32`, ascending |
//! | m | bytes of the name, `u8` |
//! | … | the names, UTF-8, concatenated |
//! | 8 | XXH3-64 of everything before, `u64` |
//!
//! Version 1 holds Skymap numbers only. In version 2 the identifiers are: bytes per value, `u32`, 4
//! or 8; n bytes, the kind of each identifier (0 Skymap, 1 Tycho, 2 Hipparcos, 3 another number, 4
//! name only, 5 Gaia, 6 a place); n values. A Tycho value is the region, star and component in 14, 14 and 4 bits; a
//! Hipparcos value is the number and, in the low 8 bits, the letter of the component; a place is the right
//! ascension in steps of 0.01 s, above 32 bits with the declination from the south pole in steps of 0.1″.
//!
//! Columns rather than records, because they compress better and are checked column by column.
//! Stars are ordered by (V, identifier).
//!
//! Caveat: proper motions are rounded to 1 mas a year, 13 mas after 26 years. Positions, magnitudes
//! and colors of SKY2000 are kept exactly.

mod decode;
mod encode;
mod identifiers;
mod layout;
mod reader;

pub(super) use decode::{CompactSummary, decode};
pub(super) use encode::encode;
pub(super) use layout::{MAGIC, checksum_of};
pub(super) use reader::{ByteReader, invalid};

#[cfg(test)]
mod tests;
