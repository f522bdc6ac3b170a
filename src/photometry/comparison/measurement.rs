//! The two sides of the comparison: the stated camera and the measured frame.

use crate::base::statistics::Estimate;
use crate::camera::data_sheet::DataSheet;
use crate::detect::DetectConfig;
use crate::photometry::zero_point::WeightedColor;
use crate::predict::Extinction;

/// The camera with which a frame was taken, as stated by the user.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ObservingSetup {
    /// Its data sheet.
    pub sheet: DataSheet,
    /// Zenith distance of the frame's centre, in degrees. Default: that of site and date, else that
    /// of the header, else 0.
    pub zenith_distance_deg: Option<f64>,
    /// Atmospheric extinction; default: that of the model.
    pub extinction: Option<Extinction>,
}

impl ObservingSetup {
    /// A camera with this data sheet; nothing else is stated.
    pub const fn new(sheet: DataSheet) -> Self {
        Self {
            sheet,
            zenith_distance_deg: None,
            extinction: None,
        }
    }
}

/// What was measured in a frame; `None` where unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameMeasurement<'a> {
    /// The configuration of the detection.
    pub detect: DetectConfig,
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// Exposure, in seconds.
    pub exposure_s: Option<f64>,
    /// Median level of the background, in ADU.
    pub background_adu: f64,
    /// Background noise of one pixel (standard deviation), in ADU.
    pub noise_adu: f64,
    /// Median threshold of the detection, in standard deviations of filtered white noise of
    /// `noise_adu`.
    pub threshold_sigma: f64,
    /// Share of the light lost in the corners.
    pub vignetting: f64,
    /// Places all over a wide field whose horizon is known.
    pub places: Option<Vec<FieldPosition>>,
    /// Light beyond the spots, over that of the spots.
    pub wings: f64,
    /// Standard deviation of a star's spot, in pixels.
    pub spot_sigma_px: Option<f64>,
    /// Pixel scale, in radians.
    pub pixel_scale_rad: Option<f64>,
    /// Apparent zenith distance of the centre from site, date and attitude, in degrees; above 90
    /// below the horizon.
    pub zenith_distance_deg: Option<f64>,
    /// Zenith distance of the centre from the file's header, in degrees.
    pub header_zenith_distance_deg: Option<f64>,
    /// V magnitude of a star that gives 1 ADU/s.
    pub zero_point_vmag: Option<Estimate>,
    /// The colors of the stars of the zero point.
    pub zero_point_colors: &'a [WeightedColor],
    /// Whether the zero point has a color term and holds for
    /// [`REFERENCE_BV_MAG`](crate::photometry::zero_point::REFERENCE_BV_MAG), instead of for the
    /// mean of its stars.
    pub has_color_term: bool,
    /// V magnitude at which half of the stars are detected.
    pub limit_vmag: Option<Estimate>,
    /// V magnitude of the faintest identified star.
    pub faintest_vmag: Option<f64>,
    /// All catalogue stars in the field, also those fainter than the frame shows.
    pub field: &'a [FieldStar],
}

/// A place in the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldPosition {
    /// By how much a star behind the air must be brighter to be detected than at the typical threshold, in
    /// magnitudes.
    pub brighter_mag: f64,
    /// Its airmass over that of the field's centre.
    pub airmass_ratio: f64,
}

/// A catalogue star in the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldStar {
    /// V magnitude.
    pub v_mag: f64,
    /// B−V, where known.
    pub bv_mag: Option<f64>,
}
