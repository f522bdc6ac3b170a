//! The catalogue stars of a field that are tracked: bright enough, and alone.

use crate::base::coords::{Icrs, UnitVector};
use crate::catalog::StarIndex;
use crate::ephemeris::places::StarPlaces;
use crate::identify::IndexedCatalog;

/// Margin around a field, in units of its radius, within which stars are gathered, so that the next
/// fields have theirs, too.
const GATHERED_MARGIN: f64 = 0.25;
/// Stars up to this much fainter than a star may be mistaken for it, or touch it, in magnitudes.
const ALIKE_MAG: f64 = 2.5;
/// Fainter stars move the centroid of their neighbor: by at most this, in widths of the spot. The
/// best centroids have an error of about as much.
const MAX_SHIFT_WIDTHS: f64 = 0.02;
/// Stars this much fainter cannot.
const FAINTEST_NEIGHBOR_MAG: f64 = 4.5;

/// A catalogue star that can be tracked.
#[derive(Debug, Clone, Copy)]
pub(super) struct GuideStar {
    /// Apparent direction.
    pub direction: UnitVector<Icrs>,
    /// V magnitude.
    pub v_mag: f64,
    /// The star.
    pub star: StarIndex,
}

/// Which stars are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    /// V magnitudes from the brightest to the faintest.
    pub v_mag: [f64; 2],
    /// Standard deviation of a spot, in radians.
    pub width_rad: f64,
    /// Radius around a star in which there is no other like it, in radians.
    pub clear_rad: f64,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
}

/// The stars around the present field. They are looked up anew where the field has left them.
#[derive(Debug, Default)]
pub(super) struct Guides {
    /// Brightest first.
    stars: Vec<GuideStar>,
    gathered: Option<GuideRegion>,
    nearby: Vec<(StarIndex, f64)>,
}

#[derive(Debug, Clone, Copy)]
struct GuideRegion {
    centre: UnitVector<Icrs>,
    radius_rad: f64,
    wanted: Wanted,
}

impl GuideRegion {
    fn covers(&self, centre: &UnitVector<Icrs>, radius_rad: f64, wanted: &Wanted) -> bool {
        // The magnitudes follow the transparency: small changes need no other stars.
        const NEARLY_MAG: f64 = 0.3;
        let is_alike = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance;
        let (a, b) = (&self.wanted, wanted);
        self.centre.angle_to(centre) + radius_rad <= self.radius_rad
            && is_alike(a.v_mag[0], b.v_mag[0], NEARLY_MAG)
            && is_alike(a.v_mag[1], b.v_mag[1], NEARLY_MAG)
            && is_alike(a.width_rad, b.width_rad, 0.2 * a.width_rad)
            && is_alike(a.clear_rad, b.clear_rad, 0.2 * a.clear_rad)
            && a.places == b.places
    }
}

impl Guides {
    /// The stars within `radius_rad` of `centre`, and some around them, brightest first.
    pub fn around(
        &mut self,
        sky: &IndexedCatalog,
        centre: &UnitVector<Icrs>,
        radius_rad: f64,
        wanted: &Wanted,
    ) -> &[GuideStar] {
        let is_there = |gathered: &GuideRegion| gathered.covers(centre, radius_rad, wanted);
        if !self.gathered.as_ref().is_some_and(is_there) {
            self.gather(sky, centre, radius_rad * (1.0 + GATHERED_MARGIN), wanted);
        }
        &self.stars
    }

    fn gather(
        &mut self,
        sky: &IndexedCatalog,
        centre: &UnitVector<Icrs>,
        radius_rad: f64,
        wanted: &Wanted,
    ) {
        let Self { stars, nearby, .. } = self;
        nearby.clear();
        sky.grid
            .for_each_within(centre, radius_rad, wanted.v_mag[1] as f32, |star| {
                let v_mag = f64::from(star.v_mag);
                if v_mag >= wanted.v_mag[0] {
                    nearby.push((star.index, v_mag));
                }
            });
        nearby.sort_unstable_by_key(|(index, _)| *index);
        stars.clear();
        for &(index, v_mag) in nearby.iter() {
            let direction = wanted.places.of(&sky.stars()[index.get()]);
            let star = GuideStar {
                direction,
                v_mag,
                star: index,
            };
            if is_alone(sky, index, &star, wanted) {
                stars.push(star);
            }
        }
        self.gathered = Some(GuideRegion {
            centre: *centre,
            radius_rad,
            wanted: *wanted,
        });
    }
}

/// Whether no neighbor can be taken for a star, or moves its centroid. The centroid of a fit is
/// moved by `q d exp(−d²/4w²)`, for a neighbor at the distance d with the fraction q of the light
/// and spots of the standard deviation w.
fn is_alone(sky: &IndexedCatalog, index: StarIndex, star: &GuideStar, wanted: &Wanted) -> bool {
    let faintest = star.v_mag + FAINTEST_NEIGHBOR_MAG;
    let mut is_alone = true;
    let mut shift_widths = 0.0;
    let (centre, reach_rad) = (&star.direction, wanted.clear_rad);
    sky.grid
        .for_each_within(centre, reach_rad, faintest as f32, |other| {
            if other.index == index {
                return;
            }
            let fainter_mag = f64::from(other.v_mag) - star.v_mag;
            is_alone &= fainter_mag > ALIKE_MAG;
            let apart_rad = (other.vector() - centre.as_vector()).norm();
            let widths = apart_rad / wanted.width_rad;
            let share = libm::pow(10f64, -0.4 * fainter_mag);
            shift_widths += share * widths * libm::exp(-0.25 * widths * widths);
        });
    is_alone && shift_widths <= MAX_SHIFT_WIDTHS
}
