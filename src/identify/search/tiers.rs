//! Fields without the brightest detections.
//!
//! Cosmic rays, hot pixels, satellites and reflections may outshine all stars. They hide them from a
//! search that begins with the brightest. A tier leaves a number of the brightest detections out.
//! That number grows from tier to tier by a factor, so that one of a few tiers begins soon after
//! most of them.

use super::false_alarm::TESTED_STARS;
use crate::identify::field::StarField;

/// Detections that the first tier leaves out.
const FIRST_LEFT_OUT: usize = 20;
/// Ratio of the numbers that a tier and the one before it leave out.
const RATIO: (usize, usize) = (3, 2);
/// Minimum number of stars in a tier.
const MIN_STARS: usize = 12;

/// Stars below a number of brighter detections.
#[derive(Debug, Clone)]
pub struct Tier {
    /// The stars, as many as a search looks at.
    pub field: StarField,
    /// Number of brighter detections that are left out.
    pub brighter: usize,
}

/// The tiers of a field. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Tiers(Vec<Tier>);

impl Tiers {
    /// At most so many tiers of `field`, from bright to faint.
    pub fn below(&mut self, field: &StarField, most: usize) -> &[Tier] {
        let left_out = std::iter::successors(Some(FIRST_LEFT_OUT), |left_out| {
            Some(left_out * RATIO.0 / RATIO.1)
        });
        let left_out = left_out
            .take(most)
            .take_while(|left_out| left_out + MIN_STARS <= field.stars.len());
        let mut count = 0;
        for brighter in left_out {
            let mut stars = match self.0.get_mut(count) {
                Some(tier) => std::mem::take(&mut tier.field.stars),
                None => Vec::with_capacity(TESTED_STARS),
            };
            stars.clear();
            stars.extend(field.stars[brighter..].iter().take(TESTED_STARS));
            let tier = Tier {
                field: field.with_stars(stars),
                brighter,
            };
            match self.0.get_mut(count) {
                Some(reused) => *reused = tier,
                None => self.0.push(tier),
            }
            count += 1;
        }
        &self.0[..count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(stars: usize) -> StarField {
        let places: Vec<_> = (0..stars).map(|index| (index as f64, 10.0)).collect();
        StarField::of_places([800.0, 600.0], &places)
    }

    #[test]
    fn each_tier_begins_below_the_brighter_ones_and_has_what_a_search_looks_at() {
        let field = field(100);
        let mut tiers = Tiers::default();
        let found: Vec<(usize, usize, usize)> = tiers
            .below(&field, 12)
            .iter()
            .map(|tier| {
                let stars = &tier.field.stars;
                (tier.brighter, stars[0].source.get(), stars.len())
            })
            .collect();
        let expected = [(20, 20, 60), (30, 30, 60), (45, 45, 55), (67, 67, 33)];
        assert_eq!(found, expected);
    }

    #[test]
    fn few_stars_have_no_tiers() {
        assert!(Tiers::default().below(&field(31), 12).is_empty());
        assert_eq!(Tiers::default().below(&field(100_000), 5).len(), 5);
    }
}
