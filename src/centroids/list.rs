//! Lists of centroids.

use super::left_out::{LeftOut, RowProblem};
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::detect::DetectionFlags;
use crate::ephemeris::places::StarPlaces;
use crate::identify::{ObservedStar, Photometry, SourceIndex, StarField};
use std::collections::HashMap;

/// Standard error assumed on each axis of a centroid that is listed without one, in pixels.
pub const LISTED_SIGMA_PX: f64 = 0.5;

/// Centroids closer than this are one star that is listed twice, in pixels: the error assumed.
const COINCIDENT_PX: f64 = LISTED_SIGMA_PX;

/// A list of centroids.
#[derive(Debug, Clone, PartialEq)]
pub struct CentroidList {
    /// Columns of the frame that they come from, where they are stated. Else they are the camera's, and
    /// without a camera as many as the centroids reach.
    pub width: Option<usize>,
    /// Rows, likewise.
    pub height: Option<usize>,
    /// What the magnitudes are.
    pub photometry: Photometry,
    /// Whether the brightnesses are known. If not, the magnitudes give their order alone.
    pub has_brightness: bool,
    /// The centroids, in any order.
    pub centroids: Vec<ListedCentroid>,
}

/// One line of a list of centroids.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ListedCentroid {
    /// The position.
    pub position: PixelPoint,
    /// Brightness in magnitudes, see [`CentroidList::photometry`].
    pub mag: f64,
    /// Flux, if the list gives it.
    pub flux: Option<f64>,
    /// Standard error on one axis in pixels, if the list gives it.
    pub sigma_px: Option<f64>,
    /// Flags, if the list gives them. Sources that are not stars are not used for identification.
    pub flags: DetectionFlags,
    /// Where it stands in its list, from 1: the line of a file, the place in an array; 0 if unknown.
    pub row: u64,
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
            row: 0,
        }
    }

    /// Standard error on one axis, stated or assumed, in pixels.
    pub(crate) fn error_px(&self) -> f64 {
        self.sigma_px.unwrap_or(LISTED_SIGMA_PX)
    }

    /// A magnitude for the star of this rank, from 0, in a list that is in order of brightness.
    ///
    /// Stars brighter than m are as many as 10^(m/2) on the sky. The magnitudes span half of that, so
    /// that a list in another order is not far from the truth either.
    pub fn mag_of_rank(rank: usize) -> f64 {
        libm::log10(rank as f64 + 1.0)
    }

    /// Why it cannot be used, if it cannot.
    pub fn problem(&self) -> Option<RowProblem> {
        let has_place = self.position.x.is_finite() && self.position.y.is_finite();
        if has_place && self.flux.is_some_and(|flux| flux <= 0.0) {
            return Some(RowProblem::NoFlux);
        }
        if !has_place || !self.mag.is_finite() {
            return Some(RowProblem::NoNumber);
        }
        let is_error = |sigma_px: f64| sigma_px > 0.0 && sigma_px.is_finite();
        let has_error = self.sigma_px.is_none_or(is_error);
        (!has_error).then_some(RowProblem::NoError)
    }
}

impl CentroidList {
    /// The centroids that can be used, brightest first, and what is left out: rows without a number,
    /// with a flux or an error of 0 or below, and those that coincide with a brighter one.
    pub fn usable(&self) -> (Self, Vec<LeftOut>) {
        let mut problems = Vec::new();
        let mut usable = Vec::new();
        for centroid in &self.centroids {
            match centroid.problem() {
                Some(problem) => problems.push((problem, centroid.row)),
                None => usable.push(*centroid),
            }
        }
        usable.sort_by(|a, b| a.mag.total_cmp(&b.mag));
        let is_kept = without_coincident(&usable);
        let centroids = usable.into_iter().zip(is_kept);
        let (kept, coincident): (Vec<_>, Vec<_>) = centroids.partition(|(_, is_kept)| *is_kept);
        let rows = coincident.iter().map(|(centroid, _)| centroid.row);
        problems.extend(rows.map(|row| (RowProblem::Coincident, row)));
        let list = Self {
            centroids: kept.into_iter().map(|(centroid, _)| centroid).collect(),
            ..self.clone()
        };
        (list, LeftOut::summarize(&problems))
    }

    /// The star field of a list that is sorted by brightness; `places` is where the catalogue's stars
    /// appear. A side of the frame that is not stated is as long as the centroids reach.
    pub fn star_field(&self, places: StarPlaces) -> StarField {
        self.star_field_in(self.reached_size([self.width, self.height]), places)
    }

    /// The size of a frame with these sides, or as far as its centroids reach.
    pub(crate) fn reached_size(&self, stated: [Option<usize>; 2]) -> Size {
        let [width, height] = [0, 1].map(|axis| {
            let reach = || (self.reach_px(axis)[1].round() as usize).saturating_add(1);
            stated[axis].unwrap_or_else(reach)
        });
        Size::new(width, height)
    }

    /// The smallest and the largest coordinate of the centroids, from 0 on.
    pub(crate) fn reach_px(&self, axis: usize) -> [f64; 2] {
        let places = self.centroids.iter().map(|centroid| {
            let place = centroid.position;
            [place.x, place.y][axis]
        });
        places.fold([f64::INFINITY, 0.0], |[low, high], place| {
            [place.min(low), place.max(high)]
        })
    }

    /// The same in a frame of this size.
    pub(crate) fn star_field_in(&self, size: Size, places: StarPlaces) -> StarField {
        let observed = |(line, centroid): (usize, &ListedCentroid)| ObservedStar {
            source: SourceIndex::new(line),
            position: centroid.position,
            sigma_px: centroid.error_px(),
            mag: centroid.mag,
            is_saturated: centroid.flags.saturated,
        };
        let lines = self.centroids.iter().enumerate();
        let stars = lines.filter(|(_, centroid)| centroid.flags.is_star_like());
        StarField {
            width_px: size.width as f64,
            height_px: size.height as f64,
            photometry: self.photometry,
            places,
            spot_sigma_px: None,
            sky_area: None,
            stars: stars.map(observed).collect(),
        }
    }
}

/// For each of these centroids, brightest first, whether no brighter one coincides with it.
fn without_coincident(centroids: &[ListedCentroid]) -> Vec<bool> {
    // Cells of the size of the distance: what coincides is in the same or a neighboring cell.
    let cell = |at: f64| (at / COINCIDENT_PX).floor() as i64;
    let mut kept: HashMap<[i64; 2], Vec<PixelPoint>> = HashMap::new();
    let is_kept = |centroid: &ListedCentroid| {
        let place = centroid.position;
        let [x, y] = [cell(place.x), cell(place.y)];
        let near = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
        let mut brighter = near.filter_map(|cell| kept.get(&cell)).flatten();
        let is_alone = !brighter
            .any(|other| libm::hypot(other.x - place.x, other.y - place.y) < COINCIDENT_PX);
        if is_alone {
            kept.entry([x, y]).or_default().push(place);
        }
        is_alone
    };
    centroids.iter().map(is_kept).collect()
}
