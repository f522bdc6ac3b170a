//! Double images: every star occurs twice, as the camera moved between two exposures or during one.

use super::cause::DoubleImage;
use crate::identify::{ObservedStar, StarField};

/// Number of stars examined, the brightest.
const LOOKED_AT: usize = 80;
/// Tolerance of an offset on each axis, in pixels.
const TOLERANCE_PX: f64 = 1.5;
/// Smallest offset, in pixels: close pairs and split stars have smaller ones.
const MIN_OFFSET_PX: f64 = 4.0;
/// Tolerance of the magnitude difference: both exposures show the stars in the same order.
const TOLERANCE_MAG: f64 = 0.7;
/// Fewest pairs with the offset, …
const MIN_PAIRS: usize = 6;
/// … as a fraction of the stars. If all stars occur twice it is a half.
const MIN_FRACTION: f64 = 0.25;
/// Largest number of pairs with another offset, over that with the best one: regular patterns have
/// many offsets.
const SECOND_FRACTION: f64 = 0.6;

/// The offset from one star to another.
#[derive(Debug, Clone, Copy)]
struct Offset {
    along: [f64; 2],
    mag: f64,
    from: usize,
    to: usize,
}

impl Offset {
    fn is_like(&self, other: &Self) -> bool {
        self.is_near(other, TOLERANCE_PX) && (self.mag - other.mag).abs() < TOLERANCE_MAG
    }

    fn is_near(&self, other: &Self, tolerance_px: f64) -> bool {
        (self.along[0] - other.along[0]).abs() < tolerance_px
            && (self.along[1] - other.along[1]).abs() < tolerance_px
    }
}

/// Whether many stars of a field in which most are named have a companion at the same offset. One star
/// of a pair has no name, so that no pairs need be formed where nearly all have one.
pub fn find_unnamed(
    field: &StarField,
    is_named: impl Fn(&ObservedStar) -> bool,
) -> Option<DoubleImage> {
    let stars = field.brightest(LOOKED_AT);
    let unnamed = stars.iter().filter(|star| !is_named(star)).count();
    let is_possible = unnamed >= MIN_PAIRS && unnamed as f64 >= MIN_FRACTION * stars.len() as f64;
    is_possible.then(|| find(field)).flatten()
}

/// Whether many stars have a companion at the same offset.
pub(super) fn find(field: &StarField) -> Option<DoubleImage> {
    let offsets = offsets(field);
    let counts: Vec<usize> = (0..offsets.len())
        .map(|i| pairs(&offsets, i).len())
        .collect();
    let most = (0..offsets.len()).max_by_key(|&i| counts[i])?;
    let count = counts[most];
    let stars = field.stars.len().min(LOOKED_AT);
    if count < MIN_PAIRS || (count as f64) < MIN_FRACTION * stars as f64 {
        return None;
    }
    let second = (0..offsets.len())
        .filter(|&i| !offsets[i].is_near(&offsets[most], 3.0 * TOLERANCE_PX))
        .map(|i| counts[i])
        .max();
    if second.is_some_and(|second| second as f64 > SECOND_FRACTION * count as f64) {
        return None;
    }
    let agreeing = pairs(&offsets, most);
    let mean = |axis: usize| {
        let sum: f64 = agreeing.iter().map(|offset| offset.along[axis]).sum();
        sum / agreeing.len() as f64
    };
    Some(DoubleImage {
        pairs: count,
        offset_px: [mean(0), mean(1)],
    })
}

/// The offsets of all pairs, each pointing right or straight down, sorted along x.
fn offsets(field: &StarField) -> Vec<Offset> {
    let stars = field.brightest(LOOKED_AT);
    let mut offsets = Vec::new();
    for (i, a) in stars.iter().enumerate() {
        for (j, b) in stars.iter().enumerate().skip(i + 1) {
            let [dx, dy] = [b.position.x - a.position.x, b.position.y - a.position.y];
            if libm::hypot(dx, dy) < MIN_OFFSET_PX {
                continue;
            }
            // Nearly vertical offsets must all point the same way.
            let forward = if dx.abs() < TOLERANCE_PX {
                dy > 0.0
            } else {
                dx > 0.0
            };
            let sign = if forward { 1.0 } else { -1.0 };
            offsets.push(Offset {
                along: [sign * dx, sign * dy],
                mag: sign * (b.mag - a.mag),
                from: if forward { i } else { j },
                to: if forward { j } else { i },
            });
        }
    }
    offsets.sort_by(|a, b| a.along[0].total_cmp(&b.along[0]));
    offsets
}

/// The pairs with the same offset as the one at `index`, each star once at each end.
fn pairs(offsets: &[Offset], index: usize) -> Vec<Offset> {
    let this = &offsets[index];
    let start = offsets.partition_point(|o| o.along[0] <= this.along[0] - TOLERANCE_PX);
    let mut taken = ([false; LOOKED_AT], [false; LOOKED_AT]);
    offsets[start..]
        .iter()
        .take_while(|o| o.along[0] < this.along[0] + TOLERANCE_PX)
        .filter(|o| o.is_like(this))
        .filter(|o| {
            let free = !taken.0[o.from] && !taken.1[o.to];
            (taken.0[o.from], taken.1[o.to]) = (true, true);
            free
        })
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::PixelPoint;
    use crate::ephemeris::places::StarPlaces;
    use crate::identify::{ObservedStar, Photometry, SourceIndex};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn field(positions: Vec<[f64; 3]>) -> StarField {
        let star = |[x, y, mag]: [f64; 3]| ObservedStar {
            source: SourceIndex::new(0),
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag,
            is_saturated: false,
        };
        let mut stars: Vec<ObservedStar> = positions.into_iter().map(star).collect();
        stars.sort_by(|a, b| a.mag.total_cmp(&b.mag));
        StarField {
            width_px: 500.0,
            height_px: 500.0,
            photometry: Photometry::Instrumental,
            places: StarPlaces::default(),
            spot_sigma_px: None,
            sky_area: None,
            stars,
        }
    }

    fn strewn(random: &mut ChaCha8Rng, count: usize) -> Vec<[f64; 3]> {
        (0..count)
            .map(|_| {
                let mut place = || random.random_range(0.0..500.0);
                [place(), place(), random.random_range(-10.0..-5.0)]
            })
            .collect()
    }

    #[test]
    fn the_offset_of_a_double_exposure_is_found() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for offset in [[17.3, -9.1], [0.4, 25.0], [60.0, 0.0]] {
            let once = strewn(&mut random, 30);
            let again = once.iter().map(|[x, y, mag]| {
                let jitter = random.random_range(-0.3..0.3);
                [x + offset[0] + jitter, y + offset[1] - jitter, mag + 0.4]
            });
            let again: Vec<_> = again.collect();
            let found = find(&field(once.into_iter().chain(again).collect()));
            let Some(DoubleImage { pairs, offset_px }) = found else {
                panic!("{offset:?}: {found:?}");
            };
            assert!(pairs >= 25, "{pairs}");
            let off = (offset_px[0] - offset[0]).hypot(offset_px[1] - offset[1]);
            assert!(off < 0.3, "{offset_px:?}");
        }
    }

    #[test]
    fn strewn_stars_and_regular_patterns_are_no_double_exposures() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..300 {
            let count = random.random_range(4..200);
            assert_eq!(find(&field(strewn(&mut random, count))), None);
        }
        let grid = (0..100).map(|i| [f64::from(i % 10) * 48.0, f64::from(i / 10) * 48.0, -8.0]);
        assert_eq!(find(&field(grid.collect())), None);
    }
}
