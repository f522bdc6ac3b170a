//! `catalog import`: converts star catalogues.

use super::exit::{CommandError, CommandOutput};
use super::options::values;
use super::output::overwrite::is_same_file;
use anyhow::anyhow;
use clap::{Args, Subcommand};
use starpipe::base::format::counted;
use starpipe::catalog::{self, SourceFile};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  starpipe catalog import hipparcos.tsv -o hipparcos.cat")]
pub(crate) struct CatalogArgs {
    #[command(subcommand)]
    command: CatalogCommand,
}

#[derive(Debug, Subcommand)]
enum CatalogCommand {
    /// Convert a catalog from its published form into the compact form that --catalog loads
    /// fastest
    Import(ImportArgs),
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe catalog import SKYMAP_SKY2000_V5R4.gz --vmag-limit 8 -o bright.cat\n  \
    starpipe catalog import tycho2/ -o tycho2.cat\n  \
    starpipe catalog import hipparcos.tsv -o hipparcos.cat\n\n\
    Formats, plain or gzip, recognized from the content: SKY2000 records; the files of Tycho-2 (tyc2.dat*, \
    suppl_1.dat), one or a directory of them; tables, CSV or TSV, with a heading for each of identifier (id, \
    hip, tyc, source_id, name, ...), position (ra and dec, raj2000 and dej2000, ra_hours, ... in degrees or \
    as 05:34:48.0), magnitude (vmag, mag, vtmag, phot_g_mean_mag, ...) and, if available, proper \
    motion (pmra, pmdec in mas a year) and epoch (ref_epoch).")]
struct ImportArgs {
    /// Catalog to read, a file or a directory
    file: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Leave out stars fainter than this Johnson V magnitude
    #[arg(long, value_name = "MAG", value_parser = values::finite, allow_hyphen_values = true)]
    vmag_limit: Option<f64>,
}

/// `starpipe catalog`
pub(crate) fn catalog(arguments: CatalogArgs) -> Result<CommandOutput, CommandError> {
    match arguments.command {
        CatalogCommand::Import(arguments) => import(&arguments),
    }
}

fn import(arguments: &ImportArgs) -> Result<CommandOutput, CommandError> {
    let reading = catalog::import(&arguments.file)?;
    check_output(&arguments.output, &reading.files)?;
    let mut catalog = reading.catalog;
    if let Some(limit) = arguments.vmag_limit {
        catalog = catalog.limited_to(limit);
        if catalog.stars().is_empty() {
            let file = arguments.file.display();
            let error = anyhow!("{file}: no star is brighter than V {limit} (--vmag-limit)");
            return Err(error.into());
        }
    }
    catalog.write_compact(&arguments.output)?;
    let mut text = String::new();
    for file in reading.files {
        let (path, kind) = (file.path.display(), &file.kind);
        text += &format!("{path} ({kind}): {}\n", file.summary);
    }
    text += &format!(
        "{}: {}, {}\n",
        arguments.output.display(),
        counted(catalog.stars().len(), "star"),
        catalog.title(),
    );
    Ok(CommandOutput::success(text))
}

/// Refuses to overwrite a file that is read.
fn check_output(output: &Path, sources: &[SourceFile]) -> Result<(), CommandError> {
    if sources
        .iter()
        .any(|source| is_same_file(&source.path, output))
    {
        return Err(CommandError::Usage(format!(
            "the compact catalog would overwrite the input {}; choose another file for --output",
            output.display()
        )));
    }
    Ok(())
}
