//! The options of the suite of clutter.

use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::OutputFormat;
use crate::cli::options::setup::SetupOptions;
use clap::Args;
use starpipe::lab::clutter::ClutterKind;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(override_usage = "starpipe validate --suite clutter [OPTIONS]")]
#[command(mut_group("simulated", |cameras| cameras.required(false)))]
#[command(after_help = "Examples:\n  \
    starpipe validate --suite clutter --kinds blends,trails --count 20\n  \
    starpipe validate --suite clutter --preset imx174-35mm\n  \
    starpipe validate --suite clutter --camera camera.toml --kinds sky --count 250 --format csv > clutter.csv\n  \
    starpipe validate --suite clutter --preset imx174-35mm --kinds foliage,jpeg --count 5 --pictures pictures\n\n\
    Frames are simulated at random attitudes, with clutter in front of the sky or in it, and processed\n\
    without hints. Pictures without sky are processed, too; none of them should be identified.\n\
    Without --camera or --preset, every built-in camera is simulated in turn.\n\
    Kinds with sky: clean, foliage, edges, reflections, clouds, trails, false-stars, black-level, jpeg,\n\
    blends, hot-pixels, cosmic-rays;\n\
    without: noise, colored-noise, dots, text, drawings, foliage-alone, windows, snow, bokeh.")]
pub(crate) struct ClutterArgs {
    /// Frames of each kind
    #[arg(long, alias = "frames", value_name = "NUMBER", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub(super) count: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    /// Kinds of frames: all, sky, no-sky, or names separated by commas
    #[arg(long, value_name = "KIND,...", default_value = "all", value_parser = kinds)]
    pub(super) kinds: Kinds,
    /// Also write the first frames of each kind into this directory, as TIFF
    #[arg(long, value_name = "DIR")]
    pub(super) pictures: Option<PathBuf>,
    /// What to print
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    pub(super) format: OutputFormat,
    #[command(flatten)]
    pub(super) setup: SetupOptions,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

/// Kinds of frames, in their order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kinds(pub(super) Vec<ClutterKind>);

fn kinds(text: &str) -> Result<Kinds, String> {
    let all = ClutterKind::ALL.into_iter();
    let kinds: Vec<ClutterKind> = match text {
        "all" => all.collect(),
        "sky" => all.filter(|kind| kind.is_sky()).collect(),
        "no-sky" => all.filter(|kind| !kind.is_sky()).collect(),
        names => {
            let wanted: Result<Vec<ClutterKind>, String> = names.split(',').map(named).collect();
            let wanted = wanted?;
            all.filter(|kind| wanted.contains(kind)).collect()
        }
    };
    Ok(Kinds(kinds))
}

fn named(name: &str) -> Result<ClutterKind, String> {
    ClutterKind::named(name.trim()).ok_or_else(|| {
        let known = ClutterKind::ALL.map(ClutterKind::name).join(", ");
        format!("'{name}' is not one of all, sky, no-sky, {known}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_named_one_by_one_or_together() {
        assert_eq!(kinds("all").unwrap().0, ClutterKind::ALL);
        assert_eq!(kinds("sky").unwrap().0.len(), 12);
        assert_eq!(kinds("no-sky").unwrap().0.len(), 9);
        let two = kinds("jpeg, foliage").unwrap().0;
        assert_eq!(two, [ClutterKind::Foliage, ClutterKind::Jpeg]);
        assert!(kinds("").unwrap_err().contains("foliage"));
        assert!(kinds("jpeg,sea").unwrap_err().contains("'sea'"));
    }
}
