//! Observed triangles, and what to look up for them.
//!
//! A size class of the index corresponds to a range of focal lengths. In wide fields the shape of a
//! triangle depends on the focal length (gnomonic projection), so the range is divided into steps
//! within which it does not change noticeably: each is a query.

use super::plan::SearchPass;
use crate::camera::frame_centre;
use crate::identify::field::{Photometry, StarField};
use crate::identify::index::{IndexedCatalog, Triangle, TriangleRange, TriangleShape, WantedShape};
use nalgebra::Vector3;

/// Centroid errors in a triangle's tolerance, in standard errors.
const CENTROID_SIGMAS: f64 = 2.0;
/// Smallest longest side of a triangle, in units of the frame's diagonal.
const MIN_TRIANGLE_FRACTION: f64 = 0.12;
/// Largest distance of a confirming star from its catalogue star: in distortion tolerances times
/// the frame's diagonal, and in centroid errors extrapolated from the triangle.
const CONFIRMING_TOLERANCES: f64 = 1.5;
const CONFIRMING_SIGMAS: f64 = 3.5;
/// Margin on the sizes of a triangle that decide which classes of the index can hold it.
const CLASS_SLACK: f64 = 1.01;
/// Most steps of a range of focal lengths.
const MAX_STEPS: f64 = 1000.0;
/// Triangles with a larger tolerance of their ratios resemble too many others.
const MAX_TOLERANCE: f64 = 0.03;

/// A triangle of observed stars.
#[derive(Debug, Clone, Copy)]
pub struct ObservedTriangle {
    /// The stars, by their number in the field.
    pub stars: [usize; 3],
    /// Their offsets from the frame's centre, in pixels.
    offsets: [[f64; 2]; 3],
    /// Its longest side, in pixels.
    longest_px: f64,
    /// Tolerance of its ratios.
    tolerance: f64,
    /// Largest distance of a confirming star from its catalogue star, in pixels.
    pub confirming_px: f64,
    /// Probability that another star confirms a true hypothesis, see [`SearchPass`].
    pub true_confirmation: f64,
}

impl ObservedTriangle {
    /// Its sides AB, BC and CA at a focal length in pixels, as chords.
    fn sides(&self, focal_px: f64) -> [f64; 3] {
        let [a, b, c] = self.offsets.map(|[x, y]| {
            let scale = 1.0 / (x * x + y * y + focal_px * focal_px).sqrt();
            [x * scale, y * scale, focal_px * scale]
        });
        let chord = |p: [f64; 3], q: [f64; 3]| {
            let [x, y, z] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
            (x * x + y * y + z * z).sqrt()
        };
        [chord(a, b), chord(b, c), chord(c, a)]
    }
}

/// A triangle with its corners in the order of its shape, and the focal lengths for which it has
/// that shape.
#[derive(Debug, Clone, Copy)]
pub struct Query {
    /// The triangle.
    pub triangle: ObservedTriangle,
    /// The size class of catalogue triangles.
    class: usize,
    /// Their shape.
    shape: WantedShape,
    /// Logarithm of the focal length, in pixels, times the longest side, as a chord.
    pub ln_size: f64,
    /// A focal length in the middle, in pixels.
    pub middle_px: f64,
    /// Logarithms of the smallest and the largest focal length, with their tolerance.
    ln_focal: [f64; 2],
}

impl Query {
    /// Logarithm of the focal length at which the longest side of this triangle is as long as that
    /// of a triangle of the catalogue, given the logarithm of the latter; `None` where the query is
    /// not for it.
    #[inline]
    pub fn ln_focal(&self, ln_longest: f64) -> Option<f64> {
        let ln_focal = self.ln_size - ln_longest;
        (self.ln_focal[0]..=self.ln_focal[1])
            .contains(&ln_focal)
            .then_some(ln_focal)
    }
}

/// The observed stars that form triangles.
#[derive(Clone, Copy)]
pub struct ObservedStars<'a> {
    /// The field.
    pub field: &'a StarField,
    /// The catalogue.
    pub sky: &'a IndexedCatalog<'a>,
    /// Smallest and largest focal length, in pixels.
    pub focal_px: [f64; 2],
    /// The frame's diagonal, in pixels.
    pub diagonal_px: f64,
}

impl ObservedStars<'_> {
    /// Offset of a star from the frame's centre, in pixels.
    #[inline]
    pub fn offset(&self, star: usize) -> [f64; 2] {
        let StarField {
            width_px,
            height_px,
            stars,
            ..
        } = self.field;
        let centre = frame_centre(*width_px, *height_px);
        let position = stars[star].position;
        [position.x - centre.x, position.y - centre.y]
    }

    /// The triangle of these stars; `None` if it is too small, too large or too inexact.
    pub fn triangle(&self, stars: [usize; 3], pass: &SearchPass) -> Option<ObservedTriangle> {
        let offsets @ [a, b, c] = stars.map(|star| self.offset(star));
        let side = |p: [f64; 2], q: [f64; 2]| libm::hypot(p[0] - q[0], p[1] - q[1]);
        let longest_px = side(a, b).max(side(b, c)).max(side(c, a));
        let shares = MIN_TRIANGLE_FRACTION..=pass.largest_side;
        if !shares.contains(&(longest_px / self.diagonal_px)) {
            return None;
        }
        let sigma_px = stars
            .iter()
            .map(|&s| self.field.stars[s].sigma_px)
            .fold(0.0, f64::max);
        let centroid_tolerance = CENTROID_SIGMAS * sigma_px / longest_px;
        let tolerance = libm::hypot(pass.tolerance, centroid_tolerance);
        if tolerance > MAX_TOLERANCE {
            return None;
        }
        let leverage = 1.0 + 0.5 * self.diagonal_px / longest_px;
        let distortion_px = CONFIRMING_TOLERANCES * pass.tolerance * self.diagonal_px;
        Some(ObservedTriangle {
            stars,
            offsets,
            longest_px,
            tolerance,
            true_confirmation: pass.true_confirmation,
            confirming_px: libm::hypot(distortion_px, CONFIRMING_SIGMAS * leverage * sigma_px),
        })
    }

    /// Adds what to look up for a triangle to `queries`.
    pub fn add_queries(&self, triangle: &ObservedTriangle, queries: &mut Vec<Query>) {
        // Its size at the longest and the shortest focal length.
        let (smallest, largest) = (
            self.longest_side(triangle, self.focal_px[1]) / CLASS_SLACK,
            self.longest_side(triangle, self.focal_px[0]) * CLASS_SLACK,
        );
        let mut high_px = None;
        for (number, class) in self.sky.triangles.classes.iter().enumerate() {
            if class.high >= smallest && class.low <= largest {
                // The classes have no gaps: the longest focal length of one is the shortest of the
                // class before.
                let longest_px = high_px.or_else(|| self.focal_of(triangle, class.low));
                high_px = self.focal_of(triangle, class.high);
                if let (Some(low_px), Some(longest_px)) = (high_px, longest_px) {
                    let low_px = low_px.max(self.focal_px[0]);
                    let longest_px = longest_px.min(self.focal_px[1]);
                    if low_px < longest_px {
                        self.add_steps(triangle, number, [low_px, longest_px], queries);
                    }
                }
            }
        }
    }

    /// Divides a range of focal lengths, so that half a step changes the shape by at most half the
    /// tolerance.
    fn add_steps(
        &self,
        triangle: &ObservedTriangle,
        class: usize,
        [low_px, high_px]: [f64; 2],
        queries: &mut Vec<Query>,
    ) {
        /// Steps are smaller by this factor: the shape changes a little unevenly.
        const UNEVENNESS: f64 = 1.25;
        let (ln_low, ln_range) = (libm::log(low_px), libm::log(high_px / low_px));
        let [low, middle, high] = [low_px, (low_px * high_px).sqrt(), high_px]
            .map(|focal_px| self.ratios(triangle, focal_px));
        let change = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]);
        let most = change(low, middle).max(change(middle, high));
        let steps = (2.0 * most * UNEVENNESS / triangle.tolerance).ceil();
        let steps = steps.clamp(1.0, MAX_STEPS);
        let slack = libm::log(1.0 + 2.0 * triangle.tolerance);
        for number in 0..steps as u32 {
            let [from, middle, to] =
                [0.0, 0.5, 1.0].map(|at| ln_low + ln_range * (f64::from(number) + at) / steps);
            let middle_px = libm::exp(middle);
            let [a, b, c] = &self.vectors(triangle, middle_px);
            if let Some(shape) = TriangleShape::new([a, b, c]) {
                queries.push(Query {
                    triangle: ObservedTriangle {
                        stars: shape.order.map(|corner| triangle.stars[corner]),
                        offsets: shape.order.map(|corner| triangle.offsets[corner]),
                        ..*triangle
                    },
                    class,
                    shape: WantedShape {
                        ratios: shape.ratios,
                        tolerance: triangle.tolerance,
                    },
                    ln_size: middle + libm::log(shape.longest),
                    middle_px,
                    ln_focal: [from - slack, to + slack],
                });
            }
        }
    }

    /// The triangle's middle and shortest side over the longest at this focal length.
    fn ratios(&self, triangle: &ObservedTriangle, focal_px: f64) -> [f64; 2] {
        let [a, b, c] = triangle.sides(focal_px);
        let (least, most) = (a.min(b), a.max(b));
        let (shortest, longest) = (least.min(c), most.max(c));
        let middle = most.min(least.max(c));
        [middle / longest, shortest / longest]
    }

    /// Unit vectors of the triangle's stars for this focal length, not mirrored.
    pub fn vectors(&self, triangle: &ObservedTriangle, focal_px: f64) -> [Vector3<f64>; 3] {
        let vector = |[u, v]: [f64; 2]| Vector3::new(u, v, focal_px).normalize();
        let [a, b, c] = triangle.offsets;
        [vector(a), vector(b), vector(c)]
    }

    /// The triangle's longest side at this focal length, as a chord.
    fn longest_side(&self, triangle: &ObservedTriangle, focal_px: f64) -> f64 {
        let [a, b, c] = triangle.sides(focal_px);
        a.max(b).max(c)
    }

    /// The focal length at which the triangle's longest side is `chord`.
    fn focal_of(&self, triangle: &ObservedTriangle, chord: f64) -> Option<f64> {
        let mut focal_px = triangle.longest_px / chord;
        for _ in 0..8 {
            let ratio = self.longest_side(triangle, focal_px) / chord;
            focal_px *= ratio;
            if (ratio - 1.0).abs() < 1e-3 {
                break;
            }
        }
        focal_px.is_finite().then_some(focal_px)
    }

    /// Looks up what catalogue triangles are like those of the queries, in shape, size and
    /// brightness. Returns the number of those that are like them in shape.
    ///
    /// What this waits for is memory. So each step is done for all queries, and the processor
    /// fetches for many of them at once.
    pub fn look_up(&self, queries: &[Query], found: &mut LookedUp) -> u64 {
        let LookedUp { places, similar } = found;
        places.clear();
        similar.clear();
        let classes = &self.sky.triangles.classes;
        for (query, number) in queries.iter().zip(0..) {
            let at = classes[query.class].places(&query.shape);
            places.extend(at.map(|place| (number, place)));
        }
        let triangles = |&(number, ref place): &(u32, TriangleRange)| {
            let query = &queries[number as usize];
            self.sky.triangles_at(query.class, place)
        };
        // A place is one cache line, or two.
        let size = |triangle: Option<&Triangle>| triangle.map_or(0, |t| u32::from(t.size));
        let fetched = places.iter().map(&triangles).fold(0, |sum, triangles| {
            sum + size(triangles.first()) + size(triangles.last())
        });
        std::hint::black_box(fetched);
        let mut candidates = 0;
        for place in places.iter() {
            candidates += self.add_similar(
                &queries[place.0 as usize],
                place.0,
                triangles(place),
                similar,
            );
        }
        candidates
    }

    /// Adds those of `triangles` that are like that of a query to `similar`. Returns the number of
    /// those that are like it in shape.
    fn add_similar(
        &self,
        query: &Query,
        number: u32,
        triangles: &[Triangle],
        similar: &mut Vec<Similar>,
    ) -> u64 {
        let class = &self.sky.triangles.classes[query.class];
        let has_shape = query.shape.test();
        let [a, b, c] = query.triangle.stars;
        let mag = |star: usize| self.field.stars[star].mag as f32 - class.fainter_mag;
        let mags = [mag(a), mag(b), mag(c)];
        let mut candidates = 0;
        for triangle in triangles.iter().filter(|triangle| has_shape(triangle)) {
            candidates += 1;
            let Some(ln_focal) = query.ln_focal(class.ln_longest(triangle.size)) else {
                continue;
            };
            if let Some(zero_point_mag) = self.zero_point(triangle, mags) {
                similar.push(Similar {
                    query: number,
                    corners: triangle.corners(),
                    zero_point_mag,
                    ln_focal: ln_focal as f32,
                });
            }
        }
        candidates
    }

    /// The median zero point of the triangle's stars, if all three agree.
    #[inline]
    fn zero_point(&self, triangle: &Triangle, mags: [f32; 3]) -> Option<f32> {
        let v_mags = triangle.v_mags();
        let [a, b, c] = [
            v_mags[0] - mags[0],
            v_mags[1] - mags[1],
            v_mags[2] - mags[2],
        ];
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let spread = self.field.photometry.tolerance_mag() as f32;
        let (consistent, zero_point) = match self.field.photometry {
            Photometry::Instrumental => (high - low <= spread, a + b + c - low - high),
            Photometry::JohnsonV => (low >= -spread && high <= spread, 0.0),
        };
        consistent.then_some(zero_point)
    }
}

/// What was looked up. Its buffers are reused.
#[derive(Debug, Default)]
pub struct LookedUp {
    /// Where triangles of the right shape are, each with the number of its query.
    places: Vec<(u32, TriangleRange)>,
    /// The catalogue triangles that are like an observed one, in the order of the queries.
    pub similar: Vec<Similar>,
}

/// A catalogue triangle that is like an observed one.
#[derive(Debug, Clone, Copy)]
pub struct Similar {
    /// The query that it answers, by its number.
    pub query: u32,
    /// Its stars.
    pub corners: [u32; 3],
    /// Johnson V minus observed magnitude.
    pub zero_point_mag: f32,
    /// Logarithm of the focal length, in pixels, at which both are of the same size.
    pub ln_focal: f32,
}
