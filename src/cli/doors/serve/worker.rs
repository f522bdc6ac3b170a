//! The threads that solve frames.

use super::making;
use super::metrics::Ending;
use super::refusal::Refusal;
use super::server::Server;
use super::store::{Job, JobResult, now};
use super::work::{Input, Request, Source, Wanted, Work};
use crate::cli::output::messages::one_line;
use crate::cli::solving::{SolvedImage, SolvingPlan};
use anyhow::Context as _;
use starpipe::base::panics::caught;
use starpipe::doors::nova::{JobAnswers, Upload};
use starpipe::frame::{self, Buffers, MemoryLimit};
use starpipe::identify::IndexedCatalog;
use starpipe::report::tables::{self, TableFormat};
use starpipe::report::{FrameReport, wcs};
use starpipe::solve::{DeepSky, Workspace, solve_centroids, solve_guarded, solve_read};
use std::path::Path;
use std::time::Instant;

/// A job that has ended the server so often is not begun again.
const MOST_ENDS: u64 = 2;

/// Name and content of a file.
type ResultFile = (&'static str, Vec<u8>);

/// What the workers share.
pub(super) struct Solver<'a> {
    pub(super) server: &'a Server,
    pub(super) indexed: &'a IndexedCatalog<'a>,
    pub(super) deep: Option<&'a DeepSky>,
    pub(super) memory: MemoryLimit,
}

impl Solver<'_> {
    /// Works until the queue is closed.
    pub(super) fn run(&self) {
        let mut workspace = Workspace::new().with_interrupt(&self.server.interrupt());
        workspace.frames.set_memory(self.memory);
        while let Some(work) = self.server.queue.take() {
            match work {
                Work::Job(number) => self.finish_or_fail(number, &mut workspace),
                Work::Request(request) => {
                    if let Err(panicked) = caught(|| self.answer(request, &mut workspace)) {
                        tracing::error!("{panicked}");
                    }
                }
            }
            for error in self.deep.iter().flat_map(|deep| deep.take_errors()) {
                tracing::warn!("{}; it was not used", one_line(&error));
            }
            self.server.queue.done();
        }
    }

    fn answer(&self, request: Request, workspace: &mut Workspace) {
        if request.answer.is_closed() {
            return;
        }
        let made = self.made(request.source, request.wanted, workspace);
        let made = made.and_then(|made| self.server.limits.answer(made));
        let made = made.map_err(|refusal| match self.server.interrupt().is_due() {
            true => Refusal::ending(),
            false => refusal,
        });
        // A client that has gone needs no answer.
        let _ = request.answer.send(made);
    }

    /// What is wanted of a frame.
    fn made(
        &self,
        source: Source,
        wanted: Wanted,
        workspace: &mut Workspace,
    ) -> Result<Vec<u8>, Refusal> {
        let input = match source {
            Source::Given(input) => *input,
            Source::Job(number) => {
                let input = input_of_job(self.server, number);
                input.map_err(|error| self.server.unreadable(number, &error))?
            }
        };
        let made = self.timed(&input, workspace, |solved, workspace| {
            let catalog = self.indexed.catalog();
            making::made(wanted, &input, solved, catalog, &mut workspace.frames)
        });
        made.map_err(|error| Refusal::of_frame(&error))
    }

    /// Solves a job, and keeps its results, or else that there are none.
    fn finish_or_fail(&self, number: u64, workspace: &mut Workspace) {
        let started = now();
        let done = caught(|| self.finish_job(number, &started, workspace));
        if let Err(error) = done.map_err(anyhow::Error::from).flatten() {
            tracing::error!("{}", one_line(error.as_ref()));
            let reason = "the server failed to solve this, or to write what it found";
            let failure = JobResult::failed(started, reason);
            self.server.store.fail(number, failure);
        }
    }

    fn finish_job(
        &self,
        number: u64,
        started: &str,
        workspace: &mut Workspace,
    ) -> anyhow::Result<()> {
        let store = &self.server.store;
        let found = match store.begin(number)? {
            ends if ends >= MOST_ENDS => Err("the server ended while it solved this".to_owned()),
            _ => self.job_results(number, started, workspace),
        };
        if self.server.interrupt().is_due() {
            // The next start does it.
            store.leave(number);
            return Ok(());
        }
        let (result, files) = found.unwrap_or_else(|reason| {
            let failure = JobResult::failed(started.to_owned(), reason);
            (failure, Vec::new())
        });
        store.finish(number, &result, files)?;
        let is_identified = result.answers.calibration.is_some();
        tracing::info!(job = number, is_identified, "done");
        Ok(())
    }

    /// How a job ended and its files, or why there is nothing.
    fn job_results(
        &self,
        number: u64,
        started: &str,
        workspace: &mut Workspace,
    ) -> Result<(JobResult, Vec<ResultFile>), String> {
        let input = input_of_job(self.server, number).map_err(|error| {
            tracing::error!(job = number, "{}", one_line(error.as_ref()));
            "the server could not read the upload".to_owned()
        })?;
        let found = self.timed(&input, workspace, |solved, _| {
            let (answers, files) = self.results(&input, solved);
            let mut result = JobResult::new(started.to_owned(), answers);
            result.has_no_picture = solved.frame.is_none();
            Ok((result, files))
        });
        found.map_err(|error| Refusal::of_frame(&error).message)
    }

    /// What is kept of a job: its answers, and files by name.
    fn results(&self, input: &Input, solved: &SolvedImage) -> (JobAnswers, Vec<ResultFile>) {
        let solution = &solved.solution;
        let report = FrameReport::new(&input.name, solution, self.indexed.catalog());
        let table = |format: TableFormat| {
            let table = tables::stars(&report, solution, format);
            (format.extension(), table)
        };
        let mut files = vec![table(TableFormat::Axy)];
        if let Some(header) = wcs::header(&input.name, solution) {
            files.push((WCS, header));
            files.extend([TableFormat::Rdls, TableFormat::Corr].map(table));
        }
        (JobAnswers::new(&report, solution), files)
    }

    /// Solves a frame and makes something of it. Counts how it ended.
    fn timed<R>(
        &self,
        input: &Input,
        workspace: &mut Workspace,
        make: impl FnOnce(&SolvedImage, &mut Workspace) -> anyhow::Result<R>,
    ) -> anyhow::Result<R> {
        let begun = Instant::now();
        let solved = self.solved(input, workspace);
        let ending = match &solved {
            Ok(solved) if solved.solution.outcome.identification().is_some() => Ending::Identified,
            Ok(_) => Ending::NotIdentified,
            Err(_) => Ending::Failed,
        };
        let made = solved.and_then(|solved| {
            let name = Path::new(&input.name);
            let made = solve_guarded(name, workspace, |workspace| make(&solved, workspace));
            if let Some(frame) = solved.frame {
                workspace.frames.recycle(frame);
            }
            made
        });
        self.server.metrics.end(ending, begun.elapsed());
        made
    }

    fn solved(&self, input: &Input, workspace: &mut Workspace) -> anyhow::Result<SolvedImage> {
        let plan = SolvingPlan {
            options: input.options.clone(),
            memory: self.memory,
            ..SolvingPlan::default()
        };
        let mut context = plan.context(self.indexed);
        context.deep = self.deep;
        context.measure_known_sky = true;
        let content = &input.content[..];
        let upload = input.upload.as_ref();
        let scale = upload.and_then(|upload| upload.scale?.prior());
        context.priors.scale = scale.or(context.priors.scale);
        let name = Path::new(&input.name);
        solve_guarded(name, workspace, |workspace| {
            if let Some(list) = upload.and_then(|upload| upload.list(content)) {
                let list = list.context("reading the list of stars")?;
                let solution = solve_centroids(&list, &context, workspace)
                    .context("reading the list of stars")?;
                return Ok(SolvedImage {
                    solution,
                    frame: None,
                });
            }
            let read = |buffers: &mut Buffers| {
                let frame = frame::read_stream(content, input.page, buffers);
                frame.map_err(|error| error.in_file(name))
            };
            let (solution, frame) = solve_read(name, read, &context, workspace)?;
            let frame = Some(frame);
            Ok(SolvedImage { solution, frame })
        })
    }
}

/// The result file with the coordinates.
pub(super) const WCS: &str = "wcs";

/// What a job of the store is solved with.
fn input_of_job(server: &Server, number: u64) -> anyhow::Result<Input> {
    let job: Job = server.store.job(number)?;
    // They were read before they were kept.
    let upload = Upload::from_json(&job.settings)?;
    Ok(Input {
        name: job.name,
        content: server.store.upload(number)?.into(),
        options: upload.in_options(server.options.clone()),
        page: None,
        upload: Some(upload),
    })
}
