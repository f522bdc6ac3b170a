//! `track`: follows the attitude of a camera from frame to frame.

use super::exit::{CommandError, CommandOutput, OutcomeTally};
use super::input::frames::{FrameList, read_frame};
use super::input::stdin::is_stdin;
use super::options::calibration::CalibrationOptions;
use super::options::catalog::CatalogOptions;
use super::options::format::PageFormat;
use super::options::hints::HintOptions;
use super::options::stated::{ExposureOption, with_stated};
use super::options::values;
use super::output::messages::report_error;
use super::output::stdout::print;
use anyhow::Context as _;
use clap::Args;
use starpipe::base::epoch::ObservationDate;
use starpipe::base::panics::caught;
use starpipe::calibration::Calibration;
use starpipe::report::TrackReport;
use starpipe::solve::Context;
use starpipe::track::{DEFAULT_STARS, Tracker};
use std::io::{self, BufRead};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe track --interval 0.1 night/ > track.jsonl\n  \
    starpipe track --fov 20 --max-stars 20 --format text night-*.tif\n  \
    inotifywait -m -e close_write --format %w%f night | starpipe track --interval 0.1 -\n\n\
    The first two frames are solved in full. In later frames only windows around predicted stars are read; if\n\
    the stars are not there, the frame is solved in full. The line of a frame is printed as soon as it is\n\
    processed.\n\n\
    Exit status: 0 every frame has an attitude, 1 something could not be read, 2 the command line is wrong,\n\
    3 at least one frame has no attitude.")]
pub(crate) struct TrackArgs {
    /// Frames in the order of their times; a directory means all frames in it, - a list of files on
    /// standard input, one per line, which are read as the lines arrive
    #[arg(value_name = "FRAME", required = true)]
    frames: Vec<PathBuf>,
    /// Time from frame to frame, in seconds [default: from the dates in the files' headers, if they
    /// have fractions of a second or are 10 s apart; else unknown, and rates are per frame]
    #[arg(long, value_name = "SECONDS", value_parser = values::positive, allow_hyphen_values = true)]
    interval: Option<f64>,
    /// Maximum number of stars to measure in a frame
    #[arg(long, alias = "stars", value_name = "NUMBER", default_value_t = DEFAULT_STARS as u64,
          value_parser = clap::value_parser!(u64).range(4..=1000))]
    max_stars: u64,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Json)]
    format: PageFormat,
    #[command(flatten)]
    calibration: CalibrationOptions,
    #[command(flatten)]
    exposure: ExposureOption,
    #[command(flatten)]
    hints: HintOptions,
    #[command(flatten)]
    catalog: CatalogOptions,
}

/// `starpipe track`
pub(crate) fn track(arguments: &TrackArgs) -> Result<CommandOutput, CommandError> {
    let names = arguments.frames.iter().filter(|name| is_stdin(name));
    if names.count() > 1 {
        return Err(CommandError::usage(
            "- is the list on standard input, which can be read only once; it is given twice",
        ));
    }
    let options = with_stated(arguments.hints.options()?, &arguments.exposure)?;
    let camera = arguments.hints.description()?;
    let calibration = arguments.calibration.read(camera.as_ref())?;
    arguments.catalog.with_index(|_, indexed| {
        let context = Context::new(indexed).with_options(&options, camera.clone());
        let mut run = TrackRun {
            tracker: Tracker::new(context).with_stars(arguments.max_stars as usize),
            calibration: calibration.as_ref(),
            clock: FrameClock::new(arguments.interval),
            format: arguments.format,
            tally: OutcomeTally::default(),
        };
        run.all(&arguments.frames)?;
        Ok(run.tally.exit().into())
    })
}

/// State of the frames so far.
struct TrackRun<'a> {
    tracker: Tracker<'a>,
    calibration: Option<&'a Calibration>,
    clock: FrameClock,
    format: PageFormat,
    tally: OutcomeTally,
}

impl TrackRun<'_> {
    /// Tracks all frames, those of a list as its lines come.
    fn all(&mut self, inputs: &[PathBuf]) -> Result<(), CommandError> {
        for input in inputs {
            let flow = if is_stdin(input) {
                self.listed()?
            } else {
                let (paths, failed) = FrameList::expand(vec![input.clone()])?.reported();
                self.tally.failed += usize::from(failed);
                let mut paths = paths.iter();
                paths.try_for_each(|path| self.frame(path))
            };
            if flow.is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Tracks the frames whose names are on standard input.
    fn listed(&mut self) -> anyhow::Result<ControlFlow<()>> {
        for line in io::stdin().lock().lines() {
            let line = line.context("reading the list of frames from standard input")?;
            let name = line.trim_end_matches('\r');
            if !name.is_empty() && self.frame(Path::new(name)).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Tracks one frame and prints its line. Breaks if nobody reads the lines any longer.
    fn frame(&mut self, path: &Path) -> ControlFlow<()> {
        let printed = self.guarded_report(path).and_then(|report| {
            self.tally.count(report.has_attitude());
            print(&match self.format {
                PageFormat::Text => report.to_text(),
                PageFormat::Json => report.to_json_line()? + "\n",
            })
        });
        printed.unwrap_or_else(|error| {
            self.tally.failed += 1;
            report_error(error.as_ref());
            ControlFlow::Continue(())
        })
    }

    /// [`Self::report`]; a panic in it is an error of this frame, after which the next is solved anew.
    fn guarded_report(&mut self, path: &Path) -> anyhow::Result<TrackReport> {
        caught(|| self.report(path)).unwrap_or_else(|panicked| {
            self.tracker.reset();
            Err(panicked).with_context(|| format!("tracking {}", path.display()))
        })
    }

    fn report(&mut self, path: &Path) -> anyhow::Result<TrackReport> {
        let start = Instant::now();
        self.clock.count();
        let buffers = &mut self.tracker.workspace().frames;
        let mut frame = read_frame(path, None, buffers).context("reading")?;
        if let Some(calibration) = self.calibration {
            let applied = calibration.apply(&mut frame);
            applied.with_context(|| format!("calibrating {}", path.display()))?;
        }
        let read_ms = milliseconds(start);
        let time_s = self.clock.time_s(frame.metadata.date.as_ref());
        let start = Instant::now();
        let track = self.tracker.process_frame(&frame, time_s);
        let track_ms = milliseconds(start);
        self.tracker.workspace().frames.recycle(frame);
        let track = track.with_context(|| path.display().to_string())?;
        let name = path.display().to_string();
        Ok(TrackReport::new(&name, &track, [read_ms, track_ms]))
    }
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// The times of the frames.
struct FrameClock {
    interval_s: Option<f64>,
    /// Frames so far, those that cannot be read included.
    frames: u64,
    /// Time of the first date, and of the last one.
    first_s: Option<f64>,
    last_s: Option<f64>,
    /// Whether a date had fractions of a second.
    is_exact: bool,
}

impl FrameClock {
    /// Dates in whole seconds that are as far apart as this give a rate to some percents.
    const FAR_APART_S: f64 = 10.0;

    fn new(interval_s: Option<f64>) -> Self {
        Self {
            interval_s,
            frames: 0,
            first_s: None,
            last_s: None,
            is_exact: false,
        }
    }

    /// Counts a frame.
    fn count(&mut self) {
        self.frames += 1;
    }

    /// Time of the frame that was just counted, in seconds from the first one; `None` where it is
    /// not known.
    fn time_s(&mut self, date: Option<&ObservationDate>) -> Option<f64> {
        if let Some(interval_s) = self.interval_s {
            return Some(interval_s * self.frames.saturating_sub(1) as f64);
        }
        let (now_s, has_fraction) = date?.seconds_since_j2000()?;
        self.is_exact |= has_fraction;
        let last_s = self.last_s.replace(now_s);
        let first_s = *self.first_s.get_or_insert(now_s);
        let is_far = last_s.is_none_or(|last_s| now_s - last_s >= Self::FAR_APART_S);
        (self.is_exact || is_far).then_some(now_s - first_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(interval_s: Option<f64>, dates: &[&str]) -> Vec<Option<f64>> {
        let mut clock = FrameClock::new(interval_s);
        let mut time = |date: &&str| {
            clock.count();
            clock.time_s(date.parse::<ObservationDate>().ok().as_ref())
        };
        dates.iter().map(&mut time).collect()
    }

    #[test]
    fn dates_count_where_they_are_exact_enough() {
        let exact = ["2020-01-01T00:00:00.5Z", "2020-01-01T00:00:01Z"];
        assert_eq!(times(None, &exact), [Some(0.0), Some(0.5)]);
        let far = ["2020-01-01T00:00:00Z", "2020-01-01T00:00:20Z"];
        assert_eq!(times(None, &far), [Some(0.0), Some(20.0)]);
        let near = ["2020-01-01T00:00:00Z", "2020-01-01T00:00:01Z", ""];
        assert_eq!(times(None, &near), [Some(0.0), None, None]);
        assert_eq!(times(Some(0.25), &near), [Some(0.0), Some(0.25), Some(0.5)]);
    }
}
