//! Which parts of the sky are searched for a narrow field, and for fields of which width.

use crate::base::size::Size;
use crate::base::units::RAD_PER_DEG;
use crate::catalog::deep::Region;
use crate::identify::{Priors, SkyRegion};

/// Fields at least this wide have stars enough in the catalogue of all frames.
const WIDE_RAD: f64 = 1.6 * RAD_PER_DEG;
/// Widest field that is searched where the scale is not known: wider ones are found without.
const WIDEST_RAD: f64 = 3.0 * RAD_PER_DEG;
/// Narrowest field that is searched where the direction is known and the scale is not.
const NARROWEST_RAD: f64 = 0.15 * RAD_PER_DEG;
/// Fields wider than this are not searched: the brightest stars of a deep catalogue are those of the other.
const MAX_RAD: f64 = 6.0 * RAD_PER_DEG;
/// The fields for which the stars of the whole sky are indexed.
pub const FIELDS_OF_SKY_RAD: [f64; 2] = [0.375 * RAD_PER_DEG, WIDE_RAD];
/// Stars in the smallest field that are indexed, where there are as many.
const STARS_PER_FIELD: f64 = 40.0;
/// Most stars that an index has.
pub const MAX_STARS: f64 = 2_000_000.0;
/// Widths of the narrowest field over that of a catalogue in which it is still tried.
const BELOW_NARROWEST: f64 = 0.7;

/// A part of the sky, and the fields that are searched there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attempt {
    /// The part of the sky, with the density of stars that are wanted there; `None` for all of it.
    pub region: Option<Region>,
    /// Where the frame's centre may lie in it.
    pub near: Option<SkyRegion>,
    /// The narrowest and the widest field, in radians.
    pub fov_range_rad: [f64; 2],
}

/// Widths of the fields of frames with this width that the priors allow, in radians.
fn fov_range_rad(priors: &Priors, width_px: f64) -> Option<[f64; 2]> {
    let scales = priors.pixel_scale_range_rad(width_px)?;
    Some(scales.map(|scale| 2.0 * libm::atan(width_px * scale / 2.0)))
}

/// Whether the field is so narrow that the catalogue of all frames has too few stars.
pub fn is_narrow(priors: &Priors, width_px: f64) -> bool {
    fov_range_rad(priors, width_px).is_some_and(|[_, widest]| widest < WIDE_RAD)
}

/// What is searched, the most likely first, in a catalogue whose narrowest field is this on average; nothing for wide
/// fields.
pub fn attempts(priors: &Priors, size: Size, narrowest_rad: f64) -> Vec<Attempt> {
    let [width_px, height_px] = size.sides().map(|side| side as f64);
    let known = fov_range_rad(priors, width_px);
    if known.is_some_and(|[low, _]| low > MAX_RAD) {
        return Vec::new();
    }
    let [low, high] = known.unwrap_or([NARROWEST_RAD, WIDEST_RAD]);
    let fov_range_rad = [low, high.min(MAX_RAD)];
    let hints = priors.near.into_iter().chain(priors.mount);
    let mut attempts: Vec<Attempt> = hints
        .map(|near| near_attempt(near, fov_range_rad, height_px / width_px))
        .collect();
    // Here and there it has more stars than on average.
    let narrowest_rad = FIELDS_OF_SKY_RAD[0].max(BELOW_NARROWEST * narrowest_rad);
    if priors.near.is_none() && fov_range_rad[1] > narrowest_rad {
        attempts.push(Attempt {
            region: None,
            near: None,
            fov_range_rad: FIELDS_OF_SKY_RAD,
        });
    }
    attempts
}

/// The search near a direction.
fn near_attempt(near: SkyRegion, fov_range_rad: [f64; 2], aspect: f64) -> Attempt {
    /// Half of the diagonal of a field over its width is less where it is no higher than wide.
    const HALF_DIAGONAL: f64 = 0.75;
    let [low, high] = fov_range_rad;
    let field_sq_deg = (low / RAD_PER_DEG).powi(2) * aspect;
    let region = Region {
        centre: near.centre,
        radius_rad: near.radius_rad + HALF_DIAGONAL * high * aspect.max(1.0),
        per_sq_deg: STARS_PER_FIELD / field_sq_deg,
    };
    Attempt {
        region: Some(Region {
            per_sq_deg: region.per_sq_deg.min(MAX_STARS / region.area_sq_deg()),
            ..region
        }),
        near: Some(near),
        fov_range_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::identify::{Scale, ScalePrior};

    const SIZE: Size = Size {
        width: 1500,
        height: 1000,
    };
    const TYCHO_RAD: f64 = 0.5 * RAD_PER_DEG;

    fn of_fov(fov_deg: f64) -> Priors {
        let scale = ScalePrior::by_user(Scale::FieldOfView(fov_deg * RAD_PER_DEG), 0.1);
        Priors {
            scale: Some(scale),
            ..Priors::default()
        }
    }

    #[test]
    fn a_field_of_which_nothing_is_known_is_searched_in_the_whole_sky() {
        let attempts = attempts(&Priors::default(), SIZE, TYCHO_RAD);
        assert_eq!(attempts.len(), 1);
        assert_eq!(attempts[0].region, None);
        assert_eq!(attempts[0].fov_range_rad, FIELDS_OF_SKY_RAD);
    }

    #[test]
    fn wide_fields_and_those_too_narrow_are_not_searched() {
        assert!(attempts(&of_fov(12.0), SIZE, TYCHO_RAD).is_empty());
        assert!(attempts(&of_fov(0.2), SIZE, TYCHO_RAD).is_empty());
        assert!(!is_narrow(&of_fov(12.0), 1500.0));
        assert!(is_narrow(&of_fov(1.0), 1500.0));
        assert!(!is_narrow(&Priors::default(), 1500.0));
    }

    #[test]
    fn a_mount_is_believed_first_and_the_user_alone() {
        let near = SkyRegion {
            centre: UnitVector::from_ra_dec(1.0, 0.5),
            radius_rad: 2.0 * RAD_PER_DEG,
        };
        let by_mount = Priors {
            mount: Some(near),
            ..of_fov(0.5)
        };
        let of_mount = attempts(&by_mount, SIZE, TYCHO_RAD);
        assert_eq!(of_mount.len(), 2);
        let region = of_mount[0].region.unwrap();
        assert!(region.radius_rad > near.radius_rad);
        // Forty in 0.45° × 0.30°.
        assert!((region.per_sq_deg - 296.0).abs() < 1.0, "{region:?}");
        let by_user = Priors {
            near: Some(near),
            ..of_fov(0.5)
        };
        assert_eq!(attempts(&by_user, SIZE, TYCHO_RAD).len(), 1);
    }
}
