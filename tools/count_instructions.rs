//! What `scripts/count-instructions` counts: each stage of a frame, when its buffers are there.
//!
//! usage: `count_instructions FRAME`

use starpipe::catalog::Catalog;
use starpipe::detect::{self, DetectConfig, Detections, detect_into};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{self, Frame};
use starpipe::identify::{self, IndexedCatalog, Priors, StarField};
use starpipe::solve::{Context, Workspace, find_pointing_in, solve_frame, star_field};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;

#[inline(never)]
fn stage_read(path: &Path, buffers: &mut frame::Buffers) -> Result<Frame<'static>, Box<dyn Error>> {
    Ok(frame::read_page_with(path, None, buffers)?)
}

/// The first phase: the pointing alone.
#[inline(never)]
fn stage_pointing(
    frame: &Frame,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<(), Box<dyn Error>> {
    let found = find_pointing_in(frame, context, workspace)?;
    black_box(found.ok_or("the pointing is not found")?);
    Ok(())
}

#[inline(never)]
fn stage_detect(
    frame: &Frame,
    workspace: &mut detect::Workspace,
    found: &mut Detections,
) -> Result<(), Box<dyn Error>> {
    Ok(detect_into(
        frame,
        &DetectConfig::default(),
        workspace,
        found,
    )?)
}

#[inline(never)]
fn stage_search(
    field: &StarField,
    indexed: &IndexedCatalog,
    workspace: &mut identify::Workspace,
) -> Result<(), Box<dyn Error>> {
    let found = workspace.find_pointing(field, &Priors::default(), indexed);
    black_box(found.map(|_| ()).map_err(|failure| failure.code())?);
    Ok(())
}

/// The search and the names.
#[inline(never)]
fn stage_identify(
    field: &StarField,
    indexed: &IndexedCatalog,
    workspace: &mut identify::Workspace,
) -> Result<(), Box<dyn Error>> {
    let found = workspace.identify(field, &Priors::default(), indexed);
    black_box(found.map_err(|failure| failure.code())?);
    Ok(())
}

/// Both phases, and photometry: all but reading.
#[inline(never)]
fn stage_solve(
    frame: &Frame,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<(), Box<dyn Error>> {
    black_box(solve_frame(frame, context, workspace)?);
    Ok(())
}

/// Buffers of all stages.
#[derive(Default)]
struct Buffers {
    frames: frame::Buffers,
    detect: detect::Workspace,
    identify: identify::Workspace,
    solve: Workspace,
    found: Detections,
}

fn round(path: &Path, context: &Context, buffers: &mut Buffers) -> Result<(), Box<dyn Error>> {
    let frame = stage_read(path, &mut buffers.frames)?;
    stage_pointing(&frame, context, &mut buffers.solve)?;
    stage_detect(&frame, &mut buffers.detect, &mut buffers.found)?;
    let field = star_field(&frame, &buffers.found, StarPlaces::default());
    stage_search(&field, context.indexed, &mut buffers.identify)?;
    stage_identify(&field, context.indexed, &mut buffers.identify)?;
    stage_solve(&frame, context, &mut buffers.solve)?;
    buffers.frames.recycle(frame);
    Ok(())
}

/// Counting begins here.
#[inline(never)]
fn counted_round(
    path: &Path,
    context: &Context,
    buffers: &mut Buffers,
) -> Result<(), Box<dyn Error>> {
    round(path, context, buffers)
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os()
        .nth(1)
        .ok_or("usage: count_instructions FRAME")?;
    let path = Path::new(&path);
    let cache = identify::cache_directory();
    let indexed = IndexedCatalog::open(Catalog::built_in(), cache.as_deref(), &|_| {});
    let context = Context::new(&indexed);
    let mut buffers = Buffers::default();
    round(path, &context, &mut buffers)?;
    counted_round(path, &context, &mut buffers)
}
