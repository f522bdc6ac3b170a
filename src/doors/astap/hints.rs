//! What a caller states of a frame.

use super::plate::Plate;
use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};
use crate::doors::{ScaleRange, ScaleUnit};
use crate::identify::ScalePrior;
use crate::solve::SolveOptions;

/// The true scale in units of the stated one: heights are right to 10 %, and StellarSolver may state the low end of
/// the width, 0.9 of it, of frames up to 16:9.
const FACTORS: [f64; 2] = [0.58, 1.11];
/// Widest radius that restricts the search, in degrees.
const MAX_RADIUS_DEG: f64 = 90.0;

/// What a caller states of a frame; values that cannot be are left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hints {
    /// Height of the field, in degrees; 0 if it is not known.
    pub height_deg: Option<f64>,
    /// Right ascension of the centre, in hours.
    pub ra_h: Option<f64>,
    /// Angle of the centre from the south pole, in degrees.
    pub south_pole_distance_deg: Option<f64>,
    /// How far from there the centre may be, in degrees.
    pub radius_deg: Option<f64>,
}

impl Hints {
    /// The scale of a frame with this many rows.
    pub fn scale(&self, height_px: usize) -> Option<ScalePrior> {
        let middle = self.pixel_arcsec(height_px)?;
        let range = ScaleRange {
            unit: ScaleUnit::ArcsecondsPerPixel,
            low: Some(middle * FACTORS[0]),
            high: Some(middle * FACTORS[1]),
        };
        range.prior()
    }

    /// The direction, for a frame.
    pub fn options(&self) -> SolveOptions {
        let mut options = SolveOptions::default();
        let radius_deg = self.radius_deg.unwrap_or(f64::MAX).max(1.0);
        let spd_deg = self.south_pole_distance_deg;
        let spd_deg = spd_deg.filter(|angle_deg| (0.0..=180.0).contains(angle_deg));
        if let Some((ra_h, spd_deg)) = self.ra_h.zip(spd_deg)
            && radius_deg < MAX_RADIUS_DEG
        {
            options.near_deg = Some([(15.0 * ra_h).rem_euclid(360.0), spd_deg - 90.0]);
            options.radius_deg = radius_deg;
        }
        options
    }

    /// What ASTAP tells where the height that is stated is not that of the frame.
    pub fn warning(&self, plate: &Plate) -> Option<String> {
        /// What is not worth a word.
        const SMALL: f64 = 0.05;
        let stated = self.pixel_arcsec(plate.size_px[1])?;
        let found = plate.cdelt_deg()[1] * 3600.0;
        ((stated / found - 1.0).abs() > SMALL).then(|| {
            let height_deg = plate.height_deg();
            format!("Warning scale was inaccurate! Set FOV={height_deg:.2}d, scale={found:.1}\"")
        })
    }

    /// The pixel scale of a pinhole, in arcseconds.
    fn pixel_arcsec(&self, height_px: usize) -> Option<f64> {
        const WIDEST_DEG: f64 = 179.0;
        let height_deg = self.height_deg.filter(|height_deg| *height_deg > 0.0)?;
        let half_rad = 0.5 * height_deg.min(WIDEST_DEG) * RAD_PER_DEG;
        Some(2.0 * libm::tan(half_rad) / height_px as f64 * ARCSEC_PER_RAD)
    }
}

#[cfg(test)]
mod tests {
    use super::super::plate::tests::turned;
    use super::*;
    use crate::base::units::RAD_PER_ARCSEC;

    #[test]
    fn the_height_gives_the_scale() {
        let hints = Hints {
            height_deg: Some(4.7972),
            ..Hints::default()
        };
        let prior = hints.scale(480).unwrap();
        assert!(!prior.is_binding());
        let [low, high] = prior.pixel_scale_range_rad(1.0);
        assert!((low / RAD_PER_ARCSEC - 20.88).abs() < 0.01);
        assert!((high / RAD_PER_ARCSEC - 39.96).abs() < 0.01);
        assert_eq!(hints.warning(&turned(false)), None);
        for height_deg in [None, Some(0.0), Some(-3.0), Some(f64::NAN)] {
            assert_eq!(
                Hints {
                    height_deg,
                    ..hints
                }
                .scale(480),
                None
            );
        }
        let height_deg = Some(5.1);
        assert_eq!(
            Hints {
                height_deg,
                ..hints
            }
            .warning(&turned(false))
            .unwrap(),
            "Warning scale was inaccurate! Set FOV=4.80d, scale=36.0\""
        );
    }

    #[test]
    fn the_direction_is_in_hours_and_from_the_south_pole() {
        let hints = Hints {
            ra_h: Some(5.58),
            south_pole_distance_deg: Some(89.6),
            radius_deg: Some(10.0),
            height_deg: None,
        };
        let [ra_deg, dec_deg] = hints.options().near_deg.unwrap();
        assert!((ra_deg - 83.7).abs() < 1e-12 && (dec_deg + 0.4).abs() < 1e-12);
        assert_eq!(hints.options().radius_deg, 10.0);
        let none = |hints: Hints| assert_eq!(hints.options().near_deg, None);
        none(Hints {
            radius_deg: Some(180.0),
            ..hints
        });
        none(Hints {
            radius_deg: None,
            ..hints
        });
        none(Hints {
            ra_h: None,
            ..hints
        });
        none(Hints {
            south_pole_distance_deg: Some(190.0),
            ..hints
        });
    }
}
