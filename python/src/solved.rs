//! A solved frame.

use crate::errors::{exception, guarded, see};
use pyo3::prelude::*;
use starpipe::frame::RowOrder;
use starpipe::identify::SearchFailure;
use starpipe::pipeline::{Outcome, Reason};
use starpipe::report::wcs;
use starpipe::{FrameReport, IndexedCatalog, Solution};

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
        let report = FrameReport::new(&self.name, &self.solution, self.indexed.catalog());
        Some(report.reason.unwrap_or_default() + &see(&reason.remedies()))
    }

    /// The report as the program's JSON.
    fn json(&self) -> PyResult<String> {
        guarded(|| {
            let report = FrameReport::new(&self.name, &self.solution, self.indexed.catalog());
            report.to_json_line().map_err(exception)
        })
    }

    /// The world coordinates of the rows of the report as a FITS header, or `None`.
    fn wcs_header(&self) -> PyResult<Option<Vec<u8>>> {
        guarded(|| Ok(wcs::header(&self.name, &self.solution)))
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
