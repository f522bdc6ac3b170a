//! The attitude from frame to frame.

use crate::errors::exception;
use crate::input::{Borrowed, Failed, Input, apply};
use crate::interrupt::on_this_thread;
use crate::options::Options;
use crate::pipeline::Pipeline;
use pyo3::prelude::*;
use starpipe::frame::RowOrder;
use starpipe::report::TrackReport;
use starpipe::solve::{Error, solve_guarded};
use starpipe::track;
use starpipe::{Calibration, Interrupt, Workspace};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Follows the attitude of a camera.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Tracker(Mutex<Tracking>);

struct Tracking {
    tracker: track::Tracker<'static>,
    /// The calibration of frames whose files have their rows in this order.
    calibration: Option<(Option<RowOrder>, Calibration)>,
}

#[pymethods]
impl Tracker {
    #[new]
    fn new(pipeline: &Pipeline, options: Options, max_stars: usize) -> PyResult<Self> {
        let context = pipeline.context(&options)?;
        Ok(Self(Mutex::new(Tracking {
            tracker: track::Tracker::new(context).with_stars(max_stars),
            calibration: None,
        })))
    }

    /// The report of the next frame as the program's JSON; `frame` has the same masters each time.
    #[pyo3(signature = (frame, time_s))]
    fn track(&self, py: Python<'_>, frame: Input<'_>, time_s: Option<f64>) -> PyResult<String> {
        let input = frame.borrow()?;
        on_this_thread(py, |interrupt| {
            let mut tracking = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let report = tracking.guarded_report(input, time_s, interrupt)?;
            report.to_json_line().map_err(exception)
        })
    }

    /// Forgets everything but what is stated.
    fn reset(&self) {
        let mut tracking = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        tracking.tracker.reset();
    }
}

impl Tracking {
    /// [`Self::report`]; a panic in it is an error of this frame, after which the next is solved anew.
    fn guarded_report(
        &mut self,
        input: Borrowed,
        time_s: Option<f64>,
        interrupt: &Interrupt,
    ) -> Result<TrackReport, Failed> {
        let workspace = self.tracker.workspace();
        *workspace = std::mem::take(workspace).with_interrupt(interrupt);
        let name = input.name.clone();
        let mut panicked = true;
        let report = solve_guarded(&name, &mut Workspace::default(), |_| {
            let report = self.report(input, time_s);
            panicked = false;
            report
        });
        if panicked {
            self.tracker.reset();
        }
        report
    }

    fn report(&mut self, input: Borrowed, time_s: Option<f64>) -> Result<TrackReport, Failed> {
        let start = Instant::now();
        let Borrowed {
            name,
            source,
            bad,
            masters,
            ..
        } = input;
        let is_file = source.is_file();
        let buffers = &mut self.tracker.workspace().frames;
        let mut frame = source.frame(&name, bad, buffers)?;
        if !masters.is_empty() {
            let row_order = is_file.then_some(frame.metadata.row_order);
            self.calibration.take_if(|(order, _)| *order != row_order);
            if self.calibration.is_none() {
                let made = masters.calibration(row_order, buffers).map_err(Failed)?;
                self.calibration = made.map(|calibration| (row_order, calibration));
            }
        }
        if let Some((_, calibration)) = &self.calibration {
            apply(calibration, &mut frame, &name)?;
        }
        let frame = frame.as_stored();
        let read_ms = milliseconds(start);
        let start = Instant::now();
        let track = self.tracker.process_frame(&frame, time_s);
        let track = track.map_err(|source| {
            let path = name.clone();
            Error::Detect { path, source }
        })?;
        let track_ms = milliseconds(start);
        if is_file {
            self.tracker.workspace().frames.recycle(frame.into_owned());
        }
        let name = name.display().to_string();
        Ok(TrackReport::new(&name, &track, [read_ms, track_ms]))
    }
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
