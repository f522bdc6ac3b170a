//! Reports the Moon and the planets in a frame.

use super::digits::{DIRECTION_DECIMALS, PIXEL_DECIMALS, SIGMA_DIGITS};
use super::frame_report::{BodyReport, FrameReport};
use crate::base::format::{to_decimals, to_significant, turn_deg};
use crate::base::units::DEG_PER_RAD;
use crate::identify::{Identification, SourceIndex};
use crate::solve::BodyInFrame;

/// Adds `bodies` to `report`, and their names to their detections.
pub(super) fn add_to(
    report: &mut FrameReport,
    bodies: &[BodyInFrame],
    identification: &Identification,
) {
    let focal_px = identification.camera.focal_length_px();
    report.bodies = bodies.iter().map(|seen| body(seen, focal_px)).collect();
    for body in &report.bodies {
        if let Some(star) = body.detection.and_then(|index| report.stars.get_mut(index)) {
            star.name = Some(body.name.to_owned());
            star.vmag = Some(body.vmag);
        }
    }
}

fn body(seen: &BodyInFrame, focal_length_px: f64) -> BodyReport {
    let (ra_rad, dec_rad) = seen.body.direction.to_ra_dec();
    BodyReport {
        name: seen.body.kind.name(),
        x: to_decimals(seen.position.x, PIXEL_DECIMALS),
        y: to_decimals(seen.position.y, PIXEL_DECIMALS),
        uncertainty_px: to_significant(seen.uncertainty_px, SIGMA_DIGITS),
        ra_deg: turn_deg(ra_rad * DEG_PER_RAD, DIRECTION_DECIMALS),
        dec_deg: to_decimals(dec_rad * DEG_PER_RAD, DIRECTION_DECIMALS),
        vmag: to_decimals(seen.body.v_mag, 2),
        radius_px: to_significant(seen.body.radius_rad * focal_length_px, SIGMA_DIGITS),
        detection: seen.source.map(SourceIndex::get),
    }
}
