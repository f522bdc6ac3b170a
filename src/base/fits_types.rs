//! Types of the cells of binary tables in FITS.
//!
//! # Reference
//! FITS Standard 4.0 (2018), table 18.

/// Size of an element with this code of `TFORM`, in bytes; `None` for bits and for what is no code.
pub fn element_bytes(code: u8) -> Option<usize> {
    Some(match code {
        b'L' | b'B' | b'A' => 1,
        b'I' => 2,
        b'J' | b'E' => 4,
        b'K' | b'D' | b'C' | b'P' => 8,
        b'M' | b'Q' => 16,
        _ => return None,
    })
}
