//! Master frames as FITS files.

use starpipe::frame::{CALIBRATION_CREATOR, FitsHeader, FitsSamples, Frame, write_fits};

/// The beginning of the header of every master: it is known by it.
pub(crate) fn header(kind: &str, frames: usize) -> FitsHeader {
    let mut header = FitsHeader::default();
    header.text("CREATOR", CALIBRATION_CREATOR, "");
    header.text("IMAGETYP", kind, "");
    header.integer("NCOMBINE", frames as i64, "frames");
    header
}

/// The bytes of an image of floats.
pub(crate) fn image(
    (width, height): (usize, usize),
    pixels: &[f32],
    header: &FitsHeader,
) -> anyhow::Result<Vec<u8>> {
    let frame = Frame::new(width, height, pixels.to_vec())?;
    let mut bytes = Vec::new();
    write_fits(&mut bytes, &frame, FitsSamples::Float32, header)?;
    Ok(bytes)
}
