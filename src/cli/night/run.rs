//! The frames of a night, batch by batch.

use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_error;
use crate::cli::progress::frames_bar;
use crate::cli::solving::{InputSolver, Inputs, Sink, SolvedImage, SolvingPlan};
use indicatif::ProgressBar;
use starpipe::UtcOffset;
use starpipe::calibration::Calibration;
use starpipe::frame::{ImageName, PageChoice};
use starpipe::night::{NightRow, NightStart, NoSky, PointingHistory, Probe, probe_order};
use starpipe::solve::{Context, FixedCamera};
use starpipe::store::Journal;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Frames that are solved with the same pointing, whatever the number of threads.
pub(super) const BATCH: usize = 8;

/// What a night is measured with.
pub(super) struct NightRun<'a> {
    pub(super) pool: &'a rayon::ThreadPool,
    pub(super) plan: &'a SolvingPlan,
    pub(super) context: Context<'a>,
    pub(super) is_quiet: bool,
}

/// The rows of a night, and what was held.
pub(super) struct MeasuredNight {
    pub(super) rows: Vec<NightRow>,
    pub(super) history: PointingHistory,
    pub(super) start: NightStart,
}

impl<'a> NightRun<'a> {
    /// The same with another calibration, if there is one.
    pub(super) fn with_calibration(self, calibration: Option<&'a Calibration>) -> Self {
        let mut context = self.context;
        context.calibration = calibration.or(context.calibration);
        Self { context, ..self }
    }

    /// Measures the frames `names`, in their order, but those whose rows are in `journal`: `kept`.
    pub(super) fn measure(
        &self,
        names: &[String],
        start: NightStart,
        mut journal: Journal<NightRow>,
        mut kept: Vec<Option<NightRow>>,
    ) -> Result<MeasuredNight, CommandError> {
        let progress = self.bar(names.len());
        let mut measured = MeasuredNight {
            history: PointingHistory::new(start.fixed_camera.as_ref().map(|held| held.pointing)),
            rows: Vec::with_capacity(names.len()),
            start,
        };
        for (batch, kept) in names.chunks(BATCH).zip(kept.chunks_mut(BATCH)) {
            let is_lost: Vec<bool> = kept.iter().map(Option::is_none).collect();
            let lost = batch.iter().zip(&is_lost);
            let lost: Vec<&String> = lost
                .filter_map(|(name, lost)| lost.then_some(name))
                .collect();
            progress.inc((batch.len() - lost.len()) as u64);
            let mut made = self.batch(&lost, &measured, &progress).into_iter();
            let done = measured.rows.len();
            for row in kept.iter_mut() {
                if let Some(row) = row.take().or_else(|| made.next()) {
                    measured.take(row);
                }
            }
            let rows = measured.rows[done..].iter().zip(&is_lost);
            journal.add(rows.filter_map(|(row, lost)| lost.then_some(row)))?;
        }
        journal.finish()?;
        progress.finish_and_clear();
        Ok(measured)
    }

    fn bar(&self, frames: usize) -> ProgressBar {
        if self.is_quiet {
            ProgressBar::hidden()
        } else {
            frames_bar(frames as u64)
        }
    }

    /// What frames all over the night tell.
    pub(super) fn start(&self, names: &[String]) -> NightStart {
        let order = probe_order(names.len());
        let mut probes = Vec::new();
        let mut tried = 0;
        for batch in order.chunks(BATCH) {
            let paths: Vec<&String> = batch.iter().map(|at| &names[*at]).collect();
            let solver = self.solver(self.context.clone(), Probes);
            solver.solve_all(&paths, |images| {
                // Frames that cannot be read are reported with their rows.
                let found = images
                    .into_iter()
                    .filter_map(|(_, probe)| probe.ok().flatten());
                probes.extend(found);
                ControlFlow::Continue(())
            });
            tried += batch.len();
            if NightStart::is_enough(probes.len(), tried) {
                break;
            }
        }
        NightStart::from_probes(probes, self.context.lens.clone())
    }

    /// The rows of a batch.
    fn batch(
        &self,
        names: &[&String],
        measured: &MeasuredNight,
        progress: &ProgressBar,
    ) -> Vec<NightRow> {
        let mut context = self.context.clone();
        context.lens = measured.start.lens.clone();
        if let (Some(UtcOffset::Auto), Some(ahead)) = (context.utc_offset, measured.start.ahead) {
            context.utc_offset = Some(UtcOffset::Ahead(ahead));
        }
        context.fixed_camera = measured.fixed_camera().map(Arc::new);
        let rows = NightRowSink {
            clear_ground_vmag: measured.start.clear_ground_vmag,
        };
        let mut all = Vec::with_capacity(names.len());
        self.solver(context, rows).solve_all(names, |images| {
            progress.inc(1);
            for (name, row) in images {
                all.push(row.unwrap_or_else(|error| {
                    progress.suspend(|| report_error(error.as_ref()));
                    NightRow::unread(&name)
                }));
            }
            ControlFlow::Continue(())
        });
        all
    }

    fn solver<'s, S>(&'s self, context: Context<'s>, sink: S) -> InputSolver<'s, S> {
        const MAIN: &Inputs = &Inputs::Frames(PageChoice::Main);
        InputSolver {
            pool: self.pool,
            inputs: MAIN,
            context,
            memory: self.plan.memory,
            sink,
        }
    }
}

impl MeasuredNight {
    /// Takes the next row, and says by how much the camera differs from how it is held.
    fn take(&mut self, mut row: NightRow) {
        if let Some(shift_rad) = self.history.take_row(self.rows.len(), &row) {
            row.set_shift(shift_rad);
        }
        self.rows.push(row);
    }

    /// The camera as it is held now.
    fn fixed_camera(&self) -> Option<FixedCamera> {
        let held = self.start.fixed_camera.clone()?;
        let (pointing, sigma_rad) = self.history.fixed()?;
        Some(FixedCamera {
            pointing,
            sigma_rad,
            ..held
        })
    }
}

/// Makes of a frame what it tells of the start.
struct Probes;

impl Sink for Probes {
    type Made = Option<Probe>;

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Self::Made {
        Probe::from_solution(&image.to_string(), &solved.solution)
    }
}

/// Makes of a frame its row.
struct NightRowSink {
    clear_ground_vmag: Option<f64>,
}

impl Sink for NightRowSink {
    type Made = NightRow;

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Self::Made {
        let (name, solution) = (image.to_string(), &solved.solution);
        let frame = solved.frame.as_ref();
        match frame.and_then(|frame| NoSky::detect(&image.to_path(), solution, frame)) {
            Some(kind) => NightRow::passed_over(&name, solution, kind),
            None => NightRow::from_solution(&name, solution, self.clear_ground_vmag),
        }
    }
}
