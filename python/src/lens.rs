//! The lens of a camera, from several of its frames.

use crate::errors::{detached, exception, json};
use crate::solved::Solved;
use pyo3::prelude::*;
use starpipe::identify::lens::{self, LeftOutFrame};
use starpipe::report::LensReport;

/// The report of a calibration as the program's JSON, and the table `[lens]` of a description.
#[pyfunction]
pub fn calibrate(py: Python<'_>, solved: Vec<PyRef<'_, Solved>>) -> PyResult<(String, String)> {
    let (mut frames, mut left_out) = (Vec::new(), Vec::new());
    for frame in &solved {
        match frame.solution.lens_frame(&frame.name) {
            Ok(frame) => frames.push(frame),
            Err(why) => left_out.push(LeftOutFrame {
                name: frame.name.clone(),
                why,
            }),
        }
    }
    drop(solved);
    detached(py, || {
        let measured = lens::calibrate(frames, left_out).map_err(exception)?;
        let report = json(&LensReport::new(&measured))?;
        Ok((report, measured.to_toml()))
    })
}
