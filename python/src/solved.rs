//! A solved frame.

use crate::errors::{exception, guarded, see};
use crate::input::{Borrowed, Input};
use crate::interrupt::on_this_thread;
use crate::pages::buffers;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use starpipe::frame::{Colors, RowOrder};
use starpipe::identify::SearchFailure;
use starpipe::report::overlay::{OverlayOptions, Shown};
use starpipe::report::{page, regions, wcs};
use starpipe::solve::{Outcome, Reason};
use starpipe::{Frame, FrameReport, IndexedCatalog, Interrupt, Solution};
use std::path::Path;

/// A solved frame. Its report is made when it is asked for.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Solved {
    pub name: String,
    pub solution: Solution,
    /// Order of the rows in the file, if it is one.
    pub row_order: Option<RowOrder>,
    pub indexed: &'static IndexedCatalog<'static>,
}

#[pymethods]
impl Solved {
    /// Whether the stars are identified.
    #[getter]
    fn identified(&self) -> bool {
        matches!(self.solution.outcome, Outcome::Identified(_))
    }

    /// Why there was no answer in time, if so.
    #[getter]
    fn timeout(&self) -> Option<String> {
        let reason = match &self.solution.outcome {
            Outcome::NotIdentified(reason @ Reason::Search(SearchFailure::Interrupted)) => reason,
            _ => return None,
        };
        let report = self.report();
        Some(report.reason.unwrap_or_default() + &see(&reason.remedies()))
    }

    /// The report as the program's JSON.
    fn json(&self) -> PyResult<String> {
        guarded(|| self.report().to_json_line().map_err(exception))
    }

    /// The world coordinates of the rows of the report as a FITS header, or `None`.
    fn wcs_header(&self) -> PyResult<Option<Vec<u8>>> {
        guarded(|| Ok(wcs::header(&self.name, &self.solution)))
    }

    /// The page of the frame, in HTML; without `frame`, without its picture.
    fn page(&self, py: Python<'_>, frame: Option<Input<'_>>) -> PyResult<String> {
        let input = frame.as_ref().map(Input::borrow).transpose()?;
        on_this_thread(py, |interrupt| {
            let read = input
                .map(|input| self.shown(input, interrupt))
                .transpose()?;
            let title = Path::new(&self.name).file_name();
            let title = title.map_or(self.name.as_str().into(), |name| name.to_string_lossy());
            let shown = read.as_ref().map(|(frame, colors)| {
                let mut shown = Shown::new(&title, frame);
                shown.colors = colors.as_ref();
                shown
            });
            let options = OverlayOptions::default();
            let catalog = self.indexed.catalog();
            page::html(
                &self.report(),
                &self.solution,
                catalog,
                shown.as_ref(),
                &options,
            )
            .map_err(exception)
        })
    }

    /// The detections as regions for SAOImage DS9.
    fn regions(&self) -> PyResult<String> {
        guarded(|| Ok(regions::ds9(&self.report())))
    }

    /// A copy of `frame` as FITS, with its rows as stored and its coordinates; `None` where it is not
    /// identified.
    fn fits_copy(&self, py: Python<'_>, frame: Input<'_>) -> PyResult<Option<Vec<u8>>> {
        let input = frame.borrow()?;
        on_this_thread(py, |interrupt| {
            let (frame, _) = self.shown(input, interrupt)?;
            let row_order = self.row_order.unwrap_or_default();
            wcs::solved_copy(&self.name, &frame, &self.solution, row_order).map_err(exception)
        })
    }

    /// ROWORDER of the file, if it is one.
    #[getter]
    fn row_order(&self) -> Option<&'static str> {
        self.row_order.map(RowOrder::keyword_value)
    }

    /// The covariance of small rotations about the camera's axes, in rad², row by row.
    fn attitude_covariance_rad2(&self) -> Option<[[f64; 3]; 3]> {
        match &self.solution.outcome {
            Outcome::Identified(found) => Some(found.attitude_covariance_rad2.into()),
            Outcome::NotIdentified(_) => None,
        }
    }
}

impl Solved {
    fn report(&self) -> FrameReport {
        FrameReport::new(&self.name, &self.solution, self.indexed.catalog())
    }

    /// The frame that was solved, or another picture of its size.
    fn shown<'a>(
        &self,
        input: Borrowed<'a>,
        interrupt: &Interrupt,
    ) -> PyResult<(Frame<'a>, Option<Colors>)> {
        let (frame, colors) = input.shown(&mut buffers(interrupt))?;
        let Solution { width, height, .. } = self.solution;
        if (frame.width, frame.height) != (width, height) {
            return Err(PyValueError::new_err(format!(
                "the image is {} x {} pixels, the frame {width} x {height}",
                frame.width, frame.height
            )));
        }
        Ok((frame, colors))
    }
}
