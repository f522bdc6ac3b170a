//! The shape of a triangle of stars, in numbers that do not depend on the attitude.
//!
//! The sides are chords between unit vectors, on the sky as in the camera. They need no
//! trigonometry and are exact in fields of any width.

use nalgebra::Vector3;

/// A triangle's size, and its shape as two ratios that rotation, reflection and (in narrow fields)
/// scale do not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleShape {
    /// Longest side, as a chord of the unit sphere.
    pub longest: f64,
    /// Middle and shortest side over the longest.
    pub ratios: [f64; 2],
    /// Indices of the points A, B and C: AB is the longest side, AC the shortest.
    pub order: [usize; 3],
}

/// Least difference between the middle side and either other side, over the longest: below it noise
/// decides which point is which.
pub const MIN_RATIO_GAP: f64 = 0.01;
/// Least excess of the middle and the shortest side together over the longest, over the longest:
/// flatter triangles have no reliable parity.
pub const MIN_FLATNESS: f64 = 0.02;
/// Least shortest side over the longest: the direction of a shorter one, and so the roll, is poorly
/// determined.
pub const MIN_SHORTEST_RATIO: f64 = 0.08;

impl TriangleShape {
    /// The shape of the triangle of three unit vectors; `None` if noise could confuse its corners.
    #[inline]
    pub fn new(points: [&Vector3<f64>; 3]) -> Option<Self> {
        let side = |a: usize, b: usize| (points[a] - points[b]).norm_squared();
        Self::of_sides([side(1, 2), side(2, 0), side(0, 1)])
    }

    /// The shape of the triangle with these squared sides, each opposite to the point of its index.
    #[inline]
    pub fn of_sides(opposite: [f64; 3]) -> Option<Self> {
        // C faces the longest side, B the shortest.
        let c = index_of_largest(opposite);
        let (p, q) = ((c + 1) % 3, (c + 2) % 3);
        let (a, b) = if opposite[p] > opposite[q] {
            (p, q)
        } else {
            (q, p)
        };
        let longest = opposite[c].sqrt();
        let middle = opposite[a].sqrt() / longest;
        let shortest = opposite[b].sqrt() / longest;
        let usable = shortest >= MIN_SHORTEST_RATIO
            && middle - shortest >= MIN_RATIO_GAP
            && 1.0 - middle >= MIN_RATIO_GAP
            && middle + shortest - 1.0 >= MIN_FLATNESS;
        usable.then_some(Self {
            longest,
            ratios: [middle, shortest],
            order: [a, b, c],
        })
    }
}

fn index_of_largest(values: [f64; 3]) -> usize {
    if values[0] >= values[1] && values[0] >= values[2] {
        0
    } else if values[1] >= values[2] {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    fn directions(points: [(f64, f64); 3]) -> [Vector3<f64>; 3] {
        points.map(|(x, y)| Vector3::new(x, y, 1.0).normalize())
    }

    fn shape(points: &[Vector3<f64>; 3]) -> Option<TriangleShape> {
        TriangleShape::new([&points[0], &points[1], &points[2]])
    }

    #[test]
    fn the_longest_side_joins_a_and_b_and_the_shortest_a_and_c() {
        let points = directions([(0.0, 0.03), (0.0, 0.0), (0.04, 0.0)]);
        let shape = shape(&points).unwrap();
        assert_eq!(shape.order, [0, 2, 1]);
        assert!((shape.longest - 0.05).abs() < 1e-4);
        assert!((shape.ratios[0] - 0.8).abs() < 1e-3);
        assert!((shape.ratios[1] - 0.6).abs() < 1e-3);
    }

    #[test]
    fn flat_isosceles_and_tiny_sided_triangles_are_refused() {
        for points in [
            [(0.0, 0.0), (0.1, 0.0), (0.04, 0.001)],
            [(0.0, 0.0), (0.1, 0.0), (0.05, 0.05)],
            [(0.0, 0.0), (0.1, 0.0), (0.0, 0.005)],
            [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0)],
        ] {
            assert_eq!(shape(&directions(points)), None, "{points:?}");
        }
    }

    proptest! {
        #[test]
        fn turning_mirroring_and_reordering_keep_the_shape(
            coordinates in prop::array::uniform6(-0.3..0.3f64),
            axis in prop::array::uniform3(-1.0..1.0f64),
            rotate in 0usize..3,
        ) {
            let [a, b, c, d, e, f] = coordinates;
            let points = directions([(a, b), (c, d), (e, f)]);
            let turn = Rotation3::new(Vector3::from(axis) * 3.0);
            let mut turned = points.map(|p| turn * Vector3::new(-p.x, p.y, p.z));
            turned.rotate_left(rotate);
            match (shape(&points), shape(&turned)) {
                (Some(before), Some(after)) => {
                    prop_assert!((before.longest - after.longest).abs() < 1e-12);
                    for (x, y) in before.ratios.iter().zip(after.ratios) {
                        prop_assert!((x - y).abs() < 1e-9);
                    }
                    for (i, j) in before.order.iter().zip(after.order) {
                        prop_assert_eq!(*i, (j + rotate) % 3);
                    }
                }
                (None, None) => {}
                // A ratio at a limit, within rounding.
                (one, other) => {
                    let shape = one.or(other).unwrap();
                    let [middle, shortest] = shape.ratios;
                    let margin = (shortest - MIN_SHORTEST_RATIO)
                        .min(middle - shortest - MIN_RATIO_GAP)
                        .min(1.0 - middle - MIN_RATIO_GAP)
                        .min(middle + shortest - 1.0 - MIN_FLATNESS);
                    prop_assert!(margin < 1e-9);
                }
            }
        }
    }
}
