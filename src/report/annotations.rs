//! Reports what has a name in a frame.

use super::digits::{FRACTION_DECIMALS, PIXEL_DECIMALS, SIGMA_DIGITS};
use super::frame_report::FrameReport;
use crate::annotate::{Annotation, AnnotationKind, Scene, VisibleConstellation};
use crate::base::format::{finite, significant, to_decimals};
use crate::catalog::Catalog;
use crate::identify::SourceIndex;
use serde::Serialize;

/// A constellation in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstellationReport {
    /// Its Latin name.
    pub name: &'static str,
    /// The abbreviation of the International Astronomical Union.
    pub abbreviation: &'static str,
    /// The share of the frame's sky that lies within its boundary.
    pub share: f64,
    /// The share of the lines of its figure that is in the frame.
    pub figure_share: f64,
}

/// Something in a frame that has a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AnnotationReport {
    /// `star`, `constellation`, `deep_sky`, `body` (the Moon or a planet) or `radiant` (of a meteor shower).
    pub kind: &'static str,
    /// Its name, in full.
    pub name: String,
    /// Its name beside it in a picture.
    pub label: String,
    /// Column of its place: of its measurement where there is one, else where the pose has it.
    pub x: f64,
    /// Row of its place.
    pub y: f64,
    /// Its light is within so many pixels of that place; `None` for constellations.
    pub uncertainty_px: Option<f64>,
    /// Half of its longer side, in pixels, where it has a size.
    pub radius_px: Option<f64>,
    /// V magnitude, where it has one.
    pub vmag: Option<f64>,
    /// Catalogue number of a star, designation of a deep-sky object.
    pub id: Option<String>,
    /// Number of the detection in [`stars`](FrameReport::stars) that has its light.
    pub detection: Option<usize>,
    /// Why that detection is not its measurement: `saturated`, `blended`, `extended`, `border` or `uncertain`;
    /// `None` where it is.
    pub why: Option<&'static str>,
}

/// Adds what has a name to `report`.
pub(super) fn add_to(report: &mut FrameReport, scene: Scene, catalog: &Catalog) {
    report.constellations = scene
        .constellations
        .iter()
        .filter_map(constellation)
        .collect();
    report.annotations = scene
        .annotations
        .iter()
        .map(|shown| annotation(shown, catalog))
        .collect();
    report.sentence = Some(scene.sentence);
}

fn constellation(seen: &VisibleConstellation) -> Option<ConstellationReport> {
    (seen.share > 0.0).then(|| ConstellationReport {
        name: seen.name,
        abbreviation: seen.abbreviation,
        share: to_decimals(seen.share, FRACTION_DECIMALS),
        figure_share: to_decimals(seen.figure_share, FRACTION_DECIMALS),
    })
}

fn annotation(shown: &Annotation, catalog: &Catalog) -> AnnotationReport {
    let mut report = AnnotationReport {
        kind: shown.kind.code(),
        name: shown.name.clone(),
        label: shown.label.clone(),
        x: to_decimals(shown.position.x, PIXEL_DECIMALS),
        y: to_decimals(shown.position.y, PIXEL_DECIMALS),
        uncertainty_px: significant(shown.uncertainty_px, SIGMA_DIGITS).filter(|px| *px > 0.0),
        radius_px: significant(shown.radius_px, SIGMA_DIGITS).filter(|px| *px > 0.0),
        vmag: shown.v_mag.and_then(|v_mag| finite(v_mag, 3)),
        id: None,
        detection: None,
        why: None,
    };
    match shown.kind {
        AnnotationKind::Star {
            star,
            source,
            unmeasured,
        } => {
            report.id = Some(catalog.designation(star));
            report.detection = source.map(SourceIndex::get);
            report.why = unmeasured.map(|why| why.code());
        }
        AnnotationKind::DeepSky { designation } => report.id = Some(designation.to_owned()),
        AnnotationKind::Body { source } => report.detection = source.map(SourceIndex::get),
        AnnotationKind::Constellation | AnnotationKind::Radiant => {}
    }
    report
}
