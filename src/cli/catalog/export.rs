//! `catalog export`: a catalogue for a flight computer, and how often frames are identified with it.

use crate::cli::exit::{CommandError, CommandOutput};
use crate::cli::options::values;
use anyhow::Context;
use clap::Args;
use starpipe::base::files;
use starpipe::base::format::counted;
use starpipe::catalog::Catalog;
use starpipe::flight::{self, BuildError, Trials};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe catalog export --fov 10:25 --limit 6.5 --budget 2MB -o sky.bin\n  \
    starpipe catalog export --fov 15 --limit 6 --budget 500kB --trials 10000 -o sky.bin\n\n\
    The report says how often frames of each field of view are identified: stars with errors of 0.1 px and 0.15 mag, also \
    those 0.5 mag fainter than the limit, on 1024 x 1024 pixels. They come from any direction, also where stars are rare.")]
pub(super) struct ExportArgs {
    /// Fields of view in degrees, along the shorter side of the frame: one, or the narrowest and the widest
    #[arg(long, value_name = "DEG[:DEG]", value_parser = fields_of_view)]
    fov: [f64; 2],
    /// Faintest stars, in Johnson V
    #[arg(long, value_name = "MAG", value_parser = values::finite, allow_hyphen_values = true)]
    limit: f64,
    /// Most bytes, such as 500kB or 2MB: the more, the more triangles
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    budget: usize,
    /// File to write
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Catalog to take the stars of [default: the built-in one]
    #[arg(long, value_name = "FILE")]
    catalog: Option<PathBuf>,
    /// Frames to try for each field of view
    #[arg(long, value_name = "N", default_value = "1000", value_parser = values::whole)]
    trials: usize,
    /// Seed of the random directions
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Two fields of view, the narrower one first.
fn fields_of_view(text: &str) -> Result<[f64; 2], String> {
    let (narrow, wide) = text.split_once(':').unwrap_or((text, text));
    let fov_deg = [values::field_of_view(narrow)?, values::field_of_view(wide)?];
    if fov_deg[0] > fov_deg[1] {
        return Err("the narrower field of view comes first".to_owned());
    }
    Ok(fov_deg)
}

/// Bytes, with a unit.
fn bytes(text: &str) -> Result<usize, String> {
    let end = text.find(|c: char| c.is_ascii_alphabetic());
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let unit = match unit {
        "" | "B" => 1.0,
        "kB" => 1e3,
        "MB" => 1e6,
        "KiB" => 1024.0,
        "MiB" => 1024.0 * 1024.0,
        _ => {
            return Err(values::not_of_form(
                text,
                "a number with B, kB, MB, KiB or MiB",
            ));
        }
    };
    let count = values::positive(number)? * unit;
    if count > f64::from(u32::MAX) {
        return Err("at most 4 GB".to_owned());
    }
    Ok(count as usize)
}

/// Writes the catalogue and reports what it is good for.
pub(super) fn export(arguments: &ExportArgs) -> Result<CommandOutput, CommandError> {
    let read = arguments
        .catalog
        .as_deref()
        .map(Catalog::read)
        .transpose()?;
    let catalog = read.as_ref().unwrap_or(Catalog::built_in());
    let ExportArgs {
        fov, limit, budget, ..
    } = *arguments;
    let exported = flight::export(catalog, fov, limit, budget);
    let exported = exported.map_err(|error| CommandError::Usage(refused(&error)))?;
    let report = report(arguments, catalog, &exported)?;
    files::write(&arguments.output, &exported)
        .with_context(|| format!("writing {}", arguments.output.display()))?;
    Ok(CommandOutput::success(report))
}

fn refused(error: &BuildError) -> String {
    let remedy = match error {
        BuildError::Budget { .. } => ": give more with --budget, or a brighter --limit",
        BuildError::Stars { .. } => ": see --limit",
        _ => ": see --fov",
    };
    format!("{error}{remedy}")
}

fn report(
    arguments: &ExportArgs,
    catalog: &Catalog,
    exported: &[u8],
) -> Result<String, CommandError> {
    let read = flight::ExportedCatalog::new(exported).map_err(anyhow::Error::from)?;
    let mut text = format!(
        "{}: {}, {}, {} bytes, hash {:016x}\n",
        arguments.output.display(),
        counted(read.len(), "star"),
        counted(read.triangles(), "triangle"),
        exported.len(),
        read.hash(),
    );
    let [narrow, wide] = arguments.fov;
    let mut fields_deg = vec![narrow, 0.5 * (narrow + wide), wide];
    fields_deg.dedup();
    for fov_deg in fields_deg {
        let (trials, seed) = (arguments.trials, arguments.seed);
        let tried = Trials::run(catalog, exported, fov_deg, trials, seed);
        text += &tried.map_err(anyhow::Error::from)?.to_text();
        text.push('\n');
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_and_sizes_have_their_units() {
        assert_eq!(fields_of_view("10:25"), Ok([10.0, 25.0]));
        assert_eq!(fields_of_view("15"), Ok([15.0, 15.0]));
        for text in ["25:10", "10:", ":10", "x", "10:25:30"] {
            assert!(fields_of_view(text).is_err(), "{text}");
        }
        assert_eq!(bytes("2MB"), Ok(2_000_000));
        assert_eq!(bytes("1.5kB"), Ok(1500));
        assert_eq!(bytes("64KiB"), Ok(65_536));
        assert_eq!(bytes("700"), Ok(700));
        assert_eq!(bytes("2 MB"), Ok(2_000_000));
        for text in ["", "MB", "2mb", "-1kB", "9999999MB", "1e3"] {
            assert!(bytes(text).is_err(), "{text}");
        }
    }
}
