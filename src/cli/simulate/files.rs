//! Where simulated frames are written, and as what.

use super::args::SimulateArgs;
use super::header::Description;
use super::{Job, Subject, named};
use crate::cli::exit::CommandError;
use crate::cli::output::rows::csv_table;
use anyhow::Context;
use clap::ValueEnum;
use serde::Serialize;
use starpipe::base::coords::{Camera, Icrs, PixelPoint, Rotation};
use starpipe::base::units::DEG_PER_RAD;
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::{FitsSamples, Frame, TiffOptions, TiffSamples, write_fits, write_tiff};
use starpipe::model::simulate::{TrueStar, Truth};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The kind of a file for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImageKind {
    /// TIFF
    Tiff,
    /// FITS
    Fits,
}

impl ImageKind {
    const fn extension(self) -> &'static str {
        match self {
            Self::Tiff => "tif",
            Self::Fits => "fits",
        }
    }

    fn of_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "tif" | "tiff" => Some(Self::Tiff),
            "fits" | "fit" | "fts" => Some(Self::Fits),
            _ => None,
        }
    }
}

/// Where the frames go.
pub(super) struct Place {
    /// A file for the one frame, or a directory for all.
    out: PathBuf,
    is_file: bool,
    stem: &'static str,
    has_truth: bool,
    kind: ImageKind,
    compressed: bool,
    bits: u32,
    numbers: std::ops::Range<u64>,
    may_overwrite: bool,
}

impl Place {
    pub(super) fn of(
        arguments: &SimulateArgs,
        subject: &Subject,
        sheet: &DataSheet,
    ) -> Result<Self, CommandError> {
        let named_kind = ImageKind::of_name(&arguments.out).filter(|_| !arguments.out.is_dir());
        if named_kind.is_some() && arguments.count > 1 {
            return Err(CommandError::Usage(format!(
                "--out {} is one file, expected a directory for {} frames",
                arguments.out.display(),
                arguments.count
            )));
        }
        if let (Some(named), Some(wanted)) = (named_kind, arguments.image)
            && named != wanted
        {
            return Err(CommandError::Usage(format!(
                "--out {} and --image contradict each other",
                arguments.out.display()
            )));
        }
        let kind = named_kind.or(arguments.image).unwrap_or(ImageKind::Tiff);
        if arguments.compress && kind == ImageKind::Fits {
            return Err(CommandError::Usage(
                "--compress is for TIFF files, and the frames are written as FITS".into(),
            ));
        }
        Ok(Self {
            out: arguments.out.clone(),
            is_file: named_kind.is_some(),
            stem: subject.stem(),
            has_truth: subject.has_truth(),
            kind,
            compressed: arguments.compress,
            bits: sheet.bits,
            numbers: arguments.first..arguments.first + arguments.count,
            may_overwrite: arguments.force,
        })
    }

    /// Makes the directory; refuses to write over what is there.
    pub(super) fn prepare(&self) -> Result<(), CommandError> {
        if !self.is_file {
            std::fs::create_dir_all(&self.out)
                .with_context(|| format!("making the directory {}", self.out.display()))?;
        }
        let both = |image: PathBuf| {
            let table = self.has_truth.then(|| image.with_extension("csv"));
            table.into_iter().chain([image])
        };
        let mut files = self.numbers.clone().map(|i| self.image(i)).flat_map(both);
        match files.find(|path| !self.may_overwrite && path.exists()) {
            Some(path) => Err(CommandError::Usage(format!(
                "{} exists; --force overwrites it",
                path.display()
            ))),
            None => Ok(()),
        }
    }

    /// The file for the frame with this number.
    pub(super) fn image(&self, number: u64) -> PathBuf {
        if self.is_file {
            return self.out.clone();
        }
        named(&self.out, self.stem, number, self.kind.extension())
    }

    /// The file's content.
    pub(super) fn encoded(
        &self,
        frame: &Frame,
        description: &Description,
    ) -> anyhow::Result<Vec<u8>> {
        match self.kind {
            ImageKind::Fits => {
                let samples = if self.bits <= 16 {
                    FitsSamples::Unsigned16
                } else {
                    FitsSamples::Float32
                };
                let mut content = Vec::new();
                write_fits(&mut content, frame, samples, &description.fits_header())?;
                Ok(content)
            }
            ImageKind::Tiff => {
                let samples = match self.bits {
                    ..=8 => TiffSamples::Unsigned8,
                    9..=16 => TiffSamples::Unsigned16,
                    _ => TiffSamples::Float32,
                };
                let mut content = Cursor::new(Vec::new());
                let options = TiffOptions {
                    samples,
                    compressed: self.compressed,
                    description: &description.text(),
                };
                write_tiff(&mut content, frame, &options)?;
                Ok(content.into_inner())
            }
        }
    }
}

/// A row of the table of what is on a frame.
#[derive(Debug, Serialize)]
struct TruthRow {
    /// star, false_star, trail or cosmic_ray
    kind: &'static str,
    id: Option<String>,
    vmag: Option<f64>,
    bv_mag: Option<f64>,
    ra_deg: Option<f64>,
    dec_deg: Option<f64>,
    x: f64,
    y: f64,
    /// Where it ends, of what has an end.
    x_end: Option<f64>,
    y_end: Option<f64>,
    electrons: Option<f64>,
    on_frame: bool,
}

/// The table of what is on a frame, brightest stars first.
pub(super) fn truth_table(
    truth: &Truth,
    job: &Job,
    attitude: Option<&Rotation<Icrs, Camera>>,
) -> anyhow::Result<Vec<u8>> {
    let camera = job.simulator.camera();
    let star = |star: &TrueStar| {
        let known = star.catalog.map(|index| job.catalog.star(index));
        let sky = attitude.map(|icrs_to_camera| {
            let direction = camera.direction_of(&star.position);
            let (ra_rad, dec_rad) = icrs_to_camera.inverse().apply(&direction).to_ra_dec();
            [ra_rad, dec_rad].map(|rad| decimals(rad * DEG_PER_RAD, 8))
        });
        TruthRow {
            // Of a list that was given all stars are as true as can be.
            kind: if known.is_some() || attitude.is_none() {
                "star"
            } else {
                "false_star"
            },
            id: star.catalog.map(|index| job.catalog.designation(index)),
            vmag: Some(decimals(star.v_mag, 4)),
            bv_mag: known
                .and_then(|known| known.bv_mag)
                .map(|bv_mag| decimals(f64::from(bv_mag), 3)),
            ra_deg: sky.map(|[ra_deg, _]| ra_deg),
            dec_deg: sky.map(|[_, dec_deg]| dec_deg),
            electrons: Some(decimals(star.electrons, 4)),
            ..row("star", star.position, None, camera.contains(&star.position))
        }
    };
    let mut stars: Vec<&TrueStar> = truth.stars.iter().chain(&truth.beyond).collect();
    stars.sort_by(|a, b| {
        b.electrons
            .total_cmp(&a.electrons)
            .then(a.number.cmp(&b.number))
    });
    let trails = truth
        .trails
        .iter()
        .map(|trail| row("trail", trail.from, Some(trail.to), true));
    let rays = truth.cosmic_rays.iter().map(|ray| TruthRow {
        electrons: Some(ray.electrons),
        ..row("cosmic_ray", ray.from, Some(ray.to), true)
    });
    let rows = stars.into_iter().map(star).chain(trails).chain(rays);
    Ok(csv_table(rows)?.into_bytes())
}

fn row(kind: &'static str, from: PixelPoint, to: Option<PixelPoint>, on_frame: bool) -> TruthRow {
    TruthRow {
        kind,
        id: None,
        vmag: None,
        bv_mag: None,
        ra_deg: None,
        dec_deg: None,
        x: decimals(from.x, 5),
        y: decimals(from.y, 5),
        x_end: to.map(|to| decimals(to.x, 5)),
        y_end: to.map(|to| decimals(to.y, 5)),
        electrons: None,
        on_frame,
    }
}

/// To so many decimals: what a table shows is the same on every machine.
fn decimals(value: f64, count: usize) -> f64 {
    format!("{value:.count$}").parse().unwrap_or(value)
}
