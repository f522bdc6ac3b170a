//! Constants of the compact form, and its checksum.

/// The first bytes of every compact catalogue; not valid text, so it is never read as a table.
pub(in crate::catalog) const MAGIC: [u8; 8] = *b"\x89STARCAT";
/// The version of catalogues in which every identifier is a Skymap number.
pub(super) const VERSION_SKYMAP: u32 = 1;
/// The version of all other catalogues.
pub(super) const VERSION_ANY_ID: u32 = 2;

pub(super) const HEADER_BYTES: usize = 36;
/// Without the identifier.
pub(super) const BYTES_PER_STAR: u64 = 17;
pub(super) const BYTES_PER_NAME: u64 = 5;
pub(super) const CHECKSUM_BYTES: usize = 8;
pub(super) const UNKNOWN_COLOR_MMAG: i16 = i16::MIN;

/// The checksum at the end of a compact catalogue.
pub(in crate::catalog) fn checksum_of(encoded: &[u8]) -> u64 {
    encoded
        .last_chunk()
        .map_or(0, |bytes| u64::from_le_bytes(*bytes))
}
