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

/// The 8-connected regions of the pixels in `mask`, in the order of their first pixels. Takes the pixels out of it.
pub(super) fn shapes(mask: &mut [bool], width: usize) -> Vec<Shape> {
    let mut shapes = Vec::new();
    let mut waiting = Vec::new();
    let original = mask.to_vec();
    for start in 0..mask.len() {
        if !mask[start] {
            continue;
        }
        let mut pixels = Vec::new();
        let mut edge = 0;
        mask[start] = false;
        waiting.push(start);
        while let Some(index) = waiting.pop() {
            pixels.push(index as u32);
            edge += usize::from(is_at_edge(&original, index, width));
            for next in neighbors(index, width, mask.len()) {
                if std::mem::take(&mut mask[next]) {
                    waiting.push(next);
                }
            }
        }
        if pixels.len() >= MIN_PX {
            shapes.push(Shape::of(pixels, edge, width));
        }
    }
    shapes
}

/// The pixels around one.
fn neighbors(index: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let x = index % width;
    let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
    let rows = (index / width).saturating_sub(1)..=(index / width + 1).min(count / width - 1);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
        .filter(move |&next| next != index)
}

/// Whether a pixel beside it, above it or below it is not in the mask.
fn is_at_edge(mask: &[bool], index: usize, width: usize) -> bool {
    let x = index % width;
    let has = |next: Option<usize>| next.and_then(|next| mask.get(next)).is_some_and(|&is| is);
    let left = x > 0 && has(index.checked_sub(1));
    let right = x + 1 < width && has(Some(index + 1));
    !(left && right && has(index.checked_sub(width)) && has(Some(index + width)))
}
