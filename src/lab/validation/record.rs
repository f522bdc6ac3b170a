//! Rows of the tables: results of each simulated frame and of each star on it.
//!
//! Lengths are in pixels, light in electrons, angles in the unit in their name. Missing values are
//! empty.

use crate::base::table::{field, table_row};
use crate::lab::robustness::Answer;
use serde::{Deserialize, Serialize};

/// Magnitudes beyond the predicted limit down to which the table of stars goes.
pub const BEYOND_LIMIT_MAG: f64 = 1.5;

table_row! {
    /// A simulated frame, and the result of the pipeline. Errors of the attitude, of the focal length and of the
    /// zero point are of right answers only.
    #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
    FrameRecord in "frames" {
        frame: u64, "", "meta.id;meta.main", "number of the frame, from 0";
        seed: u64, "", "", "seed of the random numbers in its pixels";
        ra_deg: f64, "deg", "pos.eq.ra;meta.main", "true right ascension of the center (ICRS)";
        dec_deg: f64, "deg", "pos.eq.dec;meta.main", "true declination of the center (ICRS)";
        up_pa_deg: f64, "deg", "pos.posAng", "true position angle of the picture's up direction";
        status: Answer, "", "meta.code.status", "right, wrong or none";
        reason: Option<String>, "", "meta.code", "code of the reason why the frame is not identified";
        stars_above_limit: u64, "", "meta.number", "true stars brighter than the predicted limiting magnitude";
        detected: u64, "", "meta.number", "detections that look like stars";
        rejected: u64, "", "meta.number", "detections rejected as hot pixels, trails or extended light";
        named: u64, "", "meta.number", "detections with the name of a star";
        misnamed: u64, "", "meta.number", "named detections that are a different star, or no star";
        misnamed_companions: u64, "", "meta.number", "misnamed detections with the name of another star at the same position";
        false_detections: u64, "", "meta.number", "false detections: without light of any star";
        blends: u64, "", "meta.number", "blends: detections with light of several stars, none of which contributes more than half";
        star_rows: u64, "", "meta.number", "rows of the frame in the table of stars";
        error_x_arcsec: Option<f64>, "arcsec", "stat.error", "rotation about the x axis from the true to the measured attitude";
        error_y_arcsec: Option<f64>, "arcsec", "stat.error", "rotation about the y axis from the true to the measured attitude";
        error_roll_arcsec: Option<f64>, "arcsec", "stat.error", "rotation about the boresight from the true to the measured attitude";
        sigma_x_arcsec: Option<f64>, "arcsec", "stat.stdev", "standard error of the rotation about the x axis";
        sigma_y_arcsec: Option<f64>, "arcsec", "stat.stdev", "standard error of the rotation about the y axis";
        sigma_roll_arcsec: Option<f64>, "arcsec", "stat.stdev", "standard error of the rotation about the boresight";
        nees: Option<f64>, "", "stat.fit.chi2", "normalized estimation error squared (NEES) of the attitude; 3 on average if the covariance is right";
        focal_error_px: Option<f64>, "pix", "stat.error", "measured minus true focal length";
        focal_sigma_px: Option<f64>, "pix", "stat.stdev", "standard error of the focal length";
        rms_px: Option<f64>, "pix", "stat.fit.residual", "RMS residual of the named stars";
        faintest_vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "V magnitude of the faintest named star";
        expected_faintest_vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "expected V magnitude of the faintest detected star";
        expected_faintest_sigma_mag: Option<f64>, "mag", "stat.stdev", "expected scatter of the magnitude of the faintest detected star";
        predicted_limit_vmag: f64, "mag", "phot.mag;em.opt.V", "predicted V magnitude at which half of the stars are detected";
        measured_limit_vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "measured V magnitude at which half of the stars are detected";
        measured_limit_sigma_mag: Option<f64>, "mag", "stat.stdev", "standard error of the measured limit";
        background_adu: Option<f64>, "adu", "instr.background", "measured median background";
        true_background_adu: f64, "adu", "instr.background", "true background";
        noise_adu: Option<f64>, "adu", "instr.det.noise", "measured noise of a pixel";
        true_noise_adu: f64, "adu", "instr.det.noise", "true noise of a pixel";
        split: u64, "", "meta.number", "true stars that were split into several detections";
        zero_point_error_mag: Option<f64>, "mag", "stat.error", "measured minus true photometric zero point";
        zero_point_sigma_mag: Option<f64>, "mag", "stat.stdev", "standard error of the zero point";
        linearity: Option<f64>, "", "stat.fit.param", "instrumental magnitudes per V magnitude; 1 for a linear detector";
        linearity_sigma: Option<f64>, "", "stat.stdev", "standard error of the linearity";
        notes: Option<String>, "", "meta.note", "codes of the notes on the frame";
    }
}

table_row! {
    /// A true star, down to [`BEYOND_LIMIT_MAG`] below the predicted limit; or a detection that is no
    /// such star.
    #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
    StarRecord in "stars" {
        frame: u64, "", "meta.id", "number of the frame";
        kind: RowKind, "", "meta.code.class", "star, blend or false";
        id: Option<String>, "", "meta.id;meta.main", "identifier in the catalog";
        vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "true Johnson V";
        bv_mag: Option<f64>, "mag", "phot.color;em.opt.B;em.opt.V", "true B-V";
        true_x_px: Option<f64>, "pix", "pos.cartesian.x;instr.det", "true x position, from 0";
        true_y_px: Option<f64>, "pix", "pos.cartesian.y;instr.det", "true y position, from 0";
        true_flux_e: Option<f64>, "electron", "phot.count", "expected flux, in electrons";
        isolated: Option<bool>, "", "meta.code", "isolated: entirely on the frame, and away from the light of other stars";
        saturated: Option<bool>, "", "meta.code.qual", "the brightest pixel may be saturated";
        probability: Option<f64>, "", "stat.probability", "predicted probability of detection";
        predicted_snr: Option<f64>, "", "stat.snr", "predicted signal-to-noise ratio of the matched filter, without the star's own shot noise";
        bound_x_px: Option<f64>, "pix", "stat.error;pos.cartesian.x", "Cramer-Rao lower bound of sigma_x";
        bound_y_px: Option<f64>, "pix", "stat.error;pos.cartesian.y", "Cramer-Rao lower bound of sigma_y";
        bound_flux_e: Option<f64>, "electron", "stat.error;phot.count", "Cramer-Rao lower bound of sigma_flux_e";
        detected: bool, "", "meta.code", "detected: a detection has more than half of its light from this star";
        x: Option<f64>, "pix", "pos.cartesian.x;instr.det", "x of the centroid, from 0";
        y: Option<f64>, "pix", "pos.cartesian.y;instr.det", "y of the centroid, from 0";
        sigma_x: Option<f64>, "pix", "stat.error;pos.cartesian.x", "standard error of x";
        sigma_y: Option<f64>, "pix", "stat.error;pos.cartesian.y", "standard error of y";
        flux_e: Option<f64>, "electron", "phot.count", "measured flux";
        sigma_flux_e: Option<f64>, "electron", "stat.error;phot.count", "standard error of flux_e";
        named: NameResult, "", "meta.code", "right, wrong or no";
    }
}

/// Type of a row in the table of stars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// A true star, detected or not.
    #[default]
    Star,
    /// A detection with the light of several stars, none of which contributes more than half.
    Blend,
    /// A detection without the light of any star.
    False,
}

/// Whether a detection was named correctly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NameResult {
    /// Named as the true star.
    Right,
    /// Named as another star.
    Wrong,
    /// Not named.
    #[default]
    No,
}

field! {
    Answer => Text, |value| match value {
        Answer::Right => "right",
        Answer::Wrong => "wrong",
        Answer::None => "none",
    }.to_owned();
    RowKind => Text, |value| match value {
        RowKind::Star => "star",
        RowKind::Blend => "blend",
        RowKind::False => "false",
    }.to_owned();
    NameResult => Text, |value| match value {
        NameResult::Right => "right",
        NameResult::Wrong => "wrong",
        NameResult::No => "no",
    }.to_owned();
}

impl StarRecord {
    /// A row of this frame without any measurement.
    pub fn empty(frame: u64, kind: RowKind) -> Self {
        Self {
            frame,
            kind,
            ..Self::default()
        }
    }
}
