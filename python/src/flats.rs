//! Evenly lit frames.

use crate::camera::description;
use crate::errors::{detached, exception, json};
use crate::image::{Image, Source};
use crate::interrupt::on_this_thread;
use crate::pages::buffers;
use numpy::PyArray1;
use pyo3::prelude::*;
use starpipe::Frame;
use starpipe::calibration::flats::{self, FlatConfig, FlatStack};
use starpipe::frame::{Buffers, FrameError};
use std::path::PathBuf;

/// Adds frames one after the other; none is kept.
#[pyclass(module = "starpipe._starpipe")]
pub struct FlatFrames {
    stack: FlatStack,
}

#[pymethods]
impl FlatFrames {
    /// The bias and the read noise are those of the camera.
    #[new]
    #[pyo3(signature = (dark, camera))]
    fn new(py: Python<'_>, dark: Option<Image<'_>>, camera: Option<PathBuf>) -> PyResult<Self> {
        let camera = camera.as_deref().map(description).transpose()?;
        let sheet = camera.and_then(|camera| camera.sheet);
        let source = dark.as_ref().map(Image::source).transpose()?;
        on_this_thread(py, |interrupt| {
            let read = |source| as_stored(source, &mut buffers(interrupt));
            let config = FlatConfig {
                dark: source.map(read).transpose().map_err(exception)?,
                bias_adu: sheet.as_ref().map_or(0.0, |sheet| sheet.bias_adu),
                read_noise_e: sheet.as_ref().map(|sheet| sheet.read_noise_e),
            };
            let stack = FlatStack::new(config);
            Ok(Self { stack })
        })
    }

    /// Adds a frame.
    fn add(&mut self, py: Python<'_>, image: Image<'_>) -> PyResult<()> {
        let source = image.source()?;
        let stack = &mut self.stack;
        on_this_thread(py, |interrupt| {
            let (name, frame) = as_stored(source, &mut buffers(interrupt)).map_err(exception)?;
            stack.add(&name, &frame).map_err(exception)
        })
    }

    /// Measures the frames, and forgets them.
    fn measure(&mut self, py: Python<'_>) -> PyResult<Flats> {
        let empty = FlatStack::new(FlatConfig::default());
        let stack = std::mem::replace(&mut self.stack, empty);
        let measured = detached(py, || stack.measure().map_err(exception))?;
        Ok(Flats { measured })
    }
}

/// Name and pixels of a frame, with its rows as stored.
fn as_stored(
    source: Source<'_>,
    buffers: &mut Buffers,
) -> Result<(String, Frame<'static>), FrameError> {
    let name = source.name();
    let frame = source.frame(&name, None, buffers)?;
    Ok((name.display().to_string(), frame.into_owned().as_stored()))
}

/// What flats say of a detector.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Flats {
    measured: flats::Flats,
}

#[pymethods]
impl Flats {
    /// The report as the program's JSON.
    fn json(&self) -> PyResult<String> {
        json(&self.measured.report())
    }

    /// Response of each pixel, with a mean of 1.
    fn master<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.measured.master)
    }

    /// Rows and columns of the frames.
    #[getter]
    fn shape(&self) -> [usize; 2] {
        [self.measured.height, self.measured.width]
    }
}
