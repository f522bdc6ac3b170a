//! The stars of the paper's table, identified from its centroids.

use super::published::{Published, PublishedStar};
use crate::base::coords::PixelPoint;
use crate::base::format::to_decimals;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::catalog::{Catalog, StarId, StarIndex};
use crate::centroids::{CentroidList, ListedCentroid};
use crate::ephemeris::places::AttitudeFrame;
use crate::identify::{Identification, Photometry, SourceIndex};
use crate::predict::{Budget, Scenario};
use crate::solve::Solution;
use serde::Serialize;

/// The result of the paper's table.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct TableReport {
    pub right: usize,
    pub stars: Vec<TableStar>,
    pub field: Option<FieldReport>,
    pub stated_zenith_distance_deg: f64,
    pub zenith_distance_deg: Option<f64>,
    pub limit_there_vmag: Option<f64>,
}

/// A star of the paper's table.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct TableStar {
    pub paper_id: String,
    pub found_id: Option<String>,
    pub vmag: f64,
    pub x_px: f64,
    pub y_px: f64,
    pub residual_px: Option<f64>,
}

/// The field of the paper's camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct FieldReport {
    pub ra_deg: f64,
    pub dec_deg: f64,
    pub up_pa_deg: f64,
    pub pixel_scale_arcsec: f64,
    pub mirrored: bool,
    pub rms_px: f64,
    pub log10_false_alarm: f64,
    pub stars_as_bright: usize,
    pub brightest_unlisted_vmag: Option<f64>,
}

/// The list of centroids in the paper's table.
pub(super) fn centroids(published: &Published, scenario: &Scenario) -> CentroidList {
    let stars = published.stars.iter();
    let listed = stars.map(|star| ListedCentroid::new(star.position(), star.vmag));
    CentroidList {
        width: Some(scenario.camera.width_px),
        height: Some(scenario.camera.height_px),
        photometry: Photometry::JohnsonV,
        has_brightness: true,
        centroids: listed.collect(),
    }
}

impl TableReport {
    pub(super) fn new(
        published: &Published,
        scenario: &Scenario,
        solution: &Solution,
        catalog: &Catalog,
    ) -> Self {
        let found = solution.outcome.identification();
        let named = |position| {
            let is_it = |source: SourceIndex| solution.source(source).position == position;
            found.and_then(|found| found.matches.iter().find(|m| is_it(m.source)))
        };
        let mut right = 0;
        let stars = published.stars.iter().map(|star| {
            let named = named(star.position());
            let found_id = named.map(|m| catalog.star(m.star).id);
            right += usize::from(found_id == Some(StarId::Skymap(star.skymap_number)));
            TableStar {
                paper_id: StarId::Skymap(star.skymap_number).to_string(),
                found_id: named.map(|m| catalog.designation(m.star)),
                vmag: star.vmag,
                x_px: star.x_px,
                y_px: star.y_px,
                residual_px: named.map(|m| to_decimals(m.residual_px, 3)),
            }
        });
        let stars = stars.collect();
        let zenith_distance_deg = solution
            .observation
            .map(|seen| seen.zenith_distance_rad * DEG_PER_RAD);
        Self {
            right,
            stars,
            field: found.map(|found| FieldReport::new(published, found, catalog)),
            stated_zenith_distance_deg: scenario.conditions.zenith_distance_deg,
            zenith_distance_deg: zenith_distance_deg.map(|deg| to_decimals(deg, 3)),
            limit_there_vmag: zenith_distance_deg.and_then(|deg| limit_at(scenario, deg)),
        }
    }
}

impl FieldReport {
    fn new(published: &Published, found: &Identification, catalog: &Catalog) -> Self {
        let among = stars_among(published, found, catalog);
        let is_listed = |star: &&StarIndex| found.matches.iter().any(|m| m.star == **star);
        let unlisted = among.iter().find(|star| !is_listed(star));
        let (boresight, up_pa_rad) = found.attitude(AttitudeFrame::Icrs).boresight_and_up();
        let (ra_rad, dec_rad) = boresight.to_ra_dec();
        let degrees = |rad: f64| to_decimals(rad * DEG_PER_RAD, 5);
        Self {
            ra_deg: degrees(ra_rad),
            dec_deg: degrees(dec_rad),
            up_pa_deg: degrees(up_pa_rad),
            pixel_scale_arcsec: to_decimals(ARCSEC_PER_RAD / found.camera.focal_length_px(), 4),
            mirrored: found.camera.mirrored,
            rms_px: to_decimals(found.rms_px, 3),
            log10_false_alarm: to_decimals(found.log10_false_alarm, 1),
            stars_as_bright: among.len(),
            brightest_unlisted_vmag: unlisted.map(|star| v_mag(catalog, *star)),
        }
    }
}

/// The limit of `scenario` at another zenith distance; `None` below the horizon.
fn limit_at(scenario: &Scenario, zenith_distance_deg: f64) -> Option<f64> {
    let mut there = scenario.clone();
    there.conditions.zenith_distance_deg = zenith_distance_deg;
    there.check().ok()?;
    Some(to_decimals(Budget::new(&there).limit_vmag, 3))
}

fn v_mag(catalog: &Catalog, star: StarIndex) -> f64 {
    to_decimals(f64::from(catalog.star(star).v_mag), 3)
}

/// The catalogue stars in the rectangle of the paper's centroids that are not fainter than its
/// faintest star, brightest first.
///
/// The frame's size beyond the centroids is not known.
fn stars_among(published: &Published, found: &Identification, catalog: &Catalog) -> Vec<StarIndex> {
    /// Border of the rectangle, so that the paper's own stars at its edge lie within it.
    const BORDER_PX: f64 = 2.0;
    /// Rounding error of the paper's magnitudes, which have two decimals.
    const ROUNDING_MAG: f64 = 0.005;
    let positions = || published.stars.iter().map(PublishedStar::position);
    let bounds = |axis: fn(PixelPoint) -> f64| {
        let values = || positions().map(axis);
        let least = values().fold(f64::INFINITY, f64::min);
        least - BORDER_PX..=values().fold(f64::NEG_INFINITY, f64::max) + BORDER_PX
    };
    let (columns, rows) = (bounds(|p| p.x), bounds(|p| p.y));
    let is_among = |star: &StarIndex| {
        let apparent = found.places.of(catalog.star(*star));
        let pixel = found.pixel_of(&apparent);
        pixel.is_some_and(|p| columns.contains(&p.x) && rows.contains(&p.y))
    };
    let as_bright = catalog.brighter_than(published.faintest_vmag + ROUNDING_MAG);
    (0..as_bright)
        .map(StarIndex::new)
        .filter(is_among)
        .collect()
}
