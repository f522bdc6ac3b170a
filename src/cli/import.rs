//! `catalog import`.

use super::args::{CatalogArgs, CatalogCommand, ImportArgs};
use super::output::print;
use super::{Exit, Fault};
use anyhow::anyhow;
use starpipe::base::format::counted;
use starpipe::sky::catalog::{self, SourceFile};
use std::path::Path;

/// `starpipe catalog`
pub(crate) fn catalog(arguments: CatalogArgs) -> Result<Exit, Fault> {
    match arguments.command {
        CatalogCommand::Import(arguments) => import(&arguments),
    }
}

fn import(arguments: &ImportArgs) -> Result<Exit, Fault> {
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
fn check_output(output: &Path, sources: &[SourceFile]) -> Result<(), Fault> {
    let found = output.canonicalize().ok();
    let clash = |source: &SourceFile| found.is_some() && source.path.canonicalize().ok() == found;
    if sources.iter().any(clash) {
        return Err(Fault::Usage(format!(
            "the compact catalogue would overwrite the input {}; choose another file for --output",
            output.display()
        )));
    }
    Ok(())
}
