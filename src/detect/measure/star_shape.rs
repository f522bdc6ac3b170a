//! The shape of a frame's stars: round, or elongated alike where the camera moved or the lens is
//! astigmatic. What is elongated is a trail only beyond that shape.

use super::core::Core;
use crate::base::statistics::median;
use crate::detect::candidates::{Peak, Region};
use crate::detect::fit::FrameMaps;
use arrayvec::ArrayVec;

/// Peaks below this signal-to-noise ratio have no shape.
const MIN_SNR: f32 = 15.0;
/// Cores of fewer pixels have no shape.
const MIN_AREA_PX: f64 = 9.0;
/// At most this many peaks are taken.
const MAX_STARS: usize = 40;
/// Fewer stars than this do not tell the shape of all.
const MIN_STARS: usize = 5;
/// Stars are elongated from this ellipticity on: axes in a ratio of 1.7. Below, none of them comes
/// near what counts as a trail, and a round spot fits them well enough.
const MIN_ELLIPTICITY: f64 = 0.5;
/// Most stars must have the shape of all to within this.
const MAX_DEVIATION: f64 = 0.25;

/// The shape that most bright stars of a frame have.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct StarShape {
    /// The elongation, where there is one.
    elongation: Option<Elongation>,
}

/// The elongation of stars.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Elongation {
    /// `(xx − yy, 2xy)/(xx + yy)` of the second moments.
    ellipticity: [f64; 2],
    /// Area above half of the height, in pixels.
    area_px: f64,
}

impl StarShape {
    /// The shape of bright ones of the peaks, which come brightest first.
    pub fn measure(maps: &FrameMaps<'_>, peaks: &[Peak]) -> Self {
        let bright = bright_peaks(maps, peaks);
        let cores: ArrayVec<Core, MAX_STARS> = bright
            .iter()
            .filter_map(|peak| Core::at(maps, peak))
            .filter(|core| core.area_px >= MIN_AREA_PX)
            .collect();
        let shapes = cores.iter().map(|c| ellipticity_of(c.covariance));
        let shapes: ArrayVec<[f64; 2], MAX_STARS> = shapes.collect();
        if shapes.len() < MIN_STARS {
            return Self::default();
        }
        let median_of = |value: &dyn Fn(usize) -> f64| {
            let mut values: ArrayVec<f64, MAX_STARS> = (0..cores.len()).map(value).collect();
            median(&mut values)
        };
        let ellipticity = [0, 1].map(|i| median_of(&|star| shapes[star][i]));
        let is_alike = |s: &&[f64; 2]| {
            libm::hypot(s[0] - ellipticity[0], s[1] - ellipticity[1]) < MAX_DEVIATION
        };
        let alike = shapes.iter().filter(is_alike).count();
        let are_elongated = libm::hypot(ellipticity[0], ellipticity[1]) > MIN_ELLIPTICITY;
        let elongation = Elongation {
            ellipticity,
            area_px: median_of(&|star| cores[star].area_px),
        };
        Self {
            // Sharp stars, too small to have a shape, are not elongated.
            elongation: (are_elongated && 2 * alike > bright.len()).then_some(elongation),
        }
    }

    /// Whether the stars are so long that a round spot has no certain place along them.
    pub fn is_long(&self) -> bool {
        /// Axes in a ratio of 2.4.
        const LONG_ELLIPTICITY: f64 = 0.7;
        let is_long =
            |e: Elongation| libm::hypot(e.ellipticity[0], e.ellipticity[1]) > LONG_ELLIPTICITY;
        self.elongation.is_some_and(is_long)
    }

    /// Whether the stars are elongated.
    pub fn is_elongated(&self) -> bool {
        self.elongation.is_some()
    }

    /// Standard deviations along the longer and the shorter axis of a source with these variances
    /// along x and y, and this covariance, in a frame stretched so that its stars are round.
    pub fn axes_px(&self, [xx, yy, xy]: [f64; 3]) -> [f64; 2] {
        let [e1, e2] = self.elongation.map_or([0.0; 2], |e| e.ellipticity);
        // The eigenvalues of S⁻¹C, with the shape S of the stars, of determinant 1.
        let norm = (1.0 - e1 * e1 - e2 * e2).max(f64::MIN_POSITIVE).sqrt();
        let half_trace = 0.5 * ((1.0 - e1) * xx + (1.0 + e1) * yy - 2.0 * e2 * xy) / norm;
        let determinant = xx * yy - xy * xy;
        let half_range = (half_trace * half_trace - determinant).max(0.0).sqrt();
        let minor = determinant.max(0.0) / (half_trace + half_range);
        [(half_trace + half_range).sqrt(), minor.sqrt()]
    }

    /// Whether the core of a source is too large for a star of this frame by `factor` in each
    /// direction; `None` where stars are round, and other tests tell.
    pub fn is_wider(&self, maps: &FrameMaps<'_>, peak: &Peak, factor: f64) -> Option<bool> {
        let stars = self.elongation?;
        let core = Core::at(maps, peak)?;
        Some(core.area_px > factor * factor * stars.area_px)
    }

    /// Drops all but the brightest of the peaks that noise makes along an elongated star: those
    /// closer to a brighter one of the same region than the full width at half maximum, in the
    /// direction between them.
    pub fn merge_peaks(&self, peaks: &mut Vec<Peak>, regions: &mut [Region]) {
        let Some(stars) = self.elongation else {
            return;
        };
        let [e1, e2] = stars.ellipticity;
        let norm = (1.0 - e1 * e1 - e2 * e2).max(f64::MIN_POSITIVE).sqrt();
        // Of a disc of that area.
        let width2 = 4.0 * stars.area_px / std::f64::consts::PI;
        let is_same = |a: &Peak, b: &Peak| {
            let (x, y) = (a.x as f64 - b.x as f64, a.y as f64 - b.y as f64);
            let distance2 = ((1.0 - e1) * x * x + (1.0 + e1) * y * y - 2.0 * e2 * x * y) / norm;
            a.region == b.region && distance2 < width2
        };
        let mut kept: Vec<Peak> = Vec::with_capacity(peaks.len());
        for peak in peaks.iter() {
            if kept.iter().any(|brighter| is_same(brighter, peak)) {
                regions[peak.region].peaks -= 1;
            } else {
                kept.push(*peak);
            }
        }
        *peaks = kept;
    }
}

/// Peaks of whatever brightness that may be stars: few of each region, as the trails of satellites
/// that cross are one region of many peaks.
fn bright_peaks<'a>(maps: &FrameMaps<'_>, peaks: &'a [Peak]) -> ArrayVec<&'a Peak, MAX_STARS> {
    /// Most peaks of one region.
    const MAX_OF_REGION: usize = 2;
    /// More peaks tell no more.
    const ENOUGH: usize = 10 * MAX_STARS;
    let is_of_light = |peak: &Peak| !maps.contrast_at(peak).is_sharper_than_any_spot();
    let bright = peaks.iter().take_while(|peak| peak.snr >= MIN_SNR);
    let mut stars: ArrayVec<&Peak, ENOUGH> = ArrayVec::new();
    // Bloomed stars are elongated by their charge: they do not count.
    for peak in bright.filter(|peak| !peak.saturated) {
        if stars.is_full() {
            break;
        }
        let of_region = stars.iter().filter(|star| star.region == peak.region);
        if of_region.count() < MAX_OF_REGION && is_of_light(peak) {
            stars.push(peak);
        }
    }
    let step = stars.len().div_ceil(MAX_STARS).max(1);
    stars.into_iter().step_by(step).collect()
}

/// `(xx − yy, 2xy)/(xx + yy)` of second moments: cosine and sine of twice the angle of the longer axis,
/// times the ellipticity.
pub(crate) fn ellipticity_of([xx, yy, xy]: [f64; 3]) -> [f64; 2] {
    let sum = xx + yy;
    [(xx - yy) / sum, 2.0 * xy / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_of_the_stars_shape_is_round_among_them_and_one_across_is_not() {
        // Axes 3 and 1, along the diagonal.
        let along = [5.0, 5.0, 4.0];
        let shape = StarShape {
            elongation: Some(Elongation {
                ellipticity: ellipticity_of(along),
                area_px: 20.0,
            }),
        };
        let [major, minor] = shape.axes_px(along);
        assert!((major / minor - 1.0).abs() < 1e-6, "{major} {minor}");
        let [major, minor] = shape.axes_px([5.0, 5.0, -4.0]);
        assert!((major / minor - 9.0).abs() < 1e-6, "{major} {minor}");
        let [major, minor] = StarShape::default().axes_px(along);
        assert!((major - 3.0).abs() < 1e-9 && (minor - 1.0).abs() < 1e-9);
    }
}
