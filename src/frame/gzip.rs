//! Files compressed with gzip.

use super::{FrameError, FrameFormat, MAX_PIXELS, first_bytes, format_inside};
use flate2::read::MultiGzDecoder;
use std::io::{ErrorKind, Read};

/// The most bytes that may be in one: the largest frame in 64-bit floats, and some headers.
const MAX_UNPACKED_BYTES: u64 = MAX_PIXELS as u64 * 8 + (1 << 24);

/// The image file in the file `bytes`.
/// # Errors
/// [`FrameError::UnknownFormat`] if what is inside does not begin like one, before much of it is unpacked;
/// [`FrameError::Truncated`], [`FrameError::Malformed`].
pub(super) fn unpack(bytes: &[u8]) -> Result<Vec<u8>, FrameError> {
    let format = FrameFormat::Gzip;
    let (known, inside) = format_inside(bytes);
    if known.is_none() && !inside.is_empty() {
        let found = format!("{} inside gzip", first_bytes(&inside));
        return Err(FrameError::UnknownFormat { found });
    }
    let mut unpacked = Vec::new();
    let mut reader = MultiGzDecoder::new(bytes).take(MAX_UNPACKED_BYTES);
    reader.read_to_end(&mut unpacked).map_err(|e| {
        let detail = e.to_string();
        if e.kind() == ErrorKind::UnexpectedEof {
            let found_bytes = bytes.len();
            FrameError::Truncated {
                format,
                found_bytes,
                detail,
            }
        } else {
            FrameError::Malformed { format, detail }
        }
    })?;
    if unpacked.len() as u64 == MAX_UNPACKED_BYTES {
        return Err(FrameError::Malformed {
            format,
            detail: format!("found {MAX_UNPACKED_BYTES} bytes or more in it, expected fewer"),
        });
    }
    Ok(unpacked)
}

/// As many bytes from the beginning of the file of which `head` is the beginning as can be had from it.
pub(super) fn unpack_beginning(head: &[u8], wanted: usize) -> Vec<u8> {
    let mut reader = MultiGzDecoder::new(head);
    let mut unpacked = vec![0; wanted];
    let mut filled = 0;
    while let Ok(read @ 1..) = reader.read(&mut unpacked[filled..]) {
        filled += read;
    }
    unpacked.truncate(filled);
    unpacked
}
