//! Frames taken without light.

use crate::errors::{detached, exception, json};
use crate::image::Image;
use crate::interrupt::on_this_thread;
use numpy::PyArray1;
use pyo3::prelude::*;
use starpipe::calibration::darks::{
    self, DarkConfig, DarkStack, FrameStatistics, FullScaleSource, HotPixelRow,
};
use starpipe::frame::Buffers;

/// Adds frames one after the other; none is kept.
#[pyclass(module = "starpipe._starpipe")]
#[derive(Default)]
pub struct DarkFrames {
    stack: DarkStack,
}

#[pymethods]
impl DarkFrames {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Adds a frame.
    fn add(&mut self, py: Python<'_>, image: Image<'_>, exposure_s: Option<f64>) -> PyResult<()> {
        let source = image.source()?;
        let stack = &mut self.stack;
        on_this_thread(py, |interrupt| {
            let name = source.name();
            let mut buffers = Buffers::new();
            buffers.set_interrupt(interrupt.clone());
            let frame = source.frame(&name, None, &mut buffers);
            let frame = frame.map_err(exception)?.as_stored();
            let statistics =
                FrameStatistics::measure(&name.display().to_string(), &frame, exposure_s);
            stack.add(&frame, statistics).map_err(exception)
        })
    }

    /// Measures the frames, and forgets them.
    fn measure(
        &mut self,
        py: Python<'_>,
        bits: Option<u32>,
        gain_e_per_adu: Option<f64>,
    ) -> PyResult<Darks> {
        let config = DarkConfig {
            bits: bits.map(|bits| (bits, FullScaleSource::Option)),
            gain_e_per_adu,
            ..DarkConfig::default()
        };
        let stack = std::mem::take(&mut self.stack);
        let measured = detached(py, || stack.measure(&config).map_err(exception))?;
        Ok(Darks { measured })
    }
}

/// What dark frames say of a detector.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Darks {
    pub measured: darks::Darks,
}

#[pymethods]
impl Darks {
    /// The report as the program's JSON.
    fn json(&self) -> PyResult<String> {
        json(&self.measured.report())
    }

    /// Exposure and mean of each pixel, of each group of frames of one exposure.
    fn masters<'py>(&self, py: Python<'py>) -> Vec<(Option<f64>, Bound<'py, PyArray1<f32>>)> {
        let groups = self.measured.groups.iter();
        let master = |means: &[f32]| PyArray1::from_slice(py, means);
        groups
            .map(|group| (group.exposure_s, master(&group.means)))
            .collect()
    }

    /// Noise of each pixel.
    fn noise_adu<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        let noise = self.measured.noise_adu.as_ref();
        noise.map(|noise| PyArray1::from_slice(py, noise))
    }

    /// The hot pixels as JSON.
    fn hot_pixels(&self) -> PyResult<String> {
        let hot = &self.measured.hot_pixels;
        let rows: Vec<HotPixelRow> = hot.iter().map(HotPixelRow::from).collect();
        json(&rows)
    }

    /// Rows and columns of the frames.
    #[getter]
    fn shape(&self) -> [usize; 2] {
        [self.measured.height, self.measured.width]
    }
}
