//! A solved frame.

use crate::errors::exception;
use pyo3::prelude::*;
use starpipe::frame::RowOrder;
use starpipe::pipeline::Outcome;
use starpipe::report::wcs;
use starpipe::{FrameReport, IndexedCatalog, Solution};

/// A solved frame. Its report is made when it is asked for.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Solved {
    pub name: String,
    pub solution: Solution,
    pub indexed: &'static IndexedCatalog<'static>,
}

#[pymethods]
impl Solved {
    /// Whether the stars are identified.
    #[getter]
    fn identified(&self) -> bool {
        matches!(self.solution.outcome, Outcome::Identified(_))
    }

    /// The report as the program's JSON.
    fn json(&self) -> PyResult<String> {
        let report = FrameReport::new(&self.name, &self.solution, self.indexed.catalog());
        report.to_json_line().map_err(exception)
    }

    /// The world coordinates as a FITS header, or `None`; with `top_down` of the rows in the order
    /// of the report, else of those in the file.
    fn wcs_header(&self, top_down: bool) -> Option<Vec<u8>> {
        let mut solution = self.solution.clone();
        if top_down {
            solution.row_order = Some(RowOrder::TopDown);
        }
        wcs::header(&self.name, &solution)
    }

    /// The covariance of small rotations about the camera's axes, in rad², row by row.
    fn attitude_covariance_rad2(&self) -> Option<[[f64; 3]; 3]> {
        match &self.solution.outcome {
            Outcome::Identified(found) => Some(found.attitude_covariance_rad2.into()),
            Outcome::NotIdentified(_) => None,
        }
    }
}
