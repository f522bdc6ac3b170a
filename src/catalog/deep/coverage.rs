//! How much of the sky do some positions cover?

use super::healpix::HealpixCell;
use crate::base::coords::{Icrs, UnitVector};

/// The finest cells that are counted, 3.4 arcminutes wide.
const ORDER: u32 = 10;

/// Positions, by the cells that they lie in.
#[derive(Default)]
pub struct Coverage {
    cells: Vec<HealpixCell>,
}

impl Coverage {
    /// Adds the position of a star.
    pub fn add(&mut self, direction: &UnitVector<Icrs>) {
        self.cells.push(HealpixCell::of(direction, 1 << ORDER));
    }

    /// The share of the sky of the finest cells of which those with positions have enough of them that few are empty
    /// by chance; `None` without stars.
    pub fn share_of_sky(self) -> Option<f64> {
        const ENOUGH: usize = 8;
        let (count, mut cells) = (self.cells.len(), self.cells);
        for order in (0..=ORDER).rev() {
            cells.sort_unstable();
            cells.dedup();
            if order == 0 || cells.len() * ENOUGH <= count {
                let all = 12.0 * libm::exp2(2.0 * f64::from(order));
                return (count > 0).then_some(cells.len() as f64 / all);
            }
            cells = cells.into_iter().map(HealpixCell::parent).collect();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    fn share(radius_deg: f64, count: u32) -> f64 {
        let mut coverage = Coverage::default();
        for number in 0..count {
            let from = radius_deg * (f64::from(number) / f64::from(count)).sqrt();
            let (sin, cos) = libm::sincos(f64::from(number) * 2.4);
            let [ra_rad, dec_rad] = [40.0 + from * sin, from * cos].map(|deg| deg * RAD_PER_DEG);
            coverage.add(&UnitVector::from_ra_dec(ra_rad, dec_rad));
        }
        coverage.share_of_sky().unwrap()
    }

    #[test]
    fn a_small_field_is_a_small_share() {
        let expected = std::f64::consts::PI / 41_252.96;
        let found = share(1.0, 20_000);
        assert!(
            (expected..1.5 * expected).contains(&found),
            "{found} {expected}"
        );
        assert!(share(1.0, 100) < 5.0 * expected);
        assert_eq!(Coverage::default().share_of_sky(), None);
    }
}
