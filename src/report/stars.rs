//! The reports of detections and their stars.

use super::digits::{
    AIRMASS_DECIMALS, CHANCE_DIGITS, DIRECTION_DECIMALS, FLUX_DIGITS, PIXEL_DECIMALS, SIGMA_DIGITS,
};
use super::frame_report::StarReport;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::format::{finite, significant, to_decimals, turn_deg};
use crate::base::units::DEG_PER_RAD;
use crate::catalog::Catalog;
use crate::detect::{DetectionFlags, Detections};
use crate::identify::{Identification, StarMatch};
use crate::solve::Source;

/// The report of a detection that is not identified.
pub(super) fn detection(source: &Source) -> StarReport {
    let measured = source.measured.as_ref();
    StarReport {
        x: to_decimals(source.position.x, PIXEL_DECIMALS),
        y: to_decimals(source.position.y, PIXEL_DECIMALS),
        sigma_x: measured.and_then(|m| significant(m.sigma_px[0], SIGMA_DIGITS)),
        sigma_y: measured.and_then(|m| significant(m.sigma_px[1], SIGMA_DIGITS)),
        flux: source.flux.and_then(|flux| significant(flux, FLUX_DIGITS)),
        sigma_flux: source
            .flux
            .zip(measured)
            .and_then(|(flux, m)| significant(flux / m.snr, SIGMA_DIGITS)),
        peak: measured.and_then(|m| significant(m.peak, FLUX_DIGITS)),
        snr: measured.and_then(|m| significant(m.snr, SIGMA_DIGITS)),
        flags: measured.map(|m| flag_names(m.flags)).unwrap_or_default(),
        ..StarReport::default()
    }
}

/// The reports of detections, in their order.
pub fn detections(found: &Detections) -> Vec<StarReport> {
    let sources = found.sources.iter().map(Source::from);
    sources.map(|source| detection(&source)).collect()
}

/// What an identified frame shows.
pub(super) struct ReportedPointing<'a> {
    pub identification: &'a Identification,
}

impl ReportedPointing<'_> {
    /// Adds right ascension and declination to all detections, and its star to each named one.
    pub(super) fn add_to(&self, stars: &mut [StarReport], catalog: &Catalog) {
        for star in stars.iter_mut() {
            let pixel = PixelPoint::new(star.x, star.y);
            if let Some(apparent) = self.identification.apparent_direction_of(&pixel) {
                let places = &self.identification.places;
                star.set_direction(&places.astrometric(&apparent));
                star.airmass = places
                    .airmass(&apparent)
                    .map(|airmass| to_decimals(airmass, AIRMASS_DECIMALS));
            }
        }
        for star_match in &self.identification.matches {
            if let Some(star) = stars.get_mut(star_match.source.get()) {
                self.name(star, star_match, catalog);
            }
        }
    }

    /// Adds the identified star, with its position at the date of the frame.
    fn name(&self, star: &mut StarReport, star_match: &StarMatch, catalog: &Catalog) {
        let known = catalog.star(star_match.star);
        let places = &self.identification.places;
        let direction = known.direction_at(places.years_since_j2000());
        let apparent = places.apparent(&direction);
        star.id = Some(catalog.designation(star_match.star));
        star.name = catalog.full_name(star_match.star);
        let numbers = catalog.numbers_of(star_match.star);
        (star.hip, star.hd) = (numbers.hip, numbers.hd);
        (star.hr, star.sao) = (numbers.hr, numbers.sao);
        star.vmag = finite(f64::from(known.v_mag), 3);
        star.residual_px = self.residual_px(star, &apparent);
        star.p_chance = significant(star_match.p_chance, CHANCE_DIGITS);
        // The light of a single star has exactly the star's direction.
        let is_blend = star_match.light != apparent;
        if is_blend {
            star.residual_blend_px = self.residual_px(star, &star_match.light);
            // On the coarse pixels of wide lenses most blends are not known to be such.
            if !self.identification.camera.is_pinhole() {
                self.add_shift(star, [&apparent, &star_match.light]);
            }
        }
        star.set_direction(&direction);
    }

    /// Adds the shift of a star's light by the stars that are blended with it to the errors of the star's place.
    fn add_shift(&self, star: &mut StarReport, [own, light]: [&UnitVector<Icrs>; 2]) {
        let places = [own, light].map(|direction| self.identification.pixel_of(direction));
        let [Some(own), Some(light)] = places else {
            return;
        };
        let with = |sigma_px: Option<f64>, shift_px: f64| {
            significant(libm::hypot(sigma_px?, shift_px), SIGMA_DIGITS)
        };
        star.sigma_x = with(star.sigma_x, light.x - own.x);
        star.sigma_y = with(star.sigma_y, light.y - own.y);
    }

    /// Distance of a detection from what appears in this direction, in pixels.
    fn residual_px(&self, star: &StarReport, direction: &UnitVector<Icrs>) -> Option<f64> {
        let predicted = self.identification.pixel_of(direction)?;
        let distance_px = predicted.distance_to(&PixelPoint::new(star.x, star.y));
        finite(distance_px, PIXEL_DECIMALS)
    }
}

impl StarReport {
    /// Whether the detection may be a star at its position: [`DetectionFlags::is_star_like`].
    pub(super) fn is_star_like(&self) -> bool {
        const UNLIKE_STARS: [&str; 3] = ["hot_pixel", "trail", "extended"];
        !self.flags.iter().any(|flag| UNLIKE_STARS.contains(flag))
    }

    fn set_direction(&mut self, direction: &UnitVector<Icrs>) {
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        self.ra_deg = Some(turn_deg(ra_rad * DEG_PER_RAD, DIRECTION_DECIMALS));
        self.dec_deg = finite(dec_rad * DEG_PER_RAD, DIRECTION_DECIMALS);
    }
}

fn flag_names(flags: DetectionFlags) -> Vec<&'static str> {
    [
        (flags.saturated, "saturated"),
        (flags.hot_pixel, "hot_pixel"),
        (flags.trail, "trail"),
        (flags.extended, "extended"),
        (flags.blended, "blended"),
        (flags.border, "border"),
    ]
    .into_iter()
    .filter_map(|(is_set, name)| is_set.then_some(name))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_named_in_a_fixed_order() {
        let flags = DetectionFlags {
            border: true,
            saturated: true,
            ..DetectionFlags::default()
        };
        assert_eq!(flag_names(flags), ["saturated", "border"]);
    }

    #[test]
    fn a_report_is_star_like_where_its_flags_are() {
        for bit in 0..64 {
            let is_set = |place: u32| bit >> place & 1 == 1;
            let flags = DetectionFlags {
                saturated: is_set(0),
                hot_pixel: is_set(1),
                trail: is_set(2),
                extended: is_set(3),
                blended: is_set(4),
                border: is_set(5),
            };
            let report = StarReport {
                flags: flag_names(flags),
                ..StarReport::default()
            };
            assert_eq!(report.is_star_like(), flags.is_star_like(), "{flags:?}");
        }
    }
}
