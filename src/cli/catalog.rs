//! `catalog import`.

use super::exit::{CommandError, Exit};
use super::options::values;
use super::output::stdout::print;
use anyhow::anyhow;
use clap::{Args, Subcommand};
use starpipe::base::format::counted;
use starpipe::sky::catalog::{self, SourceFile};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct CatalogArgs {
    #[command(subcommand)]
    pub(crate) command: CatalogCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CatalogCommand {
    /// Turn a catalogue as it is distributed into the compact form that --catalog takes
    #[command(after_help = "Examples:\n  \
        starpipe catalog import SKYMAP_SKY2000_V5R4.gz --vmag-limit 8 -o bright.cat\n  \
        starpipe catalog import tycho2/ -o tycho2.cat\n  \
        starpipe catalog import hipparcos.tsv -o hipparcos.cat\n\n\
        Kinds, plain or gzip, found out from the content: SKY2000 records; the files of Tycho-2 (tyc2.dat*, \
        suppl_1.dat), one or a directory of them; tables, CSV or TSV, with a heading for each of identifier (id, \
        hip, tyc, source_id, name, ...), position (ra and dec, raj2000 and dej2000, ra_hours, ... in degrees or \
        as 05:34:48.0), magnitude (vmag, mag, vtmag, phot_g_mean_mag, ...) and, where there are such, proper \
        motion (pmra, pmdec in mas a year) and epoch (ref_epoch).")]
    Import(ImportArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// Catalogue to read, a file or a directory
    pub(crate) file: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Leave out stars fainter than this Johnson V magnitude
    #[arg(long, value_name = "MAG", value_parser = values::finite, allow_hyphen_values = true)]
    pub(crate) vmag_limit: Option<f64>,
}

/// `starpipe catalog`
pub(crate) fn catalog(arguments: CatalogArgs) -> Result<Exit, CommandError> {
    match arguments.command {
        CatalogCommand::Import(arguments) => import(&arguments),
    }
}

fn import(arguments: &ImportArgs) -> Result<Exit, CommandError> {
    let reading = catalog::import(&arguments.file).map_err(anyhow::Error::from)?;
    check_output(&arguments.output, &reading.files)?;
    let mut catalog = reading.catalog;
    if let Some(limit) = arguments.vmag_limit {
        catalog = catalog.limited_to(limit);
        if catalog.stars().is_empty() {
            let file = arguments.file.display();
            return Err(
                anyhow!("{file}: no star is brighter than V {limit} (--vmag-limit)").into(),
            );
        }
    }
    let written = catalog.write_compact(&arguments.output);
    written.map_err(anyhow::Error::from)?;
    let mut told = String::new();
    for file in reading.files {
        let (path, kind) = (file.path.display(), &file.kind);
        told += &format!("{path} ({kind}): {}\n", file.summary);
    }
    told += &format!(
        "{}: {}, {}\n",
        arguments.output.display(),
        counted(catalog.stars().len(), "star"),
        catalog.title(),
    );
    // Nobody left to read it: nothing is lost.
    let _ = print(&told)?;
    Ok(Exit::Success)
}

/// Refuses to write the compact form over what it is made from.
fn check_output(output: &Path, sources: &[SourceFile]) -> Result<(), CommandError> {
    let found = output.canonicalize().ok();
    let clash = |source: &SourceFile| found.is_some() && source.path.canonicalize().ok() == found;
    if sources.iter().any(clash) {
        return Err(CommandError::Usage(format!(
            "the compact catalogue would overwrite the input {}; choose another file for --output",
            output.display()
        )));
    }
    Ok(())
}
