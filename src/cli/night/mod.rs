//! `night`: a night of one camera on its mount.

mod args;
mod dark;
mod files;
mod hot;
mod order;
mod page;
mod passed_over;
mod read;
mod run;
mod text;

pub(crate) use args::NightArgs;

use super::exit::{CommandError, CommandOutput, Exit};
use super::input::names::frame_names;
use super::options::format::PageFormat;
use super::output::files::write_each;
use super::output::messages::{report_mended, report_warning};
use super::output::rows::json_line;
use super::solving::SolvingPlan;
use run::{BATCH, MeasuredNight, NightRun};
use starpipe::catalog::Catalog;
use starpipe::frame::Cameras;
use starpipe::identify::lens::MEASURED_BY;
use starpipe::night::{NightRow, PassedOverFiles, SkyglowStation, summarize};
use starpipe::store::{
    Configuration, Identity, Journal, NightConfiguration, Plan, claim, has_row_of,
};
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;

/// `starpipe night`
pub(crate) fn night(arguments: &NightArgs) -> Result<CommandOutput, CommandError> {
    let plan = arguments.plan()?;
    let (names, mut passed_over) = frame_names(&arguments.frames, Cameras::OneNight)?;
    passed_over.retain(|file| !is_own_result(&arguments.out, &file.path));
    let (catalog, tells) = (&arguments.catalog, !arguments.quiet);
    catalog.with_index_reporting(tells, |pool, indexed| {
        let names = order::by_date(names, pool, plan.memory);
        let owner = claim_directory(arguments, &plan, &names, indexed.catalog())?;
        let (path, name) = (arguments.out.join(files::ROWS), |row: &NightRow| {
            row.frame.clone()
        });
        let (journal, kept) = Journal::open(&path, owner.text(), &names, name)?;
        journal.left_out().iter().for_each(report_warning);
        let run = NightRun {
            pool,
            plan: &plan,
            context: plan.context(indexed),
            is_quiet: arguments.quiet,
        };
        let start = run.start(&names);
        let dark = dark::learn(&run, &names, &start);
        let start = start.with_dark_level(dark);
        let hot = hot::learn(&run, &names, &start);
        let list = hot.as_ref().map(|pixels| {
            let path = arguments.out.join(files::HOT_PIXELS);
            Ok((path, hot::table(pixels)?.into_bytes()))
        });
        let list_is_written = write_each(list);
        let masked = match &hot {
            Some(pixels) if arguments.mask_hot_pixels && !pixels.is_empty() => {
                arguments.masked_calibration()?
            }
            _ => None,
        };
        let run = run.with_calibration(masked.as_ref());
        let measured = run.measure(&names, start, journal, kept)?;
        let beside = Beside {
            hot_pixels: hot.map(|pixels| pixels.len()),
            passed_over: passed_over::counts(&passed_over, &measured.rows),
        };
        Ok(finish(arguments, &measured, beside)?.if_written(list_is_written))
    })
}

/// What is told of a night besides its rows.
struct Beside {
    hot_pixels: Option<usize>,
    passed_over: Vec<PassedOverFiles>,
}

/// Whether a file is a result of an earlier run of the same night.
fn is_own_result(out: &Path, path: &Path) -> bool {
    let mut names = files::FILES.results.iter().chain([&files::FILES.identity]);
    names.any(|name| out.join(name) == path)
}

/// Takes the directory for this run, or goes on in it. Returns whose it is.
fn claim_directory(
    arguments: &NightArgs,
    plan: &SolvingPlan,
    names: &[String],
    catalog: &Catalog,
) -> Result<Identity, CommandError> {
    let directory = &arguments.out;
    let frames = Plan::new(names.to_vec(), NonZeroUsize::new(BATCH).expect("not 0"))?;
    let identity = Identity::new(&frames, &configuration(arguments, plan, catalog)?)?;
    let is_own = || is_own(directory, &identity);
    let mended = claim(directory, files::FILES, &identity, is_own);
    let mended = mended.map_err(|error| CommandError::of_store(error, "--out"))?;
    report_mended(mended.as_slice());
    Ok(identity)
}

/// Whether the rows in the directory, if there are any, are of the run.
fn is_own(directory: &Path, identity: &Identity) -> bool {
    let rows = fs::read(directory.join(files::ROWS)).unwrap_or_default();
    rows.is_empty() || has_row_of(&rows, identity.text())
}

/// All that the rows depend on.
fn configuration(
    arguments: &NightArgs,
    plan: &SolvingPlan,
    catalog: &Catalog,
) -> anyhow::Result<Configuration> {
    let NightArgs {
        calibration, hints, ..
    } = arguments;
    Ok(Configuration {
        night: Some(NightConfiguration {
            mask_hot_pixels: arguments.mask_hot_pixels,
        }),
        ..calibration.configuration(catalog, &plan.options, hints)?
    })
}

/// Writes the files of a night, and says what it was.
fn finish(
    arguments: &NightArgs,
    measured: &MeasuredNight,
    beside: Beside,
) -> Result<CommandOutput, CommandError> {
    let MeasuredNight {
        rows,
        history,
        start,
    } = measured;
    let mut night = summarize(rows, start.site, history.jumps());
    night.hot_pixels = beside.hot_pixels;
    night.passed_over = beside.passed_over;
    night.site_or_time.clone_from(&start.site_or_time);
    let station = SkyglowStation {
        instrument: arguments.station.instrument.clone(),
        supplier: arguments.station.supplier.clone(),
        location: arguments.station.location.clone(),
        site: start.site,
    };
    let about = || {
        vec![format!(
            "{MEASURED_BY} {} in frames of a night",
            env!("CARGO_PKG_VERSION")
        )]
    };
    let lens = start.lens.as_ref().map(|lens| lens.to_toml(&about()));
    let directory: &Path = &arguments.out;
    let lens = lens.map(|lens| Ok((directory.join(files::LENS), lens.into_bytes())));
    let page = arguments.html.then(|| {
        let page = page::build(rows, &night, &files::csv(rows)?)?;
        super::page::file(&directory.join(files::PAGE), &page)
    });
    let results = files::of_rows(directory, rows, &night, &station);
    let all_written = write_each(results.into_iter().chain(lens).chain(page));
    let exit = if night.unread > 0 {
        Exit::Failure
    } else if night.identified == 0 {
        Exit::NotIdentified
    } else {
        Exit::Success
    };
    let text = match arguments.format {
        None if arguments.quiet => String::new(),
        None | Some(PageFormat::Text) => text::text(&night),
        Some(PageFormat::Json) => json_line(&night)?,
    };
    Ok(CommandOutput { text, exit }.if_written(all_written))
}
