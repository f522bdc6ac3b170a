//! A field in which no place has more than a few stars: the brightest of each cell.
//!
//! Windows, foliage and reflections put many bright detections into few places. There they hide the
//! stars elsewhere from a search that begins with the brightest. Stars are everywhere.
//!
//! # Reference
//! Lang et al. 2010, AJ 139, 1782, section 2.1, for the same in astrometry.net.

use crate::identify::field::StarField;
use crate::identify::grid::FrameGrid;

/// Cells along the frame's longer side.
const CELLS: usize = 8;
/// Stars that each cell keeps, the brightest.
const STARS_PER_CELL: u8 = 2;
/// Number of the brightest stars that must change; else a search would find nothing else.
const LOOKED_AT: usize = 40;

/// Thins fields out. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Thinning {
    field: Option<StarField>,
    kept: Vec<u8>,
}

impl Thinning {
    /// `field` with the brightest stars of each cell only; `None` if that hardly changes it.
    pub fn thin(&mut self, field: &StarField) -> Option<&StarField> {
        let grid = FrameGrid::new(field, CELLS);
        self.kept.clear();
        self.kept.resize(grid.cells(), 0);
        let mut stars = self.field.take().map_or_else(Vec::new, |old| old.stars);
        stars.clear();
        stars.extend(field.stars.iter().filter(|star| {
            let kept = &mut self.kept[grid.cell_of(star.position.x, star.position.y)];
            *kept = kept.saturating_add(1);
            *kept <= STARS_PER_CELL
        }));
        let brightest = field.brightest(LOOKED_AT);
        let is_other = !stars.starts_with(brightest);
        let thinned = self.field.insert(field.with_stars(stars));
        is_other.then_some(thinned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(places: &[(f64, f64)]) -> StarField {
        StarField::of_places([800.0, 600.0], places)
    }

    #[test]
    fn a_crowded_place_keeps_its_brightest_stars() {
        let windows = (0..50).map(|i| (10.0 + f64::from(i), 590.0));
        let stars = (0..6).map(|i| (60.0 + 110.0 * f64::from(i), 120.0));
        let all: Vec<_> = windows.chain(stars).collect();
        let mut thinning = Thinning::default();
        let thinned = thinning.thin(&field(&all)).unwrap();
        let sources: Vec<usize> = thinned.stars.iter().map(|s| s.source.get()).collect();
        assert_eq!(sources, [0, 1, 50, 51, 52, 53, 54, 55]);
    }

    #[test]
    fn a_field_without_crowded_places_stays_as_it_is() {
        let stars: Vec<_> = (0..6)
            .map(|i| (60.0 + 110.0 * f64::from(i), 120.0))
            .collect();
        assert_eq!(Thinning::default().thin(&field(&stars)), None);
    }
}
