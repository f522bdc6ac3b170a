//! `archive`: how far an archive is, its tables in one file each, and what its nights were like.

mod nights;
mod page;

use super::exit::{CommandError, CommandOutput, Exit};
use super::options::format::OutputFormat;
use super::output::files::{make_directory, write_each};
use super::output::messages::report_warning;
use super::output::rows::{csv_table, json_line, json_lines};
use super::page::HtmlOption;
use clap::{Args, Subcommand};
use nights::{NightLine, nights_text};
use starpipe::base::format::{printable, ranges};
use starpipe::store::{Archive, ArchiveStatus, PartState, merge, status, summary};
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe process 'night/*.fits' --out-parquet results\n  \
    starpipe archive status results\n  \
    starpipe archive merge results --out tables\n  \
    starpipe archive report results")]
pub(crate) struct ArchiveArgs {
    #[command(subcommand)]
    command: ArchiveCommand,
}

#[derive(Debug, Subcommand)]
enum ArchiveCommand {
    /// Show finished and missing parts and failed frames; the exit status is 3 if parts are missing or damaged
    #[command(after_help = "Example:\n  starpipe archive status results")]
    Status(StatusArgs),
    /// Merge the parts of each table into one file, sorted by frame name
    #[command(after_help = "Example:\n  starpipe archive merge results --out tables")]
    Merge(MergeArgs),
    /// Report the limiting magnitude of each night and camera, and the predicted one
    #[command(after_help = "Examples:\n  \
        starpipe archive report results --format csv > nights.csv\n  \
        starpipe archive report results --html=night.html")]
    Report(ReportArgs),
}

#[derive(Debug, Args)]
struct StatusArgs {
    /// Directory that process --out-parquet has written
    directory: PathBuf,
    /// What to print
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    format: OutputFormat,
}

#[derive(Debug, Args)]
struct MergeArgs {
    /// Directory that process --out-parquet has written
    directory: PathBuf,
    /// Directory for frames.parquet and stars.parquet
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Args)]
struct ReportArgs {
    /// Directory that process --out-parquet has written
    directory: PathBuf,
    #[command(flatten)]
    html: HtmlOption,
    /// What to print
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    format: OutputFormat,
}

/// Frames that could not be read of which the text for people tells.
const UNREAD_SHOWN: usize = 10;

/// `starpipe archive`
pub(crate) fn archive(arguments: &ArchiveArgs) -> Result<CommandOutput, CommandError> {
    match &arguments.command {
        ArchiveCommand::Status(arguments) => tell_status(arguments),
        ArchiveCommand::Merge(arguments) => merge_tables(arguments),
        ArchiveCommand::Report(arguments) => report(arguments),
    }
}

fn tell_status(arguments: &StatusArgs) -> Result<CommandOutput, CommandError> {
    let status = status(&Archive::open(&arguments.directory)?)?;
    let text = match arguments.format {
        OutputFormat::Text => status_text(&status),
        OutputFormat::Json => json_line(&status)?,
        OutputFormat::Csv => csv_table(status.unread.iter())?,
    };
    let exit = if status.is_complete() {
        Exit::Success
    } else {
        Exit::Unmet
    };
    Ok(CommandOutput { text, exit })
}

fn status_text(status: &ArchiveStatus) -> String {
    let mut text = format!(
        "parts      {} of {}\nfiles      {} of {}\n\
         frames     {}: {} identified, {} not identified, {} unreadable\n",
        status.parts_done,
        status.parts,
        status.files_done,
        status.files,
        status.frames,
        status.identified,
        status.not_identified,
        status.unread.len()
    );
    if !status.missing_parts.is_empty() {
        let _ = writeln!(text, "missing    parts {}", ranges(&status.missing_parts));
    }
    if !status.damaged_parts.is_empty() {
        let parts = ranges(&status.damaged_parts);
        let _ = writeln!(
            text,
            "damaged    parts {parts}; repeat the same `process` command to rewrite them"
        );
    }
    for unread in status.unread.iter().take(UNREAD_SHOWN) {
        let (frame, reason) = (printable(&unread.frame), printable(&unread.reason));
        let _ = writeln!(text, "unreadable {frame}: {reason}");
    }
    if status.unread.len() > UNREAD_SHOWN {
        let more = status.unread.len() - UNREAD_SHOWN;
        let _ = writeln!(text, "unreadable {more} more, listed by --format csv");
    }
    text
}

fn merge_tables(arguments: &MergeArgs) -> Result<CommandOutput, CommandError> {
    let archive = Archive::open(&arguments.directory)?;
    make_directory(&arguments.out)?;
    let files = merge(&archive, &arguments.out)?;
    let names = files.map(|path| format!("{}\n", path.display()));
    Ok(CommandOutput::success(names.concat()))
}

fn report(arguments: &ReportArgs) -> Result<CommandOutput, CommandError> {
    let archive = Archive::open(&arguments.directory)?;
    let default = || arguments.directory.join("report.html");
    let page_path = arguments.html.checked_path(&[], default)?;
    let damaged: Vec<_> = archive.tables_of_frames(PartState::Damaged).collect();
    for path in &damaged {
        report_warning(format_args!("{} is damaged: it is ignored", path.display()));
    }
    let nights = summary(&archive)?;
    let page = page_path.map(|path| super::page::file(&path, &page::build(&archive, &nights)?));
    let all_written = write_each(page);
    let text = match arguments.format {
        OutputFormat::Text => nights_text(&nights),
        OutputFormat::Json => json_lines(nights.iter())?,
        OutputFormat::Csv => csv_table(nights.iter().map(NightLine::from_night))?,
    };
    let exit = if damaged.is_empty() {
        Exit::Success
    } else {
        Exit::Failure
    };
    Ok(CommandOutput { text, exit }.if_written(all_written))
}
