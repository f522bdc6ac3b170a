//! Conversion factors between angular units.

use std::f64::consts::PI;

/// Radians in one degree.
pub const RAD_PER_DEG: f64 = PI / 180.0;
/// Radians in one arcsecond.
pub const RAD_PER_ARCSEC: f64 = PI / (180.0 * 3600.0);
/// Degrees in one radian.
pub const DEG_PER_RAD: f64 = 180.0 / PI;
/// Arcseconds in one radian.
pub const ARCSEC_PER_RAD: f64 = 180.0 * 3600.0 / PI;
/// Area of the whole sky, in square degrees.
pub const WHOLE_SKY_SQ_DEG: f64 = 41_252.96;
