//! What waits for a worker.

use super::refusal::Refusal;
use axum::body::Bytes;
use starpipe::doors::nova::Upload;
use starpipe::report::overlay::{Rings, SkyLayers};
use starpipe::solve::SolveOptions;
use std::num::NonZeroUsize;
use tokio::sync::oneshot;

/// What waits for a worker.
pub(super) enum Work {
    /// A job of the store.
    Job(u64),
    /// A request whose client waits.
    Request(Request),
}

/// A frame, and what its client wants of it.
pub(super) struct Request {
    pub(super) source: Source,
    pub(super) wanted: Wanted,
    pub(super) answer: oneshot::Sender<Result<Bytes, Refusal>>,
}

/// Where a frame comes from.
pub(super) enum Source {
    /// The request.
    Given(Box<Input>),
    /// The upload of this job, which the worker reads: what waits needs no memory.
    Job(u64),
}

/// A frame, or a list of stars, and what is stated for it.
pub(super) struct Input {
    pub(super) name: String,
    pub(super) content: Bytes,
    pub(super) options: SolveOptions,
    /// Which image of a file with several, from 1; by default the main one.
    pub(super) page: Option<NonZeroUsize>,
    /// The settings of an upload, whose hints may be wrong.
    pub(super) upload: Option<Upload>,
}

/// What is made of a solved frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The report as JSON.
    Report,
    /// What the page shows: the report, and the elements and data of its view.
    View,
    /// The page of `process --html`.
    Html,
    /// The detections as a table.
    Csv,
    /// The coordinates as a FITS header.
    Wcs,
    /// The frame as PNG, with these marks.
    Picture(Rings, SkyLayers),
    /// The frame with its stars named.
    Annotated,
    /// The frame with all detections marked.
    Detections,
    /// A copy with coordinates.
    SolvedCopy,
}
