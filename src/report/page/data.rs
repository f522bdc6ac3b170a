//! What the scripts of a page draw.

use super::FrameReport;
use crate::base::format::to_decimals;
use crate::pipeline::Solution;
use crate::report::frame_report::{CompletenessReport, StarReport};
use serde::Serialize;

/// The numbers of a page.
#[derive(Debug, Serialize)]
pub(super) struct PageData<'a> {
    width: usize,
    height: usize,
    /// Detections, brightest first.
    stars: Vec<PageStar<'a>>,
    completeness: &'a [CompletenessReport],
    zero_point_vmag: Option<f64>,
    /// Seconds by which fluxes are divided before the zero point applies.
    zero_point_exposure_s: f64,
    limit50_vmag: Option<f64>,
    predicted_vmag: Option<f64>,
}

/// A detection.
#[derive(Debug, Serialize)]
struct PageStar<'a> {
    x: f64,
    y: f64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    offset: Option<Offset>,
    #[serde(skip_serializing_if = "Option::is_none")]
    snr: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    flux: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    v: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ra: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dec: Option<f64>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    flags: &'a [&'static str],
}

/// Observed minus predicted position, in pixels.
#[derive(Debug, Clone, Copy, Serialize)]
struct Offset {
    dx: f64,
    dy: f64,
}

impl<'a> PageData<'a> {
    /// The numbers of a frame.
    pub(super) fn of(report: &'a FrameReport, solution: &Solution) -> Self {
        let offsets = offsets(solution);
        let photometry = report.photometry.as_ref();
        let is_rate = photometry.is_some_and(|photometry| photometry.flux_unit.ends_with("/s"));
        let star = |(star, offset): (&'a StarReport, Option<Offset>)| PageStar {
            x: to_decimals(star.x, 2),
            y: to_decimals(star.y, 2),
            offset,
            snr: star.snr,
            flux: star.flux,
            id: star.id.as_deref(),
            name: star.name.as_deref(),
            v: star.vmag,
            ra: star.ra_deg.map(|ra| to_decimals(ra, 5)),
            dec: star.dec_deg.map(|dec| to_decimals(dec, 5)),
            flags: &star.flags,
        };
        Self {
            width: report.width,
            height: report.height,
            stars: report.stars.iter().zip(offsets).map(star).collect(),
            completeness: photometry.map_or(&[], |photometry| &photometry.completeness),
            zero_point_vmag: photometry.and_then(|photometry| photometry.zero_point_vmag),
            zero_point_exposure_s: report.exposure_s.filter(|_| is_rate).unwrap_or(1.0),
            limit50_vmag: photometry.and_then(|photometry| photometry.limit50_vmag),
            predicted_vmag: report.prediction.as_ref().and_then(|p| p.limit50_vmag),
        }
    }
}

/// Observed minus predicted positions of the identified stars, in the order of the detections.
fn offsets(solution: &Solution) -> Vec<Option<Offset>> {
    let mut offsets = vec![None; solution.sources.len()];
    let Some(found) = solution.outcome.identification() else {
        return offsets;
    };
    for star_match in &found.matches {
        let source = star_match.source.get();
        let predicted = found
            .camera
            .pixel_of(&found.icrs_to_camera.apply(&star_match.light));
        if let (Some(offset), Some(predicted)) = (offsets.get_mut(source), predicted) {
            let observed = solution.sources[source].position;
            *offset = Some(Offset {
                dx: to_decimals(observed.x - predicted.x, 3),
                dy: to_decimals(observed.y - predicted.y, 3),
            });
        }
    }
    offsets
}
