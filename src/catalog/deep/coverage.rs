//! How much of the sky has stars of a catalogue.

use crate::base::units::RAD_PER_DEG;
use crate::catalog::Star;
use crate::catalog::sky_cells::SkyCells;
use std::collections::HashSet;

/// The share of the sky where these stars are: of its cells those that hold one, where cells are so large that few of
/// those within would be empty.
pub fn share_of_sky(stars: &[Star]) -> f64 {
    const HEIGHTS_DEG: [f64; 7] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
    const STARS_PER_CELL: usize = 12;
    let share_at = |height_deg: f64| {
        let cells = SkyCells::new(height_deg * RAD_PER_DEG, 0.0);
        let held: HashSet<(usize, usize)> = stars
            .iter()
            .map(|star| cells.cell_of(&star.direction))
            .collect();
        let all: usize = (0..cells.zones).map(|zone| cells.zone(zone).cells).sum();
        let is_even = held.len() * STARS_PER_CELL <= stars.len();
        (held.len() as f64 / all as f64, is_even)
    };
    let mut shares = HEIGHTS_DEG.into_iter().map(share_at);
    shares
        .find(|(_, is_even)| *is_even)
        .map_or(1.0, |(share, _)| share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::catalog::StarId;
    use std::f64::consts::{PI, TAU};

    fn stars_within(radius_rad: f64, count: u32) -> Vec<Star> {
        let star = |number: u32| {
            let share = |factor: f64| (factor * f64::from(number)).fract();
            // Even on the cap around the pole.
            let z = 1.0 - share(0.754_877_666_2) * (1.0 - radius_rad.cos());
            let direction = UnitVector::from_ra_dec(TAU * share(0.618_033_988_7), z.asin());
            Star::new(StarId::Number(u64::from(number)), direction, 10.0)
        };
        (0..count).map(star).collect()
    }

    #[test]
    fn the_share_of_a_part_and_of_the_whole_sky_are_found() {
        for (radius_rad, count) in [
            (RAD_PER_DEG, 4000),
            (5.0 * RAD_PER_DEG, 20_000),
            (40.0 * RAD_PER_DEG, 30_000),
            (PI, 300_000),
        ] {
            let expected = (1.0 - radius_rad.cos()) / 2.0;
            let ratio = share_of_sky(&stars_within(radius_rad, count)) / expected;
            assert!((0.95..1.5).contains(&ratio), "{radius_rad}: {ratio}");
        }
    }
}
