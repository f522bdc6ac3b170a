//! What a frame shows of the sky over its place: its named stars, and where it looks.

use super::super::source::Source;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::catalog::Catalog;
use crate::identify::{Identification, SourceIndex};

/// A named star.
#[derive(Debug, Clone, Copy)]
pub(super) struct NamedStar {
    pub source: SourceIndex,
    /// Where it appears without air.
    pub airless: UnitVector<Icrs>,
    pub pixel: PixelPoint,
    pub sigma_px: f64,
    pub v_mag: f64,
    pub p_chance: f64,
}

/// What a frame shows of the sky over its place.
#[derive(Debug)]
pub(crate) struct ObservedSky<'a> {
    pub(super) found: &'a Identification,
    pub(super) stars: Vec<NamedStar>,
    /// The largest angle of a named star from the lens's axis.
    field_rad: f64,
}

impl<'a> ObservedSky<'a> {
    pub fn new(found: &'a Identification, sources: &[Source], catalog: &Catalog) -> Self {
        /// Names that are less sure are left out.
        const MAX_CHANCE: f64 = 0.01;
        let airless = found.places.without_refraction();
        let sure = found
            .matches
            .iter()
            .filter(|named| named.p_chance < MAX_CHANCE);
        let stars = sure.map(|named| {
            let star = catalog.star(named.star);
            let source = &sources[named.source.get()];
            let sigma_px = source.measured.map_or([found.rms_px; 2], |m| m.sigma_px);
            NamedStar {
                source: named.source,
                airless: airless.of(star),
                pixel: source.position,
                sigma_px: libm::hypot(sigma_px[0], sigma_px[1]) / std::f64::consts::SQRT_2,
                v_mag: f64::from(star.v_mag),
                p_chance: named.p_chance,
            }
        });
        let stars: Vec<NamedStar> = stars.collect();
        let axis = found.icrs_to_camera.boresight();
        let angles = stars.iter().map(|star| star.airless.angle_to(&axis));
        let field_rad = angles.fold(0.0, f64::max);
        Self {
            found,
            stars,
            field_rad,
        }
    }

    /// Where the zenith is if the camera looks up, as that of an all-sky lens does.
    pub fn level_zenith(&self) -> Option<UnitVector<Icrs>> {
        /// Stars so far from the axis all around show that the camera looks up, more or less.
        const WIDE_RAD: f64 = 65.0 * RAD_PER_DEG;
        let is_wide = self.field_rad > WIDE_RAD && !self.found.camera.is_pinhole();
        is_wide.then(|| self.found.icrs_to_camera.boresight())
    }

    /// V magnitude that a quarter of the named stars exceed.
    pub fn faint_v_mag(&self) -> Option<f64> {
        let mut v_mags: Vec<f64> = self.stars.iter().map(|star| star.v_mag).collect();
        v_mags.sort_by(f64::total_cmp);
        v_mags.get(3 * v_mags.len() / 4).copied()
    }
}
