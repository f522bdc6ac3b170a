//! Which star a detection belongs to.

use crate::base::coords::PixelPoint;
use crate::base::neighbors::PointTree;
use crate::detect::PIXEL_VARIANCE_PX2;
use crate::lab::simulate::{TrueStar, Truth};
use crate::predict::Scenario;

/// The light of the true stars over the frame.
pub struct LightMap<'a> {
    stars: Vec<&'a TrueStar>,
    by_place: PointTree,
    variance_px2: [f64; 2],
}

impl<'a> LightMap<'a> {
    /// The light of the stars on a frame and just outside it.
    pub fn of(scenario: &Scenario, truth: &'a Truth) -> Self {
        let variance_px2 = scenario.camera.spot_sigma_px.powi(2) + PIXEL_VARIANCE_PX2;
        let smear_px2 = truth
            .motion_px
            .map(|motion_px| motion_px * motion_px / 12.0);
        let stars: Vec<_> = truth.stars.iter().chain(&truth.beyond).collect();
        Self {
            by_place: PointTree::new(stars.iter().map(|star| star.position)),
            stars,
            variance_px2: smear_px2.map(|smear_px2| variance_px2 + smear_px2),
        }
    }

    /// The star that contributes more than half of the starlight at this position, if it is near
    /// enough.
    pub fn owner(&self, place: &PixelPoint) -> Option<&'a TrueStar> {
        /// Radius of a spot, in standard deviations.
        const REACH_SIGMAS: f64 = 8.0;
        let light = |star: &TrueStar| self.light_of(star, place);
        let stars = || self.stars_near(place, REACH_SIGMAS * self.sigma_px());
        let all: f64 = stars().map(light).sum();
        let owner = stars().find(|star| 2.0 * light(star) > all)?;
        (owner.position.distance_to(place) < self.at_place_px()).then_some(owner)
    }

    /// The light of a star at this position, in electrons of a star that is right there.
    pub fn light_of(&self, star: &TrueStar, place: &PixelPoint) -> f64 {
        let offset = [star.position.x - place.x, star.position.y - place.y];
        let terms = offset.iter().zip(self.variance_px2);
        let exponent: f64 = terms.map(|(d, variance)| d * d / variance).sum();
        star.electrons * libm::exp(-0.5 * exponent)
    }

    /// The stars that a detection at this position may be.
    pub fn stars_at(&self, place: &PixelPoint) -> impl Iterator<Item = &'a TrueStar> {
        self.stars_near(place, self.at_place_px())
    }

    /// The stars within `radius_px` of this position, nearest first.
    pub fn stars_near(
        &self,
        place: &PixelPoint,
        radius_px: f64,
    ) -> impl Iterator<Item = &'a TrueStar> {
        let near = self.by_place.within(place, radius_px).into_iter();
        near.map(|near| self.stars[near.index])
    }

    /// Standard deviation of a spot along its wider axis.
    pub fn sigma_px(&self) -> f64 {
        self.variance_px2[0].max(self.variance_px2[1]).sqrt()
    }

    fn at_place_px(&self) -> f64 {
        /// Largest distance of a detection from its star: this many pixels, …
        const AT_PLACE_PX: f64 = 2.0;
        /// … or this many standard deviations of the spot, if that is more.
        const AT_PLACE_SIGMAS: f64 = 1.5;
        AT_PLACE_PX.max(AT_PLACE_SIGMAS * self.sigma_px())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    fn star(x: f64, y: f64, electrons: f64) -> TrueStar {
        TrueStar {
            number: (x * 1e3 + y) as usize,
            catalog: None,
            position: PixelPoint::new(x, y),
            v_mag: 5.0,
            electrons,
        }
    }

    #[test]
    fn light_is_owned_by_whom_more_than_half_of_it_is_due() {
        let scenario = Scenario::of(Preset::Experiment1);
        let truth = Truth {
            stars: vec![
                star(50.0, 50.0, 100.0),
                star(51.0, 50.0, 100.0),
                star(80.0, 20.0, 1e6),
                star(80.5, 20.0, 10.0),
            ],
            beyond: vec![star(-1.0, 30.0, 500.0)],
            ..Truth::default()
        };
        let light = LightMap::of(&scenario, &truth);
        let owner = |x, y| {
            light
                .owner(&PixelPoint::new(x, y))
                .map(|star| star.position)
        };
        assert_eq!(owner(50.5, 50.0), None);
        assert_eq!(owner(49.9, 50.0), Some(truth.stars[0].position));
        // A faint star in the light of a bright one contributes too little even at its own
        // position.
        assert_eq!(owner(80.5, 20.0), Some(truth.stars[2].position));
        assert_eq!(owner(0.0, 30.0), Some(truth.beyond[0].position));
        // Three pixels off, its light dominates, but it is too far away.
        assert_eq!(owner(83.0, 20.0), None);
        let place = PixelPoint::new(80.0, 21.0);
        assert_eq!(light.stars_near(&place, 1.05).count(), 1);
    }
}
