//! Detection alone.

use crate::errors::{exception, json};
use crate::image::{Image, bad_pixels};
use crate::interrupt::{on_threads, useful};
use crate::pipeline::detect_config;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use serde::Serialize;
use starpipe::detect::Workspace;
use starpipe::frame::Buffers;
use starpipe::report::{StarReport, detections};
use std::num::NonZeroUsize;

/// What was detected in a frame.
#[derive(Serialize)]
struct Detected {
    stars: Vec<StarReport>,
    background: f64,
    noise: f64,
    spot_sigma_px: f64,
    threshold_sigma: f64,
}

/// Detects the stars of an image: a report as JSON.
#[pyfunction]
#[pyo3(signature = (image, mask, sigma, max_stars, threads))]
pub fn detect(
    py: Python<'_>,
    image: Image<'_>,
    mask: Option<PyReadonlyArray2<'_, bool>>,
    sigma: Option<f64>,
    max_stars: Option<usize>,
    threads: NonZeroUsize,
) -> PyResult<String> {
    let source = image.source()?;
    let bad = bad_pixels(mask.as_ref())?;
    let config = detect_config(sigma, max_stars);
    on_threads(py, threads, |interrupt| {
        let name = source.name();
        let mut buffers = Buffers::new();
        buffers.set_interrupt(interrupt.clone());
        let frame = source.frame(&name, bad, &mut buffers);
        let frame = frame.map_err(exception)?.as_stored();
        let workspace = Workspace::new().on_threads(useful(threads));
        let mut workspace = workspace.with_interrupt(interrupt.clone());
        let found = starpipe::detect(&frame, &config, &mut workspace).map_err(exception)?;
        json(&Detected {
            stars: detections(&found),
            background: found.background_adu,
            noise: found.noise_adu,
            spot_sigma_px: found.spot_sigma_px,
            threshold_sigma: found.threshold_sigma,
        })
    })
}
