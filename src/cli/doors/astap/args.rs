//! The options of ASTAP.

use crate::cli::options::catalog::CatalogOptions;
use clap::Args;
use starpipe::catalog::deep::DeepCatalog;
use starpipe::doors::astap::Hints;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(
    override_usage = "astap -f <FILE> [OPTIONS]\n       starpipe astap -f <FILE> [OPTIONS]",
    after_help = "Examples:\n  \
    astap -f night.fits -fov 1.5 -ra 5.58 -spd 89.6 -r 10\n  \
    astap -f night.tif -o results/night -wcs\n  \
    starpipe astap -f night.fits -analyse 30\n\n\
    Options may have one dash, as ASTAP's have. Its options -s, -t, -m, -z, -check, -speed, -progress and\n\
    -debug are accepted, and not needed. Hints may be wrong: they are tried first.\n\
    Exit status: 0 solved, 1 no solution, 2 not enough stars, 16 the frame cannot be read,\n\
    34 the header cannot be updated."
)]
pub(crate) struct AstapArgs {
    /// Frame to solve
    #[arg(short = 'f', value_name = "FILE")]
    pub(super) file: Option<PathBuf>,
    /// Height of the field in degrees; 0 if it is not known [default: from the header, if it has
    /// one]
    #[arg(long, value_name = "DEG")]
    fov: Option<String>,
    /// Right ascension of the center in hours [default: from the header, if it has one]
    #[arg(long, value_name = "HOURS")]
    ra: Option<String>,
    /// Distance of the center from the south pole in degrees, which is its declination + 90
    #[arg(long, value_name = "DEG")]
    spd: Option<String>,
    /// How far from there the center may be, in degrees [default: 180]
    #[arg(short = 'r', value_name = "DEG")]
    radius: Option<String>,
    /// Name of the result files, in place of the frame's; its extension is replaced
    #[arg(short = 'o', value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Directory that may have a database of ASTAP, for narrow fields
    #[arg(short = 'd', value_name = "DIR")]
    databases: Option<PathBuf>,
    /// Which database in the directory of -d, such as d50
    #[arg(short = 'D', value_name = "NAME")]
    database: Option<String>,
    /// Write the .wcs file in blocks, as FITS has them, not in lines
    #[arg(long)]
    pub(super) wcs: bool,
    /// Also write the distortion of the lens, as SIP coefficients, into .wcs and headers
    #[arg(long)]
    pub(super) sip: bool,
    /// Also write the solution into the header of the frame, which must be FITS
    #[arg(long)]
    pub(super) update: bool,
    /// Also write what is printed into a .log file
    #[arg(long)]
    pub(super) log: bool,
    /// Print the median half-flux diameter of the stars with more signal to noise than this, and
    /// their number, in place of solving
    #[arg(long, value_name = "SNR")]
    analyse: Option<String>,
    /// The same, and write these stars into a .csv file
    #[arg(long, value_name = "SNR")]
    pub(super) extract: Option<String>,
    /// Solve, and write these stars with their directions into a .csv file
    #[arg(long, value_name = "SNR")]
    extract2: Option<String>,
    /// Jobs of ASTAP that are not done here.
    #[arg(long, hide = true)]
    pub(super) other_job: Vec<String>,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

impl AstapArgs {
    pub(super) fn hints(&self) -> Hints {
        Hints {
            height_deg: self.fov.as_deref().and_then(number),
            ra_h: self.ra.as_deref().and_then(number),
            south_pole_distance_deg: self.spd.as_deref().and_then(number),
            radius_deg: self.radius.as_deref().and_then(number),
        }
    }

    /// Least signal to noise of the stars that are measured in place of solving.
    pub(super) fn least_snr(&self) -> Option<f64> {
        let stated = self.extract.as_deref().or(self.analyse.as_deref())?;
        Some(number(stated).unwrap_or_default())
    }

    /// The same of those that are measured besides.
    pub(super) fn least_snr_beside(&self) -> Option<f64> {
        Some(number(self.extract2.as_deref()?).unwrap_or_default())
    }

    /// Takes the databases in the directory, if it has some that can be read; none is needed.
    pub(super) fn take_databases(&mut self) {
        let found = self.databases.as_deref();
        let found = found.and_then(|directory| database_in(directory, self.database.as_deref()));
        let is_readable =
            |path: &PathBuf| DeepCatalog::find(path).is_ok_and(|databases| !databases.is_empty());
        if let Some(path) = found.filter(is_readable) {
            self.catalog.set_if_none(path);
        }
    }
}

/// A file of the database with this name; without a name the directory, if it has any.
fn database_in(directory: &Path, name: Option<&str>) -> Option<PathBuf> {
    let files = fs::read_dir(directory).ok()?.filter_map(Result::ok);
    let mut files = files.map(|entry| entry.path()).filter(|path| {
        let ending = path.extension().and_then(|ending| ending.to_str());
        ending.is_some_and(|ending| ["1476", "290", "001"].contains(&ending))
    });
    let Some(name) = name else {
        return files.next().map(|_| directory.to_owned());
    };
    let start = format!("{}_", name.to_ascii_lowercase());
    files.find(|path| {
        let file = path.file_name().and_then(|file| file.to_str());
        file.is_some_and(|file| file.to_ascii_lowercase().starts_with(&start))
    })
}

/// A number with a point or a comma, as ASTAP takes it.
fn number(text: &str) -> Option<f64> {
    let value: f64 = text.trim().replace(',', ".").parse().ok()?;
    value.is_finite().then_some(value)
}
