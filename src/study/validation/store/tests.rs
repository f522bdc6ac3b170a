//! Rows for the tests of the tables.

use crate::study::robustness::Answer;
use crate::study::validation::record::{FrameRecord, RowKind, StarRecord};

/// A frame.
pub(super) fn frame_row(frame: u64) -> FrameRecord {
    FrameRecord {
        frame,
        seed: u64::MAX - frame,
        ra_deg: 12.5,
        dec_deg: -3.25,
        up_pa_deg: 170.0,
        status: Answer::Right,
        reason: None,
        stars_above_limit: 40,
        detected: 41,
        rejected: 0,
        named: 39,
        misnamed: 0,
        misnamed_companions: 0,
        false_detections: 1,
        blends: 0,
        star_rows: 1,
        error_x_arcsec: Some(0.5),
        error_y_arcsec: Some(-0.25),
        error_roll_arcsec: Some(3.0),
        sigma_x_arcsec: Some(0.4),
        sigma_y_arcsec: Some(0.4),
        sigma_roll_arcsec: Some(2.0),
        nees: Some(2.5),
        focal_error_px: Some(0.01),
        focal_sigma_px: Some(0.02),
        rms_px: Some(0.1),
        faintest_vmag: Some(8.0),
        expected_faintest_vmag: Some(7.9),
        expected_faintest_sigma_mag: Some(0.2),
        predicted_limit_vmag: 7.0,
        measured_limit_vmag: None,
        measured_limit_sigma_mag: None,
        background_adu: Some(100.5),
        true_background_adu: 100.0,
        noise_adu: Some(5.0),
        true_noise_adu: 5.0,
        split: 1,
        zero_point_error_mag: Some(0.01),
        zero_point_sigma_mag: Some(0.02),
        linearity: Some(1.01),
        linearity_sigma: Some(0.03),
        notes: Some("not_linear large_residuals".to_owned()),
    }
}

/// A false detection.
pub(super) fn star_row(frame: u64) -> StarRecord {
    StarRecord {
        x: Some(1.5),
        y: Some(2.5),
        sigma_x: Some(0.1),
        sigma_y: Some(0.1),
        flux_e: Some(100.0),
        sigma_flux_e: Some(20.0),
        ..StarRecord::empty(frame, RowKind::False)
    }
}
