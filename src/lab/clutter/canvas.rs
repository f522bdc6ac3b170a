//! A layer of clutter that is drawn before the sky: opaque shapes, and light that is added.
//!
//! Light is in units of the noise of the sky behind it, above the sky.

use crate::base::coords::PixelPoint;

/// A layer of the size of a frame.
#[derive(Debug, Clone)]
pub(super) struct ClutterCanvas {
    pub width: usize,
    pub height: usize,
    /// How much of the sky each pixel hides, from 0 to 1.
    pub opacity: Vec<f32>,
    /// Light of what hides the sky.
    pub light: Vec<f32>,
    /// Light that is added to everything.
    pub glow: Vec<f32>,
}

/// Columns and rows from the first to before the last.
type Bounds = [std::ops::Range<usize>; 2];

impl ClutterCanvas {
    /// An empty layer.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let empty = vec![0.0; width * height];
        Self {
            width,
            height,
            opacity: empty.clone(),
            light: empty.clone(),
            glow: empty,
        }
    }

    /// The share of the frame that is hidden.
    pub(super) fn covered(&self) -> f64 {
        let sum: f64 = self.opacity.iter().map(|opacity| f64::from(*opacity)).sum();
        sum / self.opacity.len() as f64
    }

    /// The share that is seen of a spot at `place` with this standard deviation.
    pub(super) fn share_seen(&self, place: &PixelPoint, sigma_px: f64) -> f64 {
        /// Practically all light of a Gaussian is within this many standard deviations.
        const REACH_SIGMAS: f64 = 4.0;
        let [columns, rows] = self.around(place, REACH_SIGMAS * sigma_px);
        let (mut all, mut seen) = (0.0, 0.0);
        for y in rows {
            for x in columns.clone() {
                let apart_px = PixelPoint::new(x as f64, y as f64).distance_to(place);
                let light = libm::exp(-0.5 * (apart_px / sigma_px).powi(2));
                all += light;
                seen += light * (1.0 - f64::from(self.opacity[y * self.width + x]));
            }
        }
        // A star outside the frame is not hidden.
        if all > 0.0 { seen / all } else { 1.0 }
    }

    fn around(&self, centre: &PixelPoint, reach_px: f64) -> Bounds {
        let range = |middle: f64, size: usize| {
            let low = (middle - reach_px).floor().max(0.0) as usize;
            let high = (middle + reach_px + 2.0).max(0.0) as usize;
            low.min(size)..high.min(size)
        };
        [range(centre.x, self.width), range(centre.y, self.height)]
    }

    /// Hides pixels within `bounds` by the share that `coverage` gives, with `light` in their
    /// place.
    fn paint(&mut self, bounds: Bounds, light: f64, coverage: impl Fn(&PixelPoint) -> f64) {
        let [columns, rows] = bounds;
        for y in rows {
            for x in columns.clone() {
                let share = coverage(&PixelPoint::new(x as f64, y as f64)).clamp(0.0, 1.0) as f32;
                if share > 0.0 {
                    let at = y * self.width + x;
                    self.light[at] += share * (light as f32 - self.light[at]);
                    self.opacity[at] = 1.0 - (1.0 - self.opacity[at]) * (1.0 - share);
                }
            }
        }
    }

    /// A filled ellipse with half axes `axes_px`, the first turned by `angle_rad` from x to y.
    pub(super) fn ellipse(
        &mut self,
        centre: &PixelPoint,
        axes_px: [f64; 2],
        angle_rad: f64,
        light: f64,
    ) {
        let (sin, cos) = libm::sincos(angle_rad);
        let [long, short] = axes_px;
        let bounds = self.around(centre, long.max(short));
        self.paint(bounds, light, |point| {
            let (dx, dy) = (point.x - centre.x, point.y - centre.y);
            let (u, v) = ((dx * cos + dy * sin) / long, (dy * cos - dx * sin) / short);
            // About the distance to the border, in pixels.
            (1.0 - libm::hypot(u, v)) * short + 0.5
        });
    }

    /// A line with round ends.
    pub(super) fn line(&mut self, from: &PixelPoint, to: &PixelPoint, width_px: f64, light: f64) {
        let middle = PixelPoint::new((from.x + to.x) / 2.0, (from.y + to.y) / 2.0);
        let bounds = self.around(&middle, from.distance_to(to) / 2.0 + width_px);
        self.paint(bounds, light, |point| {
            (width_px / 2.0 - distance_to_line(point, from, to)) + 0.5
        });
    }

    /// A filled rectangle between two corners.
    pub(super) fn rectangle(&mut self, low: &PixelPoint, high: &PixelPoint, light: f64) {
        let middle = PixelPoint::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0);
        let half = [(high.x - low.x) / 2.0, (high.y - low.y) / 2.0];
        let bounds = self.around(&middle, half[0].max(half[1]));
        self.paint(bounds, light, |point| {
            let inside_x = half[0] - (point.x - middle.x).abs();
            let inside_y = half[1] - (point.y - middle.y).abs();
            inside_x.min(inside_y) + 0.5
        });
    }

    /// Everything between two columns and below `edge`, which gives a row for each column.
    pub(super) fn below(
        &mut self,
        [left, right]: [f64; 2],
        edge: impl Fn(f64) -> f64,
        light: impl Fn(&PixelPoint) -> f64,
    ) {
        let columns = left.max(0.0) as usize..(right.max(0.0) as usize).min(self.width);
        for x in columns {
            let first = (edge(x as f64) - 1.0).max(0.0) as usize;
            for y in first..self.height {
                let point = PixelPoint::new(x as f64, y as f64);
                let share = point.y - edge(point.x) + 0.5;
                if share > 0.0 {
                    let pixel = [x..x + 1, y..y + 1];
                    self.paint(pixel, light(&point), |_| share);
                }
            }
        }
    }

    /// A disc of added light, whose border is `soft_px` wide; its rim is brighter by `rim`.
    pub(super) fn disc_of_light(
        &mut self,
        centre: &PixelPoint,
        radius_px: f64,
        soft_px: f64,
        rim: f64,
        light: f64,
    ) {
        let [columns, rows] = self.around(centre, radius_px + soft_px);
        for y in rows {
            for x in columns.clone() {
                let distance = centre.distance_to(&PixelPoint::new(x as f64, y as f64));
                let share = ((radius_px - distance) / soft_px + 0.5).clamp(0.0, 1.0);
                let at_rim = (1.0 - (radius_px - distance).abs() / (3.0 * soft_px)).max(0.0);
                self.glow[y * self.width + x] += (light * share * (1.0 + rim * at_rim)) as f32;
            }
        }
    }

    /// A Gaussian spot of added light.
    pub(super) fn spot(&mut self, centre: &PixelPoint, sigma_px: f64, peak: f64) {
        const REACH_SIGMAS: f64 = 5.0;
        let [columns, rows] = self.around(centre, REACH_SIGMAS * sigma_px);
        for y in rows {
            for x in columns.clone() {
                let off = centre.distance_to(&PixelPoint::new(x as f64, y as f64)) / sigma_px;
                self.glow[y * self.width + x] += (peak * libm::exp(-0.5 * off * off)) as f32;
            }
        }
    }

    /// Turns the layer upside down, and exchanges left and right.
    pub(super) fn turn(&mut self) {
        self.opacity.reverse();
        self.light.reverse();
        self.glow.reverse();
    }
}

fn distance_to_line(point: &PixelPoint, from: &PixelPoint, to: &PixelPoint) -> f64 {
    let along = [to.x - from.x, to.y - from.y];
    let length_sq = along[0] * along[0] + along[1] * along[1];
    let dot = (point.x - from.x) * along[0] + (point.y - from.y) * along[1];
    let share = if length_sq > 0.0 {
        (dot / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance_to(&PixelPoint::new(
        from.x + share * along[0],
        from.y + share * along[1],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_cover_their_areas() {
        let middle = PixelPoint::new(50.0, 40.0);
        let area = |draw: fn(&mut ClutterCanvas, &PixelPoint)| {
            let mut canvas = ClutterCanvas::new(100, 80);
            draw(&mut canvas, &middle);
            assert!(canvas.share_seen(&PixelPoint::new(51.0, 41.0), 0.2) < 0.1);
            canvas.covered() * 8000.0
        };
        let disc = area(|canvas, at| canvas.ellipse(at, [20.0, 20.0], 0.4, 1.0));
        assert!((disc - std::f64::consts::PI * 400.0).abs() < 10.0, "{disc}");
        let line = area(|canvas, at| {
            canvas.line(at, &PixelPoint::new(at.x + 30.0, at.y), 4.0, 1.0);
        });
        assert!(
            (line - 120.0 - 4.0 * std::f64::consts::PI).abs() < 5.0,
            "{line}"
        );
        let rectangle = area(|canvas, at| {
            canvas.rectangle(at, &PixelPoint::new(at.x + 20.0, at.y + 10.0), 1.0);
        });
        assert!((rectangle - 200.0).abs() < 2.0, "{rectangle}");
        let below = area(|canvas, _| canvas.below([0.0, 100.0], |_| 40.0, |_| 1.0));
        assert!((below - 100.0 * 39.5).abs() < 1.0, "{below}");
    }

    #[test]
    fn what_is_outside_is_not_drawn() {
        let mut canvas = ClutterCanvas::new(50, 40);
        canvas.ellipse(&PixelPoint::new(-90.0, 1e9), [20.0, 5.0], 0.0, 1.0);
        canvas.spot(&PixelPoint::new(70.0, -30.0), 2.0, 100.0);
        assert_eq!(canvas.covered(), 0.0);
        assert!(canvas.glow.iter().all(|glow| *glow == 0.0));
        assert_eq!(canvas.share_seen(&PixelPoint::new(-30.0, 400.0), 0.5), 1.0);
    }
}
