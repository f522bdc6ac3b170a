//! Master darks and flats as FITS files.

use starpipe::base::size::Size;
use starpipe::frame::{CALIBRATION_CREATOR, FitsHeader, FitsSamples, Frame, write_fits};

/// The first keywords of every master's header: starpipe recognizes its masters by them.
pub(crate) fn header(kind: &str, frames: usize) -> FitsHeader {
    let mut header = FitsHeader::default();
    header.text("CREATOR", CALIBRATION_CREATOR, "");
    header.text("IMAGETYP", kind, "");
    header.integer("NCOMBINE", frames as i64, "frames");
    header
}

/// Content of a FITS file with an image of 32-bit floats.
pub(crate) fn fits_image(
    size: Size,
    pixels: &[f32],
    header: &FitsHeader,
) -> anyhow::Result<Vec<u8>> {
    let frame = Frame::new(size.width, size.height, pixels.to_vec())?;
    let mut bytes = Vec::new();
    write_fits(&mut bytes, &frame, FitsSamples::Float32, header)?;
    Ok(bytes)
}
