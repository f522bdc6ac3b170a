//! Neighbor search among points on a frame: with a k-d tree, or for short distances with cells.

use super::coords::PixelPoint;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::ops::RangeInclusive;

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

/// Most rows and columns of cells of a [`PointGrid`]. If the points are few, there are about as many
/// cells as points.
const MAX_ALONG: usize = 128;

/// Points on a frame, sorted into cells: searches within short distances are faster than with a
/// [`PointTree`]. Its buffers are reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointGrid {
    x: Division,
    y: Division,
    /// Row by row, and the start of each cell.
    by_cell: Vec<(PixelPoint, u32)>,
    starts: Vec<u32>,
    /// The cell of each point.
    cells: Vec<u32>,
}

impl PointGrid {
    /// Replaces the points, of which there are `count`.
    pub fn fill(&mut self, count: usize, points: impl Iterator<Item = PixelPoint> + Clone) {
        let along = ((count as f64).sqrt() as usize).clamp(1, MAX_ALONG);
        self.x = Division::over(points.clone().map(|point| point.x), along);
        self.y = Division::over(points.clone().map(|point| point.y), along);
        self.starts.clear();
        self.starts.resize(along * along + 1, 0);
        self.cells.clear();
        let (x, y) = (self.x, self.y);
        let cells = points
            .clone()
            .map(|point| y.part_at(point.y) * along + x.part_at(point.x));
        self.cells.extend(cells.map(|cell| cell as u32));
        for &cell in &self.cells {
            self.starts[cell as usize] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.by_cell.clear();
        self.by_cell.resize(count, (PixelPoint::new(0.0, 0.0), 0));
        for ((index, point), &cell) in points.enumerate().zip(&self.cells) {
            let start = &mut self.starts[cell as usize];
            *start -= 1;
            self.by_cell[*start as usize] = (point, index as u32);
        }
    }

    /// Calls `visit` for every point within `radius_px` of `center`, in no particular order.
    #[inline]
    pub fn for_each_within(
        &self,
        center: &PixelPoint,
        radius_px: f64,
        mut visit: impl FnMut(Neighbor),
    ) {
        let columns = self.x.near(center.x, radius_px);
        let enough_px2 = radius_px * radius_px * (1.0 + 4.0 * f64::EPSILON);
        for row in self.y.near(center.y, radius_px) {
            let [first, last] = [columns.start(), columns.end()].map(|c| row * self.x.parts + c);
            let near = self.starts[first] as usize..self.starts[last + 1] as usize;
            for &(point, index) in &self.by_cell[near] {
                let (dx, dy) = (point.x - center.x, point.y - center.y);
                // Most are farther away: no need for the exact distance.
                if dx * dx + dy * dy > enough_px2 {
                    continue;
                }
                let distance_px = point.distance_to(center);
                if distance_px <= radius_px {
                    visit(Neighbor {
                        index: index as usize,
                        distance_px,
                    });
                }
            }
        }
    }

    /// Strips along x, from the leftmost point to the rightmost one.
    pub fn strips(&self, parts: usize) -> Division {
        Division {
            parts,
            per_px: parts as f64 / self.x.extent_px,
            ..self.x
        }
    }
}

/// A division of a range of coordinates into equal parts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Division {
    parts: usize,
    from_px: f64,
    extent_px: f64,
    per_px: f64,
}

impl Division {
    fn over(coordinates: impl Iterator<Item = f64>, parts: usize) -> Self {
        let (low, high) = coordinates.fold((f64::MAX, f64::MIN), |(low, high), at| {
            (
                if at < low { at } else { low },
                if at > high { at } else { high },
            )
        });
        let extent_px = (high - low).max(1.0);
        Self {
            parts,
            from_px: low,
            extent_px,
            per_px: parts as f64 / extent_px,
        }
    }

    /// The part in which a coordinate lies; outside the range, the nearest.
    pub fn part_at(&self, at: f64) -> usize {
        (((at - self.from_px) * self.per_px).max(0.0) as u32 as usize).min(self.parts - 1)
    }

    fn near(&self, at: f64, radius_px: f64) -> RangeInclusive<usize> {
        self.part_at(at - radius_px)..=self.part_at(at + radius_px)
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
            let mut grid = PointGrid::default();
            grid.fill(points.len(), points.iter().copied());
            let mut near = Vec::new();
            grid.for_each_within(&center, radius_px, |found| near.push(found));
            near.sort_unstable_by_key(|found| found.index);
            near.sort_by(|a, b| a.distance_px.total_cmp(&b.distance_px));
            prop_assert_eq!(&near, &expected);
            prop_assert_eq!(PointTree::new(points).within(&center, radius_px), expected);
        }
    }
}
