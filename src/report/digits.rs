//! How many digits the report gives.

/// Decimals of a position or residual in pixels.
pub(super) const PIXEL_DECIMALS: i32 = 4;
/// Decimals of a direction in degrees: 0.4 milliarcseconds.
pub(super) const DIRECTION_DECIMALS: i32 = 7;
/// Decimals of an angle in the observer's sky, in degrees: 0.4″, less than the neglected effects.
pub(super) const HORIZON_DECIMALS: i32 = 4;
/// Decimals of an airmass.
pub(super) const AIRMASS_DECIMALS: i32 = 4;
/// Decimals of a year: an hour.
pub(super) const YEAR_DECIMALS: i32 = 4;
/// Decimals of a magnitude.
pub(super) const MAG_DECIMALS: i32 = 4;
/// Significant digits of a flux.
pub(super) const FLUX_DIGITS: i32 = 6;
/// Significant digits of a probability.
pub(super) const CHANCE_DIGITS: i32 = 2;
/// Significant digits of a standard error.
pub(super) const SIGMA_DIGITS: i32 = 4;
/// Decimals of a share of the frame.
pub(super) const FRACTION_DECIMALS: i32 = 4;
