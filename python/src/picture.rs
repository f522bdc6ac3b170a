//! Frames as pictures, and files for results.

use crate::errors::{detached, exception};
use crate::input::Input;
use crate::interrupt::on_this_thread;
use crate::pages::buffers;
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use starpipe::base::files;
use starpipe::report::overlay::{OverlayOptions, Shown, photograph};
use std::path::PathBuf;

/// Red, green and blue of each pixel, and rows and columns of the frame.
type Picture<'py> = (Bound<'py, PyArray3<u8>>, (usize, usize));

/// A frame as the program's overlays show it, without marks. Small frames are
/// enlarged and large ones reduced by whole factors. Its rows are those of the file as stored.
#[pyfunction]
pub fn picture<'py>(py: Python<'py>, frame: Input<'_>) -> PyResult<Picture<'py>> {
    let input = frame.borrow()?;
    let (image, shape) = on_this_thread(py, |interrupt| {
        let (frame, colors) = input.shown(&mut buffers(interrupt))?;
        let mut shown = Shown::new("", &frame);
        shown.colors = colors.as_ref();
        let image = photograph(&shown, None, &OverlayOptions::default());
        Ok((image, (frame.height, frame.width)))
    })?;
    let [width, height] = [image.width(), image.height()].map(|side| side as usize);
    let levels = PyArray1::from_vec(py, image.into_raw());
    Ok((levels.reshape([height, width, 3])?, shape))
}

/// Writes a file, whole or not at all.
#[pyfunction]
pub fn write_file(py: Python<'_>, path: PathBuf, content: &[u8]) -> PyResult<()> {
    detached(py, || files::write(&path, content).map_err(exception))
}
