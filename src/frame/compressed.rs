//! Files compressed with gzip or bzip2.

use super::error::FrameError;
use super::format::{FrameFormat, first_bytes};
use super::limits::MAX_FILE_BYTES;
use super::read_budget::ReadBudget;
use bzip2::read::MultiBzDecoder;
use flate2::read::MultiGzDecoder;
use std::io::{self, ErrorKind, Read};

/// Decompresses the image file in `bytes`, which is of a compressed `format`. The content is booked on
/// `budget`.
/// # Errors
/// [`FrameError::UnknownFormat`] if the content does not begin like an image, before much of it is
/// decompressed; [`FrameError::Truncated`], [`FrameError::Malformed`], [`FrameError::OutOfMemory`],
/// [`FrameError::Interrupted`].
pub(super) fn unpack(
    bytes: &[u8],
    format: FrameFormat,
    budget: &ReadBudget,
) -> Result<Vec<u8>, FrameError> {
    let (known, inside) = format_inside(bytes, format);
    if known.is_none() && !inside.is_empty() {
        let found = format!("{} inside {format}", first_bytes(&inside));
        return Err(FrameError::UnknownFormat { found });
    }
    let mut unpacked = Vec::new();
    let mut reader = budget
        .timed(decoder(bytes, format))
        .take(MAX_FILE_BYTES + 1);
    let appended = budget.append(&mut reader, &mut unpacked);
    appended.map_err(|error| match error {
        FrameError::Io(error) => damaged(&error, format, bytes.len()),
        other => other,
    })?;
    if unpacked.len() as u64 > MAX_FILE_BYTES {
        let limit = MAX_FILE_BYTES;
        return Err(FrameError::TooManyBytes { limit });
    }
    Ok(unpacked)
}

/// The error for data that cannot be decompressed.
fn damaged(error: &io::Error, format: FrameFormat, found_bytes: usize) -> FrameError {
    let detail = error.to_string();
    if error.kind() == ErrorKind::UnexpectedEof {
        FrameError::Truncated {
            format,
            found_bytes,
            detail,
        }
    } else {
        FrameError::Malformed { format, detail }
    }
}

fn decoder(bytes: &[u8], format: FrameFormat) -> Box<dyn Read + '_> {
    match format {
        FrameFormat::Bzip2 => Box::new(MultiBzDecoder::new(bytes)),
        _ => Box::new(MultiGzDecoder::new(bytes)),
    }
}

/// The format inside the compressed file that begins with `head`, and the first bytes of the content:
/// none of a large bzip2 file, whose blocks are longer. A compressed file inside counts as no format.
pub(super) fn format_inside(head: &[u8], format: FrameFormat) -> (Option<FrameFormat>, Vec<u8>) {
    const SIGNATURE_BYTES: usize = 16;
    let inside = unpack_beginning(decoder(head, format), SIGNATURE_BYTES);
    let format = FrameFormat::detect(&inside).filter(|format| !format.is_compressed());
    (format, inside)
}

/// The first `wanted` bytes, or as many as there are.
fn unpack_beginning(mut reader: impl Read, wanted: usize) -> Vec<u8> {
    let mut unpacked = vec![0; wanted];
    let mut filled = 0;
    while let Ok(read @ 1..) = reader.read(&mut unpacked[filled..]) {
        filled += read;
    }
    unpacked.truncate(filled);
    unpacked
}
