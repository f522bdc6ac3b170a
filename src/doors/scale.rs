//! Scales as other solvers state them: a range, in several units.

use crate::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use crate::identify::{Scale, ScalePrior};

/// Ratio of the ends of a range that tells nothing.
const MAX_RATIO: f64 = 100.0;
/// Fields that cameras have, in degrees: the ends of a range that are not stated.
const FIELDS_DEG: [f64; 2] = [0.1, 180.0];
/// Pixel scales that they have, in arcseconds.
const PIXELS_ARCSEC: [f64; 2] = [0.1, 1000.0];
/// Width of the film that focal lengths refer to, in millimetres.
const FILM_MM: f64 = 36.0;

/// What a scale is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScaleUnit {
    /// Width of the field, in degrees.
    DegreesWide,
    /// Width of the field, in arcminutes.
    ArcminutesWide,
    /// Angle of a pixel, in arcseconds.
    ArcsecondsPerPixel,
    /// Focal length with film 36 mm wide, in millimetres.
    FocalLengthMm,
}

/// A scale between two values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleRange {
    /// What they are measured in.
    pub unit: ScaleUnit,
    /// The lower value, if it is stated.
    pub low: Option<f64>,
    /// The upper value, if it is stated.
    pub high: Option<f64>,
}

impl ScaleRange {
    /// The scale to try first; `None` where the range tells nothing, or is none.
    pub fn prior(&self) -> Option<ScalePrior> {
        let (to_angle, [least, most]): (fn(f64) -> f64, _) = match self.unit {
            ScaleUnit::DegreesWide => (|deg| deg, FIELDS_DEG),
            ScaleUnit::ArcminutesWide => (|arcmin| arcmin / 60.0, FIELDS_DEG),
            ScaleUnit::ArcsecondsPerPixel => (|arcsec| arcsec, PIXELS_ARCSEC),
            ScaleUnit::FocalLengthMm => (field_deg, FIELDS_DEG),
        };
        let stated = [self.low, self.high].map(|end| end.map(to_angle));
        let [low, high] = match (self.unit, stated) {
            (ScaleUnit::FocalLengthMm, [low, high]) => [high, low],
            (_, ends) => ends,
        };
        if low.is_none() && high.is_none() {
            return None;
        }
        let (low, high) = (low.unwrap_or(least), high.unwrap_or(most));
        let is_range = low > 0.0 && low <= high && high <= MAX_RATIO * low;
        is_range.then(|| prior(self.unit, low, high))
    }
}

/// Width of the field of a lens in front of film, in degrees.
fn field_deg(focal_mm: f64) -> f64 {
    2.0 * libm::atan2(FILM_MM / 2.0, focal_mm).to_degrees()
}

fn prior(unit: ScaleUnit, low: f64, high: f64) -> ScalePrior {
    /// Values are rounded where they are written.
    const MIN_TOLERANCE: f64 = 0.01;
    let middle = 0.5 * (low + high);
    let scale = match unit {
        ScaleUnit::ArcsecondsPerPixel => Scale::Pixel(middle * RAD_PER_ARCSEC),
        _ => Scale::FieldOfView(middle * RAD_PER_DEG),
    };
    let tolerance = ((high - low) / (high + low)).max(MIN_TOLERANCE);
    ScalePrior::by_user(scale, tolerance).tried_first()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(unit: ScaleUnit, low: Option<f64>, high: Option<f64>) -> Option<[f64; 2]> {
        let prior = ScaleRange { unit, low, high }.prior()?;
        assert!(!prior.is_binding());
        Some(
            prior
                .pixel_scale_range_rad(1000.0)
                .map(|rad| rad / RAD_PER_ARCSEC),
        )
    }

    #[test]
    fn ranges_of_pixel_scales_are_taken_as_they_are() {
        let [low, high] = range(ScaleUnit::ArcsecondsPerPixel, Some(8.0), Some(12.0)).unwrap();
        assert!((low - 8.0).abs() < 1e-9 && (high - 12.0).abs() < 1e-9);
        // One value twice has a tolerance.
        let [low, high] = range(ScaleUnit::ArcsecondsPerPixel, Some(10.0), Some(10.0)).unwrap();
        assert!((low - 9.9).abs() < 1e-9 && (high - 10.1).abs() < 1e-9);
    }

    #[test]
    fn widths_are_those_of_a_pinhole() {
        let degrees = range(ScaleUnit::DegreesWide, Some(1.0), Some(2.0)).unwrap();
        let arcminutes = range(ScaleUnit::ArcminutesWide, Some(60.0), Some(120.0)).unwrap();
        for (end, expected) in [(0, 3.6), (1, 7.2)] {
            assert!((degrees[end] / expected - 1.0).abs() < 1e-3);
            assert!((degrees[end] / arcminutes[end] - 1.0).abs() < 1e-12);
        }
        // 50 mm see 39.6°, 100 mm 20.4°.
        let focal = range(ScaleUnit::FocalLengthMm, Some(50.0), Some(100.0)).unwrap();
        let width = range(ScaleUnit::DegreesWide, Some(20.408), Some(39.598)).unwrap();
        for (focal, width) in focal.into_iter().zip(width) {
            assert!((focal / width - 1.0).abs() < 1e-3, "{focal} {width}");
        }
    }

    #[test]
    fn what_tells_nothing_is_no_hint() {
        let unit = ScaleUnit::DegreesWide;
        assert_eq!(range(unit, None, None), None);
        assert_eq!(range(unit, Some(0.1), Some(180.0)), None);
        assert_eq!(range(unit, Some(3.0), Some(2.0)), None);
        assert_eq!(range(unit, Some(-1.0), Some(2.0)), None);
        assert_eq!(range(unit, Some(f64::NAN), Some(2.0)), None);
        assert!(range(unit, None, Some(5.0)).is_some());
    }
}
