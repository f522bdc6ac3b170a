//! The circle that the sky fills in a picture by an all-sky lens.

use super::SkyArea;
use super::levels::SquareCells;
use super::regions::CellContent;
use crate::base::coords::PixelPoint;
use crate::base::statistics::median;
use nalgebra::{DMatrix, DVector};

/// A circle in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its centre.
    pub centre: PixelPoint,
    /// Its radius, in pixels.
    pub radius_px: f64,
}

/// Largest median distance of the edge from the circle, over its radius: trees are in front of a part.
const MAX_ROUGHNESS: f64 = 0.02;
/// Least number of cells at the edge.
const MIN_CELLS: usize = 60;

impl SkyArea {
    /// The circle that the sky fills, if its edge is one that the frame's corners lie outside of.
    pub(crate) fn circle(&self) -> Option<Circle> {
        let SquareCells {
            side_px,
            columns,
            rows,
        } = self.cells;
        let is_dark = |cell: usize| self.shown[cell] == CellContent::Dark;
        let count = self.shown.len();
        let corners = [0, columns - 1, count - columns, count - 1];
        if !corners.into_iter().all(is_dark) {
            return None;
        }
        let is_edge = |cell: &usize| {
            let (x, y) = (cell % columns, cell / columns);
            let is_inner = x > 0 && y > 0 && x + 1 < columns && y + 1 < rows;
            let around = [
                cell.wrapping_sub(1),
                cell + 1,
                cell.wrapping_sub(columns),
                cell + columns,
            ];
            is_inner && !is_dark(*cell) && around.iter().any(|next| is_dark(*next))
        };
        let cell_px = side_px as f64;
        let middle_px = |at: usize| (at as f64 + 0.5) * cell_px - 0.5;
        let edge: Vec<PixelPoint> = (0..count)
            .filter(is_edge)
            .map(|cell| PixelPoint::new(middle_px(cell % columns), middle_px(cell / columns)))
            .collect();
        let first = fit(&edge)?;
        // Trees make the circle smaller: what lies far inside does not count.
        let outer: Vec<PixelPoint> = edge
            .iter()
            .copied()
            .filter(|point| point.distance_to(&first.centre) > first.radius_px)
            .collect();
        let circle = fit(&outer)?;
        let away =
            |point: &PixelPoint| (point.distance_to(&circle.centre) - circle.radius_px).abs();
        let mut distances: Vec<f64> = edge.iter().map(away).collect();
        (median(&mut distances) < MAX_ROUGHNESS * circle.radius_px).then_some(circle)
    }
}

/// The circle with the least sum of squares of x² + y² − 2 a x − 2 b y − c.
///
/// # Reference
/// Kåsa 1976, IEEE Trans. Instrum. Meas. 25, 8.
fn fit(points: &[PixelPoint]) -> Option<Circle> {
    if points.len() < MIN_CELLS {
        return None;
    }
    let rows = DMatrix::from_fn(points.len(), 3, |i, j| match j {
        0 => points[i].x,
        1 => points[i].y,
        _ => 1.0,
    });
    let squares = DVector::from_fn(points.len(), |i, _| {
        points[i].x.powi(2) + points[i].y.powi(2)
    });
    let solution = (rows.transpose() * &rows)
        .cholesky()?
        .solve(&(rows.transpose() * squares));
    let (x, y) = (solution[0] / 2.0, solution[1] / 2.0);
    let radius_px = (solution[2] + x * x + y * y).max(0.0).sqrt();
    Some(Circle {
        centre: PixelPoint::new(x, y),
        radius_px,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sky area of 64 × 48 cells of 10 px.
    fn area(is_hidden: impl Fn(f64, f64) -> bool) -> SkyArea {
        let middle = |at: usize| (at as f64 + 0.5) * 10.0 - 0.5;
        let cells = (0..64 * 48).map(|cell| {
            if is_hidden(middle(cell % 64), middle(cell / 64)) {
                CellContent::Dark
            } else {
                CellContent::Sky
            }
        });
        SkyArea {
            cells: SquareCells {
                side_px: 10,
                columns: 64,
                rows: 48,
            },
            shown: cells.collect(),
        }
    }

    #[test]
    fn the_circle_of_a_lens_is_found_behind_trees_and_cut_by_the_frame() {
        let away = |x: f64, y: f64| (x - 330.0).hypot(y - 250.0);
        let round = area(|x, y| away(x, y) > 260.0 || (x < 180.0 && y > 300.0));
        let circle = round.circle().unwrap();
        assert!((circle.radius_px - 260.0).abs() < 10.0, "{circle:?}");
        assert!(circle.centre.distance_to(&PixelPoint::new(330.0, 250.0)) < 10.0);
    }

    #[test]
    fn corners_in_the_sky_and_other_forms_are_no_circle() {
        assert_eq!(area(|_, y| y > 300.0).circle(), None);
        assert_eq!(
            area(|x, y| (x - 320.0).abs() > 250.0 || (y - 240.0).abs() > 150.0).circle(),
            None
        );
    }
}
