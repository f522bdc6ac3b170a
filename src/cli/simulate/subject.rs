//! What the frames show.

use super::args::SimulateArgs;
use crate::cli::exit::CommandError;
use crate::cli::input::centroid_list;
use anyhow::anyhow;
use starpipe::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use starpipe::centroids::CentroidListOptions;
use starpipe::identify::Photometry;
use starpipe::lab::simulate::{Scene, Setup};
use std::path::Path;

/// What the frames show.
#[derive(Debug, Clone)]
pub(super) enum FrameSubject {
    /// The sky at a fixed attitude, or at a random attitude for each frame.
    Sky(Option<Rotation<Icrs, Camera>>),
    /// Stars at these positions, with these V magnitudes.
    Stars(Vec<(PixelPoint, f64)>),
    /// Nothing: the shutter is closed.
    Dark,
    /// The same light on each pixel, in electrons.
    Flat(f64),
}

impl FrameSubject {
    /// The subject that the options name.
    pub(super) fn of(arguments: &SimulateArgs, setup: &Setup) -> Result<Self, CommandError> {
        let has_no_sky = arguments.dark || arguments.flat.is_some();
        if has_no_sky && setup.scene != Scene::default() {
            return Err(CommandError::usage(
                "the options of the scene do not apply to dark frames and flat fields",
            ));
        }
        if let Some(path) = &arguments.stars {
            return Ok(Self::Stars(star_list(path, setup)?));
        }
        if arguments.dark {
            return Ok(Self::Dark);
        }
        if let Some(electrons) = arguments.flat {
            return Ok(Self::Flat(electrons));
        }
        let fixed = arguments.ra.zip(arguments.dec).map(|(ra_deg, dec_deg)| {
            let boresight = UnitVector::from_ra_dec(ra_deg.to_radians(), dec_deg.to_radians());
            Rotation::looking_at(&boresight, arguments.roll.to_radians())
        });
        Ok(Self::Sky(fixed))
    }

    /// Whether its frames have a table of what is on them.
    pub(super) const fn has_truth(&self) -> bool {
        matches!(self, Self::Sky(_) | Self::Stars(_))
    }

    /// The beginning of its files' names.
    pub(super) const fn stem(&self) -> &'static str {
        match self {
            Self::Sky(_) | Self::Stars(_) => "frame",
            Self::Dark => "dark",
            Self::Flat(_) => "flat",
        }
    }
}

/// Reads a list of stars, which must have V magnitudes.
fn star_list(path: &Path, setup: &Setup) -> anyhow::Result<Vec<(PixelPoint, f64)>> {
    let sheet = &setup.scenario.camera;
    let side = |pixels: usize| u32::try_from(pixels).ok();
    let mut options = CentroidListOptions::default();
    options.width = side(sheet.width_px);
    options.height = side(sheet.height_px);
    let list = centroid_list::read(path, &options)?;
    if list.photometry != Photometry::JohnsonV {
        let error = anyhow!("found no column vmag, expected the V magnitudes of the stars");
        return Err(error.context(format!("reading {}", path.display())));
    }
    let stars = list.centroids.iter();
    Ok(stars.map(|star| (star.position, star.mag)).collect())
}
