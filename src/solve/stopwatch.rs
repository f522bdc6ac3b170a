//! Times the stages.

use serde::Serialize;
use std::time::Duration;
use web_time::Instant;

/// Time that each stage took, in milliseconds; 0 for a stage that was not needed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Timing {
    /// Reading, decoding and calibrating the frame.
    pub read_ms: f64,
    /// Detecting and measuring the sources.
    pub detect_ms: f64,
    /// Identifying the stars: pointing, naming, and what follows from the names.
    pub identify_ms: f64,
    /// Of these, finding out where the camera points.
    pub pointing_ms: f64,
    /// Of these, which star is which, and the fit to all of them; 0 where it was not wanted.
    pub naming_ms: f64,
    /// Photometry, and comparison with the stated camera.
    pub photometry_ms: f64,
    /// All of it.
    pub total_ms: f64,
}

/// A stage that is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Stage {
    /// Reading, decoding and calibrating.
    Read,
    /// Detecting and measuring the sources.
    Detect,
    /// Finding out where the camera points.
    Pointing,
    /// Finding out which star is which.
    Naming,
    /// What follows from the names.
    Identify,
    /// Photometry, and comparison with the stated camera.
    Photometry,
}

/// Times one frame from stage to stage.
pub(super) struct Stopwatch<'a> {
    start: Instant,
    lap_start: Instant,
    timing: Timing,
    on_stage: Option<&'a (dyn Fn(Stage) + Sync)>,
}

impl<'a> Stopwatch<'a> {
    /// Starts, and tells `on_stage` of each stage that is done.
    pub(super) fn start(on_stage: Option<&'a (dyn Fn(Stage) + Sync)>) -> Self {
        let now = Instant::now();
        Self {
            start: now,
            lap_start: now,
            timing: Timing::default(),
            on_stage,
        }
    }

    /// When a frame must be done that may take this long; never, if that is too far to tell.
    pub(super) fn deadline(&self, limit: Option<Duration>) -> Option<Instant> {
        self.start.checked_add(limit?)
    }

    /// Ends a stage; the next one begins. The times of a stage that comes again are added up. Pointing
    /// and naming are parts of identifying.
    pub(super) fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        let lap_ms = milliseconds(self.lap_start, now);
        self.lap_start = now;
        match stage {
            Stage::Read => self.timing.read_ms += lap_ms,
            Stage::Detect => self.timing.detect_ms += lap_ms,
            Stage::Pointing => self.timing.pointing_ms += lap_ms,
            Stage::Naming => self.timing.naming_ms += lap_ms,
            Stage::Identify => {}
            Stage::Photometry => self.timing.photometry_ms += lap_ms,
        }
        if matches!(stage, Stage::Pointing | Stage::Naming | Stage::Identify) {
            self.timing.identify_ms += lap_ms;
        }
        if let Some(on_stage) = self.on_stage {
            on_stage(stage);
        }
    }

    /// The times of the stages, and the total until now.
    pub(super) fn timing(&self) -> Timing {
        Timing {
            total_ms: milliseconds(self.start, Instant::now()),
            ..self.timing
        }
    }
}

fn milliseconds(from: Instant, to: Instant) -> f64 {
    to.duration_since(from).as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn each_stage_that_is_done_is_told() {
        let reported = Mutex::new(Vec::new());
        let on_stage = |stage| reported.lock().unwrap().push(stage);
        let mut clock = Stopwatch::start(Some(&on_stage));
        clock.lap(Stage::Read);
        clock.lap(Stage::Detect);
        assert_eq!(*reported.lock().unwrap(), [Stage::Read, Stage::Detect]);
    }
}
