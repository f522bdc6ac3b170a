//! Connected regions of a picture, and their shapes.

/// Smaller regions are noise.
const MIN_PX: usize = 4;

/// Connected pixels.
pub(super) struct Shape {
    /// Their indices.
    pub pixels: Vec<u32>,
    /// First and last column and row.
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
    /// Their middle.
    pub middle: [f64; 2],
    /// Direction of their longer axis, in radians; y runs down.
    pub angle_rad: f64,
    /// Length and breadth of the bar with the same second moments.
    pub length: f64,
    pub breadth: f64,
    /// Pixels at their edge.
    pub edge: usize,
}

impl Shape {
    pub fn of(pixels: Vec<u32>, edge: usize, width: usize) -> Self {
        let count = pixels.len() as f64;
        let place = |&index: &u32| {
            let index = index as usize;
            [(index % width) as f64, (index / width) as f64]
        };
        let mut bounds = [f64::MAX, f64::MIN, f64::MAX, f64::MIN];
        let mut middle = [0.0, 0.0];
        for [x, y] in pixels.iter().map(place) {
            let [left, right, top, bottom] = bounds;
            bounds = [left.min(x), right.max(x), top.min(y), bottom.max(y)];
            middle = [middle[0] + x / count, middle[1] + y / count];
        }
        let (mut xx, mut yy, mut xy) = (1.0 / 12.0, 1.0 / 12.0, 0.0);
        for [x, y] in pixels.iter().map(place) {
            let (dx, dy) = (x - middle[0], y - middle[1]);
            xx += dx * dx / count;
            yy += dy * dy / count;
            xy += dx * dy / count;
        }
        let (mean, half) = ((xx + yy) / 2.0, libm::hypot((xx - yy) / 2.0, xy));
        // A bar of length l has the variance l²/12 along it.
        let extent = |variance: f64| (12.0 * variance.max(0.0)).sqrt();
        let [left, right, top, bottom] = bounds;
        Self {
            pixels,
            left,
            right,
            top,
            bottom,
            middle,
            angle_rad: libm::atan2(2.0 * xy, xx - yy) / 2.0,
            length: extent(mean + half),
            breadth: extent(mean - half),
            edge,
        }
    }

    /// Number of its pixels.
    pub fn area(&self) -> f64 {
        self.pixels.len() as f64
    }

    pub fn width(&self) -> f64 {
        self.right - self.left + 1.0
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top + 1.0
    }

    /// Diagonal of the box around it.
    pub fn extent(&self) -> f64 {
        libm::hypot(self.width(), self.height())
    }

    /// How thick its strokes are: a line has its edge on both sides.
    pub fn thickness(&self) -> f64 {
        2.0 * self.area() / self.edge as f64
    }

    /// Whether it touches the border of a picture of this size.
    pub fn touches(&self, width: usize, height: usize) -> bool {
        let [last_x, last_y] = [width, height].map(|side| side as f64 - 2.0);
        self.left < 1.0 || self.top < 1.0 || self.right > last_x || self.bottom > last_y
    }
}

/// A pixel that is not in a mask, one that waits, and one that is taken.
const OUT: u8 = 0;
const WAITS: u8 = 1;
const TAKEN: u8 = 2;

/// The 8-connected regions of the pixels that `are_in` a picture `width` wide, in the order of their first pixels.
pub(super) fn shapes(are_in: impl Iterator<Item = bool>, width: usize) -> Vec<Shape> {
    let mut mask: Vec<u8> = are_in.map(u8::from).collect();
    let (mut shapes, mut waiting) = (Vec::new(), Vec::new());
    for start in 0..mask.len() {
        if mask[start] != WAITS {
            continue;
        }
        let (mut pixels, mut edge) = (Vec::new(), 0);
        mask[start] = TAKEN;
        waiting.push(start);
        while let Some(index) = waiting.pop() {
            pixels.push(index as u32);
            edge += usize::from(take_around(&mut mask, index, width, &mut waiting));
        }
        if pixels.len() >= MIN_PX {
            shapes.push(Shape::of(pixels, edge, width));
        }
    }
    shapes
}

/// Takes the pixels around one that wait, and returns whether one beside it, above it or below it is not in the mask.
fn take_around(mask: &mut [u8], index: usize, width: usize, waiting: &mut Vec<usize>) -> bool {
    let (x, y) = (index % width, index / width);
    let (last_x, last_y) = (width - 1, mask.len() / width - 1);
    let mut is_edge = x == 0 || y == 0 || x == last_x || y == last_y;
    for row in y.saturating_sub(1)..=(y + 1).min(last_y) {
        for column in x.saturating_sub(1)..=(x + 1).min(last_x) {
            let next = row * width + column;
            match mask[next] {
                WAITS => {
                    mask[next] = TAKEN;
                    waiting.push(next);
                }
                OUT => is_edge |= row == y || column == x,
                _ => {}
            }
        }
    }
    is_edge
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The regions of the `#` in a drawing.
    fn drawn(rows: &[&str]) -> Vec<Shape> {
        let pixels = rows.iter().flat_map(|row| row.chars());
        shapes(pixels.map(|c| c == '#'), rows[0].len())
    }

    #[test]
    fn regions_touch_at_corners_and_small_ones_are_left_out() {
        let found = drawn(&["##...#", "..##..", "......", "#.####", "......"]);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].area(), found[0].width(), found[0].height()),
            (4.0, 4.0, 2.0)
        );
        assert_eq!((found[1].area(), found[1].middle), (4.0, [3.5, 3.0]));
        assert!(found[1].touches(6, 5) && (found[1].length - 4.0).abs() < 1e-9);
    }

    #[test]
    fn a_stroke_is_as_thick_as_its_edges_are_near() {
        let line = drawn(&["..........", ".########.", ".########.", ".........."]);
        assert_eq!((line[0].edge, line[0].thickness()), (16, 2.0));
    }

    #[test]
    fn a_picture_full_of_pixels_is_one_region() {
        let full = shapes((0..600).map(|_| true), 30);
        assert_eq!((full.len(), full[0].area(), full[0].edge), (1, 600.0, 96));
    }
}
