//! The numbers of a data sheet by name: one table for the file, the options and the sweeps.

use super::key::{Key, NumberRange, key};
use super::sheet::DataSheet;

/// Whether the number called `name` may be a curve over wavelength. Its value is then the peak.
pub fn is_curve(name: &str) -> bool {
    ["lens_transmission", "quantum_efficiency"].contains(&name)
}

/// Width and height of a detector, in pixels.
const SIDES_PX: NumberRange = NumberRange::Whole(3.0, 100_000.0);
/// Standard deviation of a star's spot, in pixels.
const SPOTS_PX: NumberRange = NumberRange::FromToBelow(0.05, 20.0);
/// Wavelengths that a detector may be sensitive to, in nm.
const WAVELENGTHS_NM: NumberRange = NumberRange::FromToBelow(100.0, 10_000.0);

/// The numbers of a camera.
///
/// For a curve ([`DataSheet::lens_transmission`], [`DataSheet::quantum_efficiency`]) the value is
/// the peak, and setting it scales the curve. `spot_sigma_px` and `peak_share` exclude each other:
/// the last one set applies.
pub const KEYS: &[Key<DataSheet>] = &[
    key!(width_px, SIDES_PX, "columns of the detector"),
    key!(height_px, SIDES_PX, "rows of the detector"),
    key!(
        pitch_x_um,
        NumberRange::Positive,
        "pixel pitch along a row, in µm"
    ),
    key!(
        pitch_y_um,
        NumberRange::Positive,
        "pixel pitch along a column, in µm"
    ),
    key!(
        focal_length_mm,
        NumberRange::Positive,
        "focal length of the lens, in mm"
    ),
    key!(
        aperture_mm,
        NumberRange::Positive,
        "diameter of the entrance pupil, in mm"
    ),
    Key {
        name: "lens_transmission",
        about: "transmission of the lens (peak, if it is a curve)",
        limits: NumberRange::Share,
        get: |sheet| Some(sheet.lens_transmission.peak()),
        set: |sheet, peak| sheet.lens_transmission = sheet.lens_transmission.with_peak(peak),
    },
    Key {
        name: "quantum_efficiency",
        about: "quantum efficiency: electrons per photon (peak, if it is a curve)",
        limits: NumberRange::Share,
        get: |sheet| Some(sheet.quantum_efficiency.peak()),
        set: |sheet, peak| sheet.quantum_efficiency = sheet.quantum_efficiency.with_peak(peak),
    },
    key!(
        band_from_nm,
        WAVELENGTHS_NM,
        "shortest wavelength that is detected, in nm"
    ),
    key!(
        band_to_nm,
        WAVELENGTHS_NM,
        "longest wavelength that is detected, in nm"
    ),
    key!(
        read_noise_e,
        NumberRange::NotNegative,
        "read noise of a pixel, in electrons"
    ),
    key!(
        dark_current_e_s,
        NumberRange::NotNegative,
        "dark current of a pixel, in electrons per second"
    ),
    key!(
        full_well_e,
        NumberRange::Positive,
        "full well of a pixel, in electrons"
    ),
    key!(
        gain_e_per_adu,
        NumberRange::Positive,
        "gain, in electrons per gray level"
    ),
    key!(bits, NumberRange::Whole(1.0, 32.0), "bit depth"),
    key!(
        bias_adu,
        NumberRange::NotNegative,
        "bias level: gray level without light"
    ),
    Key {
        name: "spot_sigma_px",
        about: "standard deviation of a star's spot, in pixels",
        limits: SPOTS_PX,
        get: |sheet| Some(sheet.spot_sigma_px),
        set: |sheet, sigma_px| {
            sheet.spot_sigma_px = sigma_px;
            // A stated share belongs to the previous spot.
            sheet.peak_share = None;
        },
    },
    Key {
        name: "peak_share",
        about: "fraction of a star's light in its brightest pixel (default: from spot_sigma_px)",
        limits: NumberRange::Share,
        get: |sheet| Some(sheet.peak_share()),
        set: |sheet, share| sheet.peak_share = Some(share),
    },
];

/// A share, 0 and 1 included.
const FRACTION: NumberRange = NumberRange::FromTo(0.0, 1.0);
/// Displacement by the lens, in pixels.
const DISPLACEMENT_PX: NumberRange = NumberRange::FromTo(-1000.0, 1000.0);
/// Distance of the axis from the frame's centre, in pixels.
const AXIS_PX: NumberRange = NumberRange::FromTo(-20_000.0, 20_000.0);
/// Length of a spot by aberrations, in pixels.
const ABERRATION_PX: NumberRange = NumberRange::FromTo(-50.0, 50.0);

/// The numbers of the imperfections, all of them optional.
pub const IMPERFECTION_KEYS: &[Key<DataSheet>] = &[
    key!(vignetting in imperfections, FRACTION, "vignetting: fraction of the light lost in the corners"),
    key!(field_radius_deg in imperfections,
        NumberRange::FromTo(1.0, 110.0),
        "field radius of a non-rectilinear lens, as an angle from the axis, in degrees"
    ),
    key!(distortion_px in imperfections,
        DISPLACEMENT_PX,
        "third-order radial distortion: outward displacement of a star in the corner, in pixels"
    ),
    key!(distortion5_px in imperfections, DISPLACEMENT_PX, "fifth-order radial distortion, in pixels"),
    key!(distortion7_px in imperfections, DISPLACEMENT_PX, "seventh-order radial distortion, in pixels"),
    key!(decentring_x_px in imperfections,
        DISPLACEMENT_PX,
        "decentering distortion along x: displacement at the corner distance, in pixels"
    ),
    key!(decentring_y_px in imperfections,
        DISPLACEMENT_PX,
        "decentering distortion along y: displacement at the corner distance, in pixels"
    ),
    key!(axis_x_px in imperfections,
        AXIS_PX,
        "x offset of the optical axis from the center of the frame, in pixels"
    ),
    key!(axis_y_px in imperfections,
        AXIS_PX,
        "y offset of the optical axis from the center of the frame, downward, in pixels"
    ),
    key!(stretch_px in imperfections,
        DISPLACEMENT_PX,
        "scale along x larger than along y: displacement at the corner distance, in pixels"
    ),
    key!(skew_px in imperfections,
        DISPLACEMENT_PX,
        "scale along one diagonal larger than along the other: displacement at the corner distance, in pixels"
    ),
    key!(spot_axis_ratio in imperfections,
        NumberRange::FromTo(1.0, 10.0),
        "ratio of the longer to the shorter axis of a star's spot, at constant area"
    ),
    key!(spot_angle_deg in imperfections,
        NumberRange::FromTo(-180.0, 180.0),
        "direction of the longer axis of a star's spot, from x towards y, in degrees"
    ),
    key!(coma_px in imperfections,
        ABERRATION_PX,
        "coma: length of the comatic flare of a star in the corner, positive outward, in pixels"
    ),
    key!(astigmatism_px in imperfections,
        ABERRATION_PX,
        "astigmatism: half length of the line image of a star in the corner, in pixels"
    ),
    key!(field_curvature_px in imperfections,
        ABERRATION_PX,
        "field curvature: radius of the blur disk of a star in the corner, in pixels"
    ),
    key!(moffat_beta in imperfections,
        NumberRange::FromTo(1.2, 100.0),
        "exponent (beta) of a Moffat profile"
    ),
    key!(obstruction in imperfections,
        NumberRange::FromTo(0.0, 0.95),
        "diameter of the central obstruction relative to the pupil, for Airy patterns"
    ),
    key!(spot_step_px in imperfections,
        NumberRange::FromTo(0.01, 5.0),
        "spacing of the samples in spot_file, in pixels"
    ),
    key!(jpeg_quality in imperfections,
        NumberRange::FromTo(0.0, 100.0),
        "JPEG quality of a simulated color camera (mosaic, demosaicing, 8 bits); 0: no JPEG"
    ),
    key!(tone_gamma in imperfections,
        NumberRange::FromTo(1.0, 5.0),
        "exponent of the tone curve of the JPEG"
    ),
    key!(denoise_px in imperfections,
        NumberRange::FromTo(0.0, 5.0),
        "standard deviation of the smoothing before JPEG compression, in pixels"
    ),
    key!(response_sigma in imperfections,
        FRACTION,
        "standard deviation of the pixels' response, relative to its mean (PRNU)"
    ),
    key!(dark_current_sigma in imperfections,
        NumberRange::FromTo(0.0, 10.0),
        "standard deviation of the pixels' dark current, relative to its mean (DSNU)"
    ),
    key!(hot_pixels_per_mpx in imperfections,
        NumberRange::FromTo(0.0, 1e6),
        "hot pixels per million pixels"
    ),
    key!(hot_pixel_e_s in imperfections,
        NumberRange::NotNegative,
        "mean dark current of a hot pixel, in electrons per second"
    ),
    key!(dead_pixels_per_mpx in imperfections,
        NumberRange::FromTo(0.0, 1e6),
        "dead pixels per million pixels"
    ),
    key!(offset_sigma_adu in imperfections,
        NumberRange::NotNegative,
        "standard deviation of the pixels' bias, in gray levels"
    ),
    key!(column_sigma_adu in imperfections,
        NumberRange::NotNegative,
        "standard deviation of the columns' bias, in gray levels"
    ),
    key!(blooming in imperfections,
        FRACTION,
        "blooming: fraction of the charge above full well that flows along the column"
    ),
    key!(depth_um in imperfections,
        NumberRange::FromTo(0.1, 1000.0),
        "depth of the charge-collecting layer, in µm (for cosmic rays)"
    ),
    key!(pattern_seed in imperfections,
        NumberRange::Whole(0.0, 9_007_199_254_740_991.0),
        "seed of the pixel pattern, which is the same in every frame"
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn another_spot_has_another_share_on_its_brightest_pixel() {
        let mut sheet = Preset::Experiment1.data_sheet();
        let set =
            |sheet: &mut DataSheet, name, value| (Key::find(KEYS, name).unwrap().set)(sheet, value);
        set(&mut sheet, "spot_sigma_px", 0.5);
        // erf(1/√2)² = 0.682689².
        assert!((sheet.peak_share() - 0.466_065).abs() < 1e-6);
        set(&mut sheet, "peak_share", 0.25);
        assert_eq!((sheet.spot_sigma_px, sheet.peak_share()), (0.5, 0.25));
    }

    #[test]
    fn a_band_without_an_end_is_outside_the_limits() {
        for name in ["band_from_nm", "band_to_nm"] {
            let limits = Key::find(KEYS, name).unwrap().limits;
            assert!(limits.accept(400.0) && !limits.accept(1e300), "{name}");
        }
    }
}
