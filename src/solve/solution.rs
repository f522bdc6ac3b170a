//! What was found in one frame, or in one list of centroids.

use super::body_in_frame::BodyInFrame;
use super::note::Note;
use super::outcome::{Outcome, Reason};
use super::place_time::PlaceTime;
use super::source::Source;
use super::stopwatch::Timing;
use crate::calibration::Applied;
use crate::catalog::{Catalog, StarIndex};
use crate::detect::{SkyArea, Trail};
use crate::ephemeris::observer::{Observation, Site};
use crate::ephemeris::places::AttitudeFrame;
use crate::frame::RowOrder;
use crate::identify::fit::MeasuredStar;
use crate::identify::lens::{LensFrame, Unfit};
use crate::identify::{FrameDate, Identification, IndexedCatalog, SourceIndex, StarMatch};
use crate::photometry::FramePhotometry;
use crate::photometry::comparison::Comparison;
use crate::sky::SkyMap;
use std::fmt;
use std::sync::Arc;

/// What was found in one frame, or in one list of centroids.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Solution {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Order of the rows in the frame's file; a list of centroids has none.
    pub row_order: Option<RowOrder>,
    /// When the frame was taken, if known. Otherwise star positions are those of J2000.0.
    pub date: Option<FrameDate>,
    /// The frame's centre in the observer's sky, where the frame is identified, and site and time
    /// of day are known.
    pub observation: Option<Observation>,
    /// What the stars contradict of the place and the time that are stated.
    pub place_time: Option<PlaceTime>,
    /// Where the frame was taken, if known, and not contradicted.
    pub site: Option<Site>,
    /// Exposure time, in seconds, if known.
    pub exposure_s: Option<f64>,
    /// Standard deviation of the Gaussian spot before pixel integration, in pixels; a list of centroids has
    /// none.
    pub spot_sigma_px: Option<f64>,
    /// What is odd about the frame, its header, or the priors.
    pub notes: Vec<Note>,
    /// All sources, brightest first.
    pub sources: Vec<Source>,
    /// The sky background; a list of centroids has none.
    pub background: Option<Background>,
    /// The part of the frame that shows the sky; `None` where all does, or of a list of centroids.
    pub sky_area: Option<SkyArea>,
    /// Whether only attitude and optics were wanted, from the brightest stars.
    pub attitude_only: bool,
    /// Which directions the reported attitude refers to.
    pub attitude_frame: AttitudeFrame,
    /// The stars and the attitude, or why they were not found.
    pub outcome: Outcome,
    /// The Moon and the planets in an identified frame whose date is known.
    pub bodies: Vec<BodyInFrame>,
    /// Satellites, aeroplanes and meteors, the most significant first; `None` where they were not searched.
    pub trails: Option<Vec<Trail>>,
    /// Zero point and limiting magnitude of an identified frame; a list of centroids has none.
    pub photometry: Option<FramePhotometry>,
    /// The sky at each place of an identified frame, where it was wanted.
    pub sky: Option<SkyMap>,
    /// The stars that the frame's are, where it took a deep catalogue.
    pub(crate) deep: Option<SolvedSky>,
    /// Comparison with the stated camera, where there is one and the exposure is known.
    pub comparison: Option<Comparison>,
    /// Gain of the stated camera, in electrons per ADU.
    pub gain_e_per_adu: Option<f64>,
    /// The calibration applied to the frame, if any.
    pub calibration: Option<Applied>,
    /// Time that each stage took.
    pub timing: Timing,
}

/// The stars around a frame, of a deep catalogue.
#[derive(Clone)]
pub(crate) struct SolvedSky(pub Arc<IndexedCatalog<'static>>);

impl fmt::Debug for SolvedSky {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("SolvedSky")
            .field(&self.0.catalog().title())
            .finish()
    }
}

impl Solution {
    /// The catalogue that its stars are of: `usual`, which frames are solved with, unless it took a deep one.
    pub fn catalog<'a>(&'a self, usual: &'a Catalog) -> &'a Catalog {
        self.deep.as_ref().map_or(usual, |deep| deep.0.catalog())
    }

    /// The title of the deep catalogue, where it took one.
    pub(crate) fn deep_title(&self) -> Option<&str> {
        self.deep.as_ref().map(|deep| deep.0.catalog().title())
    }

    /// One source.
    ///
    /// # Panics
    /// If `index` is of another solution and there is no such source.
    pub fn source(&self, index: SourceIndex) -> &Source {
        &self.sources[index.get()]
    }

    /// The star that each source is, in the order of the sources; none of those that are not identified.
    pub(crate) fn matches_by_source(&self) -> Vec<Option<&StarMatch>> {
        let mut matches = vec![None; self.sources.len()];
        let identified = self.outcome.identification();
        for star_match in identified.iter().flat_map(|found| &found.matches) {
            if let Some(place) = matches.get_mut(star_match.source.get()) {
                *place = Some(star_match);
            }
        }
        matches
    }

    /// The positions of the identified stars, with the directions of their light.
    pub(crate) fn measured_stars<'a>(
        &'a self,
        found: &'a Identification,
    ) -> impl Iterator<Item = MeasuredStar> + 'a {
        self.named_stars(found).map(|(_, star)| star)
    }

    /// [`measured_stars`](Self::measured_stars), each with the catalogue star that it is.
    pub(crate) fn named_stars<'a>(
        &'a self,
        found: &'a Identification,
    ) -> impl Iterator<Item = (StarIndex, MeasuredStar)> + 'a {
        found.matches.iter().filter_map(|named| {
            let source = self.source(named.source);
            let [x, y] = source.measured?.sigma_px;
            let sigma_px = (0.5 * (x * x + y * y)).sqrt();
            let star = MeasuredStar {
                pixel: source.position,
                icrs: named.light,
                sigma_px: sigma_px.max(1e-3),
            };
            sigma_px.is_finite().then_some((named.star, star))
        })
    }

    /// The stars of the frame, which has this name, for [`calibrate`](crate::identify::lens::calibrate()).
    ///
    /// # Errors
    /// [`Unfit::NotIdentified`].
    pub fn lens_frame(&self, name: &str) -> Result<LensFrame, Unfit> {
        match &self.outcome {
            Outcome::Identified(found) => {
                let frame = LensFrame::new(name, found, self.named_stars(found));
                let date = self.date.map(|known| known.date);
                Ok(frame.taken(date, self.observation))
            }
            Outcome::NotIdentified(reason) => Err(Unfit::NotIdentified {
                code: Reason::code(reason),
            }),
        }
    }
}

/// The sky background, in the frame's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Background {
    /// Median level.
    pub level_adu: f64,
    /// Standard deviation of one pixel.
    pub noise_adu: f64,
    /// Share of the frame that shows the sky.
    pub sky_share: f64,
}
