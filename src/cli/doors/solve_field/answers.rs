//! The lines and the files of an input.

use super::job::{Content, Job};
use crate::cli::output::files::{NewFile, failures};
use crate::cli::solving::SolvedImage;
use starpipe::base::files;
use starpipe::catalog::Catalog;
use starpipe::doors::FitsFileHeader;
use starpipe::doors::solve_field::{Names, lines};
use starpipe::frame::ImageName;
use starpipe::report::{FrameReport, tables, wcs};
use std::path::Path;

/// Larger images are copied as they were read.
const MAX_IMAGE_BYTES: u64 = 1 << 31;
/// What `.solved` files have.
const SOLVED: [u8; 1] = [1];

/// What is left to do for an input.
pub(super) struct Answer {
    pub(super) lines: String,
    /// Why files of it could not be made or written.
    pub(super) failures: Vec<anyhow::Error>,
}

impl Answer {
    /// Makes the lines of an image, and writes the files of its job, with distortions of this order at most.
    pub(super) fn new(
        image: &ImageName,
        solved: &SolvedImage,
        job: Option<&Job>,
        max_order: usize,
        catalog: &Catalog,
    ) -> Self {
        let solution = &solved.solution;
        let outputs = job.map_or(&[][..], |job| &job.outputs);
        let path_of = |wanted: Content| {
            let output = outputs.iter().find(|(content, _)| *content == wanted);
            output.map(|(_, path)| path.display().to_string())
        };
        let mark = path_of(Content::Solved);
        let input = image.to_string();
        let new_fits = path_of(Content::NewFits).filter(|_| solved.frame.is_some());
        let names = Names {
            input: &input,
            solved: mark.as_deref(),
            new_fits: new_fits.as_deref(),
        };
        let lines = lines(solution, &names);
        let report = FrameReport::new(&input, solution, catalog);
        let header = wcs::header_to_order(&input, solution, max_order);
        let content = |content: Content| match (content, &header) {
            (Content::Sources, _) => {
                let table = tables::stars(&report, solution, tables::TableFormat::Axy);
                Ok(Some(table))
            }
            (_, None) => Ok(None),
            (Content::Table(format), _) => Ok(Some(tables::stars(&report, solution, format))),
            (Content::Wcs, Some(header)) => Ok(Some(header.clone())),
            (Content::NewFits, Some(header)) => new_image(image.path, solved, header),
            (Content::Solved, _) => Ok(Some(SOLVED.to_vec())),
        };
        let made = outputs.iter().filter_map(|(of, path)| {
            let content = content(*of).transpose()?;
            Some(content.map(|content| -> NewFile { (path.clone(), content) }))
        });
        let failures = failures(made);
        Self { lines, failures }
    }
}

/// The image with the coordinates of `header`: a FITS image with its own cards, others as they were read.
fn new_image(path: &Path, solved: &SolvedImage, header: &[u8]) -> anyhow::Result<Option<Vec<u8>>> {
    let Some((frame, header)) = solved.frame.as_ref().zip(FitsFileHeader::of_file(header)) else {
        return Ok(None);
    };
    let own = files::read(path, MAX_IMAGE_BYTES).ok();
    if let Some(copy) = own.and_then(|own| with_coordinates(&own, &header)) {
        return Ok(Some(copy));
    }
    let stored = frame.clone().as_stored();
    let row_order = solved.solution.row_order.unwrap_or_default();
    let name = path.display().to_string();
    let copy = wcs::solved_copy(&name, &stored, &solved.solution, row_order)?;
    Ok(copy.and_then(|copy| with_coordinates(&copy, &header)))
}

/// The file with the coordinates of `header`; `None` where its first header has no image, or it is no FITS file.
fn with_coordinates(file: &[u8], header: &FitsFileHeader) -> Option<Vec<u8>> {
    let own = FitsFileHeader::of_file(file).filter(FitsFileHeader::has_image)?;
    Some(own.with_coordinates_of(file, header))
}
