//! Lists of centroids, and their identification.

use super::bodies::find_bodies;
use super::context::{Context, Workspace};
use super::identification::{attempt, identified, observation};
use super::note::Note;
use super::solution::{Solution, Source};
use super::stopwatch::{Stage, Stopwatch};
use crate::base::coords::PixelPoint;
use crate::detect::DetectionFlags;
use crate::identify::{ObservedStar, Photometry, SourceIndex, StarField};

/// Standard error assumed on each axis of a centroid that is listed without one, in pixels.
pub const LISTED_SIGMA_PX: f64 = 0.5;

/// A list of centroids.
#[derive(Debug, Clone, PartialEq)]
pub struct CentroidList {
    /// Columns of the frame that they come from.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What the magnitudes are.
    pub photometry: Photometry,
    /// The centroids, in any order.
    pub centroids: Vec<ListedCentroid>,
}

/// One line of a list of centroids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedCentroid {
    /// The position.
    pub position: PixelPoint,
    /// Brightness in magnitudes, see [`CentroidList::photometry`].
    pub mag: f64,
    /// Flux, if the list gives it.
    pub flux: Option<f64>,
    /// Standard error on one axis in pixels, if the list gives it.
    pub sigma_px: Option<f64>,
    /// Flags, if the list gives them. What is no star takes no part in the identification.
    pub flags: DetectionFlags,
}

impl ListedCentroid {
    /// A centroid of which only position and magnitude are known.
    pub fn new(position: PixelPoint, mag: f64) -> Self {
        Self {
            position,
            mag,
            flux: None,
            sigma_px: None,
            flags: DetectionFlags::default(),
        }
    }
}

impl CentroidList {
    /// The star field of a list that is sorted by brightness, observed this many Julian years after
    /// J2000.0.
    pub fn star_field(&self, years_since_j2000: f64) -> StarField {
        let observed = |(line, centroid): (usize, &ListedCentroid)| ObservedStar {
            source: SourceIndex::new(line),
            position: centroid.position,
            sigma_px: centroid.sigma_px.unwrap_or(LISTED_SIGMA_PX),
            mag: centroid.mag,
            is_saturated: centroid.flags.saturated,
        };
        let lines = self.centroids.iter().enumerate();
        let stars = lines.filter(|(_, centroid)| centroid.flags.is_star_like());
        StarField {
            width_px: self.width as f64,
            height_px: self.height as f64,
            photometry: self.photometry,
            years_since_j2000,
            spot_sigma_px: None,
            stars: stars.map(observed).collect(),
        }
    }
}

/// Identifies the stars of a list of centroids. Every prior is a hard constraint.
pub fn solve_centroids(
    list: &CentroidList,
    context: &Context,
    workspace: &mut Workspace,
) -> Solution {
    let mut clock = Stopwatch::start();
    workspace.set_deadline(clock.deadline(context.time_limit));
    let priors = &context.priors;
    let mut list = list.clone();
    list.centroids.sort_by(|a, b| a.mag.total_cmp(&b.mag));
    let field = list.star_field(priors.years_since_j2000());
    let buffers = (&mut workspace.identify, &mut clock);
    let found = attempt(&field, priors, context, buffers);
    let mut outcome = identified(found, None, &field, priors, context.indexed);
    let observation = observation(&outcome, priors);
    let source = |centroid: &ListedCentroid| Source {
        position: centroid.position,
        measured: None,
        flux: centroid.flux,
    };
    let sources: Vec<Source> = list.centroids.iter().map(source).collect();
    let catalog = context.indexed.catalog();
    let bodies = find_bodies(&mut outcome, &sources, priors, catalog);
    clock.lap(Stage::Identify);
    let note = Note::of_observation(observation.as_ref(), priors, &outcome);
    let notes = note.into_iter();
    let notes = notes.chain(Note::of_bodies(&bodies, &outcome, catalog));
    let notes = notes.chain(Note::of_pointing(context.attitude_only, &outcome));
    Solution {
        width: list.width,
        height: list.height,
        row_order: None,
        date: priors.date,
        notes: notes.collect(),
        observation,
        site: priors.site,
        exposure_s: priors.exposure_s,
        sources,
        background: None,
        attitude_only: context.attitude_only,
        outcome,
        bodies,
        photometry: None,
        comparison: None,
        gain_e_per_adu: None,
        calibration: None,
        timing: clock.timing(),
    }
}
