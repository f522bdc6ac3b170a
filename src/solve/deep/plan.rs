//! Which parts of the sky are searched for a narrow field, and for fields of which width.

use crate::base::size::Size;
use crate::base::units::{RAD_PER_DEG, WHOLE_SKY_SQ_DEG};
use crate::catalog::deep::{DeepContents, Region, SkyZone};
use crate::identify::{Priors, SkyRegion};

/// Fields at least this wide have stars enough in the catalogue of all frames.
const WIDE_RAD: f64 = 1.6 * RAD_PER_DEG;
/// Widest field that is searched where the scale is not known: wider ones are found without.
const WIDEST_RAD: f64 = 3.0 * RAD_PER_DEG;
/// Narrowest field that is searched where the direction is known and the scale is not.
const NARROWEST_RAD: f64 = 0.15 * RAD_PER_DEG;
/// Fields wider than this are not searched: the brightest stars of a deep catalogue are those of the other.
const MAX_RAD: f64 = 6.0 * RAD_PER_DEG;
/// Stars in the smallest field that are indexed, where there are as many.
const STARS_PER_FIELD: f64 = 40.0;
/// Most stars that an index has.
const MAX_STARS: f64 = 2_000_000.0;
/// Widths of the narrowest field over that of a catalogue in which it is still tried.
const BELOW_NARROWEST: f64 = 0.7;

/// A part of the sky, and the fields that are searched there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attempt {
    /// Where.
    pub part: Part,
    /// The narrowest and the widest field, in radians.
    pub fov_range_rad: [f64; 2],
}

/// Which part of the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Part {
    /// The surroundings of a direction, with the density of stars that are wanted there, and where in them the
    /// frame's centre may lie.
    Near(Region, SkyRegion),
    /// All of it, or a twelfth.
    Sweep(Sweep),
}

/// A part of the sky whose index is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Stars in a square degree that are wanted.
    pub per_sq_deg: f64,
    /// The twelfth, unless it is all of the sky.
    pub zone: Option<SkyZone>,
    /// Stars that all parts together have.
    pub stars: f64,
}

/// What is indexed of the whole sky for fields from a width on. Each level has twice the stars of the level before,
/// so that a field narrower by √2 has as many.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Level(i32);

impl Level {
    /// The narrowest field of the first level.
    const FIRST_RAD: f64 = 0.375 * RAD_PER_DEG;
    /// 16 million stars, for fields from 0.18° on.
    const LAST: i32 = 3;

    fn narrowest_rad(self) -> f64 {
        Self::FIRST_RAD / libm::exp2(f64::from(self.0) / 2.0)
    }

    fn per_sq_deg(self) -> f64 {
        MAX_STARS / WHOLE_SKY_SQ_DEG * libm::exp2(f64::from(self.0))
    }

    /// The level for fields of this width or wider; for all fields, the last whose index is not divided.
    fn of(low_rad: Option<f64>, deep: &DeepContents) -> Self {
        /// A field has so many times the stars of the narrowest of its level.
        const STARS: f64 = 1.7;
        let is_enough = |level: &Self| match low_rad {
            Some(low_rad) => level.narrowest_rad() * STARS.sqrt() <= low_rad,
            None => Self(level.0 + 1).per_sq_deg() * area_sq_deg(deep) > MAX_STARS,
        };
        // A level beyond all stars of the catalogue has no more of them.
        let has_all = |level: &Self| level.per_sq_deg() >= deep.per_sq_deg();
        let mut levels = (0..Self::LAST).map(Self);
        let level = levels.find(|level| is_enough(level) || has_all(level));
        level.unwrap_or(Self(Self::LAST))
    }
}

fn area_sq_deg(deep: &DeepContents) -> f64 {
    WHOLE_SKY_SQ_DEG * deep.share_of_sky
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

/// What is searched in a catalogue, the most likely first; nothing for wide fields.
pub fn attempts(priors: &Priors, size: Size, deep: &DeepContents) -> Vec<Attempt> {
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
    if priors.near.is_none() {
        attempts.extend(sweep(known, deep));
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
    let region = Region {
        per_sq_deg: region.per_sq_deg.min(MAX_STARS / region.area_sq_deg()),
        ..region
    };
    Attempt {
        part: Part::Near(region, near),
        fov_range_rad,
    }
}

/// The search of the whole sky, part by part; nothing where the fields are too narrow for the catalogue, or wide, or
/// where it has too many stars to read them all.
fn sweep(known: Option<[f64; 2]>, deep: &DeepContents) -> Vec<Attempt> {
    /// The index of a level has fields up to so many times the narrowest, where they are known.
    const WIDTHS: f64 = 3.0;
    /// Of more, as all of Gaia, reading alone takes hours.
    const MOST: u64 = 500_000_000;
    if deep.stars > MOST {
        return Vec::new();
    }
    let level = Level::of(known.map(|[low, _]| low), deep);
    // Here and there it has more stars than on average.
    let narrowest_rad = BELOW_NARROWEST * deep.narrowest_fov_deg() * RAD_PER_DEG;
    let narrowest_rad = narrowest_rad.max(level.narrowest_rad());
    if known.is_some_and(|[low, high]| high <= narrowest_rad || low >= WIDE_RAD) {
        return Vec::new();
    }
    let widest_rad = match known {
        Some(_) if level != Level(0) => WIDTHS * level.narrowest_rad(),
        _ => WIDE_RAD,
    };
    let per_sq_deg = level.per_sq_deg();
    let stars = per_sq_deg.min(deep.per_sq_deg()) * area_sq_deg(deep);
    let zones: Vec<Option<SkyZone>> = if stars > MAX_STARS {
        SkyZone::all().map(Some).collect()
    } else {
        vec![None]
    };
    let attempt = |zone| Attempt {
        part: Part::Sweep(Sweep {
            per_sq_deg,
            zone,
            stars,
        }),
        fov_range_rad: [level.narrowest_rad(), widest_rad],
    };
    zones.into_iter().map(attempt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::catalog::Band;
    use crate::identify::{Scale, ScalePrior};

    const SIZE: Size = Size {
        width: 1500,
        height: 1000,
    };

    fn contents(per_sq_deg: f64, share_of_sky: f64) -> DeepContents {
        DeepContents {
            kind: String::new(),
            band: Band::GaiaColors,
            stars: (per_sq_deg * WHOLE_SKY_SQ_DEG * share_of_sky) as u64,
            share_of_sky,
            epoch_year: None,
        }
    }

    fn tycho2() -> DeepContents {
        contents(45.4, 1.0)
    }

    fn of_fov(fov_deg: f64) -> Priors {
        let scale = ScalePrior::by_user(Scale::FieldOfView(fov_deg * RAD_PER_DEG), 0.1);
        Priors {
            scale: Some(scale),
            ..Priors::default()
        }
    }

    fn sweep_of(attempt: &Attempt) -> Sweep {
        match attempt.part {
            Part::Sweep(sweep) => sweep,
            Part::Near(..) => panic!("{attempt:?}"),
        }
    }

    #[test]
    fn a_field_of_which_nothing_is_known_is_searched_in_the_whole_sky() {
        for deep in [tycho2(), contents(5000.0, 1.0)] {
            let attempts = attempts(&Priors::default(), SIZE, &deep);
            assert_eq!(attempts.len(), 1);
            assert_eq!(sweep_of(&attempts[0]).zone, None);
            assert_eq!(attempts[0].fov_range_rad, [Level::FIRST_RAD, WIDE_RAD]);
        }
    }

    #[test]
    fn wide_fields_and_those_too_narrow_are_not_searched() {
        assert!(attempts(&of_fov(12.0), SIZE, &tycho2()).is_empty());
        assert!(attempts(&of_fov(3.0), SIZE, &tycho2()).is_empty());
        assert!(attempts(&of_fov(0.2), SIZE, &tycho2()).is_empty());
        assert!(attempts(&of_fov(0.05), SIZE, &contents(5000.0, 1.0)).is_empty());
        assert!(attempts(&of_fov(0.3), SIZE, &contents(43_000.0, 1.0)).is_empty());
        assert!(!is_narrow(&of_fov(12.0), 1500.0));
        assert!(is_narrow(&of_fov(1.0), 1500.0));
        assert!(!is_narrow(&Priors::default(), 1500.0));
    }

    #[test]
    fn narrower_fields_take_more_stars_in_twelve_parts() {
        let deep = contents(5000.0, 1.0);
        for (fov_deg, parts, millions) in [
            (1.0, 1, 2.0),
            (0.5, 12, 4.0),
            (0.3, 12, 8.0),
            (0.2, 12, 16.0),
        ] {
            let attempts = attempts(&of_fov(fov_deg), SIZE, &deep);
            assert_eq!(attempts.len(), parts, "{fov_deg}");
            let found = sweep_of(&attempts[0]);
            assert!((found.stars / 1e6 - millions).abs() < 0.01, "{found:?}");
            let [low, high] = attempts[0].fov_range_rad.map(|rad| rad / RAD_PER_DEG);
            assert!(low < 0.9 * fov_deg && high > 1.1 * fov_deg, "{low} {high}");
        }
        // Tycho-2 has no more stars for them.
        let attempts = attempts(&of_fov(0.45), SIZE, &tycho2());
        assert_eq!((attempts.len(), sweep_of(&attempts[0]).zone), (1, None));
    }

    #[test]
    fn all_stars_of_a_small_part_of_the_sky_are_searched() {
        let patch = contents(5000.0, 1e-4);
        for priors in [Priors::default(), of_fov(0.2)] {
            let attempts = attempts(&priors, SIZE, &patch);
            assert_eq!(attempts.len(), 1);
            let sweep = sweep_of(&attempts[0]);
            assert_eq!((sweep.zone, sweep.per_sq_deg > 300.0), (None, true));
            assert!(attempts[0].fov_range_rad[0] < 0.15 * RAD_PER_DEG);
        }
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
        let of_mount = attempts(&by_mount, SIZE, &tycho2());
        assert_eq!(of_mount.len(), 2);
        let Part::Near(region, place) = of_mount[0].part else {
            panic!("{:?}", of_mount[0]);
        };
        assert_eq!(place, near);
        assert!(region.radius_rad > near.radius_rad);
        // Forty in 0.45° × 0.30°.
        assert!((region.per_sq_deg - 296.0).abs() < 1.0, "{region:?}");
        let by_user = Priors {
            near: Some(near),
            ..of_fov(0.5)
        };
        assert_eq!(attempts(&by_user, SIZE, &tycho2()).len(), 1);
    }
}
