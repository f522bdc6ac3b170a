//! Neighbour search among points on a frame, with a k-d tree.

use super::coords::PixelPoint;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// A k-d tree of points on a frame.
pub(crate) struct PointTree(ImmutableKdTree<f64, 2>);

/// A point near the centre of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbor {
    /// Its index among the points of the tree.
    pub index: usize,
    /// Its distance from the centre, in pixels.
    pub distance_px: f64,
}

impl PointTree {
    /// Builds the tree of `points`.
    pub fn new(points: impl IntoIterator<Item = PixelPoint>) -> Self {
        let points: Vec<_> = points.into_iter().map(|p| [p.x, p.y]).collect();
        let tree = ImmutableKdTree::new_from_slice(&points);
        Self(tree.expect("no frame has 2^32 points"))
    }

    /// Calls `visit` for every point within `radius_px` of `center`, in no particular order.
    pub fn for_each_within(
        &self,
        center: &PixelPoint,
        radius_px: f64,
        mut visit: impl FnMut(Neighbor),
    ) {
        self.0
            .query(&[center.x, center.y])
            .within::<SquaredEuclidean<f64>>(radius_px * radius_px)
            .unsorted()
            .visit(|found| {
                visit(Neighbor {
                    index: found.item as usize,
                    distance_px: found.distance.sqrt(),
                });
            });
    }

    /// The points within `radius_px` of `center`, by distance, then by index.
    pub fn within(&self, center: &PixelPoint, radius_px: f64) -> Vec<Neighbor> {
        let mut near = Vec::new();
        self.for_each_within(center, radius_px, |neighbor| near.push(neighbor));
        near.sort_unstable_by(|a, b| {
            let order = a.distance_px.total_cmp(&b.distance_px);
            order.then(a.index.cmp(&b.index))
        });
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn all_points_within_a_radius_are_found_nearest_first(
            // Whole numbers, so that points coincide and distances are equal.
            places in prop::collection::vec((0..20_i32, 0..20_i32), 0..200),
            x in 0..20_i32, y in 0..20_i32, radius in 0..15_i32,
        ) {
            let point = |(x, y)| PixelPoint::new(f64::from(x), f64::from(y));
            let points: Vec<_> = places.into_iter().map(point).collect();
            let (center, radius_px) = (point((x, y)), f64::from(radius));
            let mut expected: Vec<_> = points
                .iter()
                .enumerate()
                .map(|(index, p)| Neighbor { index, distance_px: p.distance_to(&center) })
                .filter(|near| near.distance_px <= radius_px)
                .collect();
            // A stable sort.
            expected.sort_by(|a, b| a.distance_px.total_cmp(&b.distance_px));
            prop_assert_eq!(PointTree::new(points).within(&center, radius_px), expected);
        }
    }
}
