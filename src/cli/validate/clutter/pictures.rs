//! Writes frames of a study, to be looked at.

use crate::cli::exit::CommandError;
use crate::cli::output::files::write_into;
use starpipe::frame::{TiffOptions, TiffSamples, write_tiff};
use starpipe::identify::IndexedCatalog;
use starpipe::lab::clutter::{ClutterKind, ClutterProtocol, FrameMaker};
use std::io::Cursor;
use std::path::Path;

/// Frames of each kind that are written.
const MAX_FRAMES: u64 = 20;

/// Writes the first frames of each kind into `directory`, as KIND-NUMBER.tif. Returns whether
/// all are written.
pub(super) fn write(
    directory: &Path,
    kinds: &[ClutterKind],
    protocol: &ClutterProtocol,
    indexed: &IndexedCatalog,
) -> Result<bool, CommandError> {
    let mut all_written = true;
    for kind in kinds {
        let mut files = Vec::new();
        let maker = FrameMaker::new(*kind, &protocol.setup, indexed)?;
        for number in 0..protocol.frames.min(MAX_FRAMES) {
            let made = maker.frame(protocol.seed, number)?;
            let name = format!("{}-{number:05}.tif", kind.name());
            let is_8_bit = made.frame.saturation_adu.is_some_and(|most| most <= 255.0);
            let mut options = TiffOptions::new(if is_8_bit {
                TiffSamples::Unsigned8
            } else {
                TiffSamples::Unsigned16
            });
            options.compressed = true;
            options.description = kind.name();
            let mut content = Cursor::new(Vec::new());
            write_tiff(&mut content, &made.frame, &options)?;
            files.push(Ok((name, content.into_inner())));
        }
        all_written &= write_into(directory, files);
    }
    Ok(all_written)
}
