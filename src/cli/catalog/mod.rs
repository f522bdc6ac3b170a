//! `catalog`: converts star catalogues, tells what they have, and which ones a field needs.

mod export;

use crate::cli::exit::{CommandError, CommandOutput};
use crate::cli::options::values;
use crate::cli::output::overwrite::is_same_file;
use anyhow::anyhow;
use clap::{Args, Subcommand};
use export::ExportArgs;
use starpipe::base::format::counted;
use starpipe::catalog::deep::{DeepCatalog, DeepContents, installed_paths, narrowest_fov_deg};
use starpipe::catalog::{self, Catalog, SourceFile};
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
    /// Write stars and triangles for a flight computer, as starpipe-flight and its C interface read them in
    /// place
    Export(ExportArgs),
    /// Tell what a catalog has: stars, depth, epoch, and the narrowest field it is enough for
    Info(InfoArgs),
    /// Tell which catalogs have enough stars for a field of view, and where to get them
    Recommend(RecommendArgs),
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe catalog info\n  \
    starpipe catalog info /usr/share/astrometry\n  \
    starpipe catalog info /opt/astap")]
struct InfoArgs {
    /// Catalog, a file or a directory [default: the built-in one and all that are installed]
    path: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  starpipe catalog recommend --fov 0.5")]
struct RecommendArgs {
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view)]
    fov: f64,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe catalog import SKYMAP_SKY2000_V5R4.gz --vmag-limit 8 -o bright.cat\n  \
    starpipe catalog import tycho2/ -o tycho2.cat\n  \
    starpipe catalog import hipparcos.tsv -o hipparcos.cat\n\n\
    Formats, plain or gzip, recognized from the content: SKY2000 records; the files of Tycho-2 (tyc2.dat*, \
    suppl_1.dat), one or a directory of them; tables, CSV, TSV or VOTable, with a heading for each of identifier (id, \
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
        CatalogCommand::Export(arguments) => export::export(&arguments),
        CatalogCommand::Info(arguments) => info(&arguments),
        CatalogCommand::Recommend(arguments) => {
            Ok(CommandOutput::success(recommend(arguments.fov)))
        }
    }
}

/// What a catalogue has, or the built-in one and those that are installed.
fn info(arguments: &InfoArgs) -> Result<CommandOutput, CommandError> {
    let Some(path) = &arguments.path else {
        let mut text = of_memory("built in", Catalog::built_in());
        for path in installed_paths() {
            text += &of_path(&path, DeepCatalog::find_installed(&path)?);
        }
        return Ok(CommandOutput::success(text));
    };
    let text = match DeepCatalog::find(path)? {
        found if found.is_empty() => {
            of_memory(&path.display().to_string(), &catalog::read(path)?.catalog)
        }
        found => of_path(path, found),
    };
    Ok(CommandOutput::success(text))
}

/// What the catalogues that were found in a path have.
fn of_path(path: &Path, found: Vec<DeepCatalog>) -> String {
    let path = path.display().to_string();
    let described = found.iter().map(|deep| {
        let contents = deep.contents();
        described(&path, &contents, None)
    });
    described.collect()
}

fn of_memory(path: &str, catalog: &Catalog) -> String {
    let range = catalog.stars().first().zip(catalog.stars().last());
    let range = range.map(|(brightest, faintest)| [brightest.v_mag, faintest.v_mag]);
    described(path, &DeepContents::of(catalog), range)
}

fn described(path: &str, contents: &DeepContents, range_v_mag: Option<[f32; 2]>) -> String {
    let mut lines = vec![
        format!("{path}: {}", contents.kind),
        format!("  stars       {}", contents.stars),
        format!(
            "  density     {:.3} per square degree",
            contents.per_sq_deg()
        ),
        format!("  magnitudes  {}", contents.band),
    ];
    let range =
        range_v_mag.map(|[bright, faint]| format!("  range       V {bright:.2} to {faint:.2}"));
    lines.extend(range);
    let epoch = contents
        .epoch_year
        .map(|year| format!("  epoch       {year:.1}"));
    lines.extend(epoch);
    let share = contents.share_of_sky;
    if share < 0.995 {
        lines.push(format!("  coverage    {:.1} % of the sky", 100.0 * share));
    }
    lines.push(format!(
        "  fields      from {:.2}° wide, where stars are as dense as on average",
        contents.narrowest_fov_deg()
    ));
    lines.join("\n") + "\n"
}

/// Catalogues that people have: density of their stars, and where to get them.
const KNOWN: [(f64, &str); 8] = [
    (7.3, "SKY2000, built in"),
    (
        45.4,
        "Tycho-2 of astrometry.net, 140 MB: Debian's package astrometry-data-tycho2-07, or the file \
         index-4107.fits of https://data.astrometry.net/4100",
    ),
    (
        61.6,
        "Tycho-2 of the CDS, 530 MB: https://cdsarc.cds.unistra.fr/ftp/I/259",
    ),
    (
        400.0,
        "Gaia DR3 to G 14 around your target, CSV or VOTable: https://gea.esac.esa.int/archive",
    ),
    (
        500.0,
        "D05 of ASTAP, 100 MB: https://www.hnsky.org/astap.htm",
    ),
    (
        2000.0,
        "D20 of ASTAP, 400 MB: https://www.hnsky.org/astap.htm",
    ),
    (
        5000.0,
        "D50 of ASTAP, 900 MB: https://www.hnsky.org/astap.htm",
    ),
    (
        8000.0,
        "D80 of ASTAP, 1.2 GB: https://www.hnsky.org/astap.htm",
    ),
];

/// Which catalogues have stars enough for a field of this width.
fn recommend(fov_deg: f64) -> String {
    let is_enough = |per_sq_deg: f64| narrowest_fov_deg(per_sq_deg) <= fov_deg;
    let area_sq_deg = fov_deg * fov_deg / 1.5;
    let mut text = String::new();
    for (per_sq_deg, name) in KNOWN
        .iter()
        .filter(|(per_sq_deg, _)| is_enough(*per_sq_deg))
    {
        let stars = (per_sq_deg * area_sq_deg).round();
        text += &format!("{name}\n  {stars} stars in a field of {fov_deg}°\n");
    }
    if text.is_empty() {
        let narrowest_deg = narrowest_fov_deg(KNOWN[KNOWN.len() - 1].0);
        return format!(
            "No catalog in use has enough stars for a field of {fov_deg}°; the densest is enough for {narrowest_deg:.2}°.\n"
        );
    }
    text + "Catalogs in STARPIPE_CATALOGS, in starpipe/catalogs in the user's folder for data, in share/starpipe/catalogs, and \
            those that astrometry.net and ASTAP have installed are found without an option; others with --catalog PATH.\n"
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
