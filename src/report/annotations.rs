//! Reports what has a name in a frame.

use super::digits::{FRACTION_DECIMALS, PIXEL_DECIMALS, SIGMA_DIGITS};
use super::frame_report::{AnnotationReport, ConstellationReport, FrameReport};
use crate::annotate::{Annotation, AnnotationKind, Scene, VisibleConstellation};
use crate::base::format::{finite, significant, to_decimals};
use crate::catalog::Catalog;
use crate::identify::SourceIndex;

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
