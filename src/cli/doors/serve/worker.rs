//! The threads that solve frames.

use super::body::Received;
use super::making;
use super::metrics::Ending;
use super::refusal::Refusal;
use super::server::Server;
use super::store::JobResult;
use super::work::{Input, Request, Work};
use crate::cli::output::messages::one_line;
use crate::cli::solving::{SolvedImage, SolvingPlan};
use anyhow::Context as _;
use jiff::Timestamp;
use starpipe::base::panics::caught;
use starpipe::doors::nova::{JobAnswers, Upload};
use starpipe::frame::{self, Buffers, MemoryLimit};
use starpipe::identify::IndexedCatalog;
use starpipe::report::tables::{self, TableFormat};
use starpipe::report::{FrameReport, wcs};
use starpipe::solve::{DeepSky, Workspace, solve_centroids, solve_guarded, solve_read};
use std::path::Path;
use std::time::Instant;

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
            let done = caught(|| match work {
                Work::Job(number) => self.finish_job(number, &mut workspace),
                Work::Request(request) => {
                    self.answer(*request, &mut workspace);
                    Ok(())
                }
            });
            let done = done.map_err(anyhow::Error::from).flatten();
            if let Err(error) = done {
                tracing::error!("{}", one_line(error.as_ref()));
            }
        }
    }

    fn answer(&self, request: Request, workspace: &mut Workspace) {
        if request.answer.is_closed() {
            return;
        }
        let made = self.timed(&request.input, workspace, |solved, workspace| {
            let (wanted, catalog) = (request.wanted, self.indexed.catalog());
            making::made(
                wanted,
                &request.input,
                solved,
                catalog,
                &mut workspace.frames,
            )
        });
        let made = made.map_err(|error| Refusal::of_frame(&error));
        // A client that has gone needs no answer.
        let _ = request.answer.send(made);
    }

    /// Solves a job, and keeps its results.
    fn finish_job(&self, number: u64, workspace: &mut Workspace) -> anyhow::Result<()> {
        let started = now();
        let store = &self.server.store;
        let input = input_of_job(self.server, number);
        let solved = input.and_then(|input| {
            self.timed(&input, workspace, |solved, _| {
                Ok(self.results(&input, solved))
            })
        });
        if self.server.interrupt().is_due() {
            // The next start does it.
            return Ok(());
        }
        let (answers, files) = solved.unwrap_or_else(|error| {
            let reason = Refusal::of_frame(&error).message;
            (JobAnswers::failed(reason), Vec::new())
        });
        tracing::info!(
            job = number,
            is_identified = answers.calibration.is_some(),
            "done"
        );
        let finished = now();
        let result = JobResult {
            started,
            finished,
            answers,
        };
        store.finish(number, &result, files)
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
        self.server.metrics.begin();
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
        let content = &input.content.bytes[..];
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
pub(super) fn input_of_job(server: &Server, number: u64) -> anyhow::Result<Input> {
    let job = server.store.job(number)?;
    // They were read before they were kept.
    let upload = Upload::from_json(&job.settings)?;
    Ok(Input {
        name: job.name,
        content: Received::kept(server.store.upload(number)?),
        options: upload.in_options(server.options.clone()),
        page: None,
        upload: Some(upload),
    })
}

/// The time of the clock, UTC, as nova.astrometry.net writes it.
pub(super) fn now() -> String {
    Timestamp::now()
        .strftime("%Y-%m-%d %H:%M:%S.%6f")
        .to_string()
}
