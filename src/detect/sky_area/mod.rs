//! The part of a frame that shows the sky, without trees, houses, lamps, the Moon, and the border around
//! the circle of an all-sky lens.

mod circle;
mod levels;
mod regions;

use crate::base::coords::PixelPoint;
use crate::frame::Frame;
pub use circle::Circle;
use levels::{CellMedians, SquareCells};
use regions::CellContent;
use std::sync::Arc;

/// The part of a frame that shows the sky, in cells.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyArea {
    cells: SquareCells,
    /// What each of them shows.
    shown: Arc<[CellContent]>,
}

impl SkyArea {
    /// What a picture and the places of its stars tell. An area with a sharp edge that is darker than what is
    /// around it and has few stars does not show the sky, nor does what is saturated or has no value. `None`
    /// where all does.
    pub(super) fn of_picture(
        frame: &Frame,
        stars: impl Iterator<Item = PixelPoint>,
        saturation_adu: f32,
    ) -> Option<Self> {
        let levels = CellMedians::of(frame, saturation_adu);
        let stars = levels.count(stars);
        let shown = regions::cells(&levels, &stars);
        let is_hidden = |cell: &CellContent| *cell != CellContent::Sky;
        shown.iter().any(is_hidden).then(|| Self {
            cells: levels.cells,
            shown: shown.into(),
        })
    }

    /// Whether the sky is seen at a place.
    pub fn shows(&self, place: &PixelPoint) -> bool {
        self.shown[self.cells.at(place)] == CellContent::Sky
    }

    /// Whether something dark is at a place: light there is not that of a star, but comes through leaves.
    pub(crate) fn is_dark(&self, place: &PixelPoint) -> bool {
        self.shown[self.cells.at(place)] == CellContent::Dark
    }

    /// Whether the sky ends along a line, to one side of it: such a line is of what hides the sky.
    pub(super) fn ends_along(&self, [begin, end]: [PixelPoint; 2]) -> bool {
        const PLACES: [f64; 3] = [0.2, 0.5, 0.8];
        let (dx, dy) = (end.x - begin.x, end.y - begin.y);
        let cells = self.cells.side_px as f64 / libm::hypot(dx, dy);
        [cells, -cells].into_iter().any(|aside| {
            PLACES.into_iter().all(|along| {
                let x = begin.x + along * dx - aside * dy;
                let y = begin.y + along * dy + aside * dx;
                !self.shows(&PixelPoint::new(x, y))
            })
        })
    }

    /// The share of the frame that shows the sky.
    pub fn share(&self) -> f64 {
        let seen = self
            .shown
            .iter()
            .filter(|cell| **cell == CellContent::Sky)
            .count();
        seen as f64 / self.shown.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::{DetectConfig, Workspace, detect};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const WIDTH: usize = 640;
    const HEIGHT: usize = 480;

    /// The sky area of a frame with this background and 300 stars where `has_stars`.
    fn area(
        level: impl Fn(f64, f64) -> f64,
        has_stars: impl Fn(f64, f64) -> bool,
    ) -> Option<SkyArea> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut pixel = |index| {
            let noise = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            let level = level((index % WIDTH) as f64, (index / WIDTH) as f64);
            (level + 2.0 * noise).min(255.0)
        };
        let mut pixels: Vec<f32> = (0..WIDTH * HEIGHT)
            .map(|index| pixel(index) as f32)
            .collect();
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..300 {
            let (x, y) = (
                random.random_range(5..WIDTH - 5),
                random.random_range(5..HEIGHT - 5),
            );
            if has_stars(x as f64, y as f64) {
                for (dx, dy, light) in [(0, 0, 80.0), (1, 0, 50.0), (0, 1, 50.0), (1, 1, 30.0)] {
                    pixels[(y + dy) * WIDTH + x + dx] += light;
                }
            }
        }
        let frame = Frame::new(WIDTH, HEIGHT, pixels).unwrap();
        let frame = frame.with_levels(1.0, Some(255.0));
        let (config, mut workspace) = (DetectConfig::default(), Workspace::new());
        let found = detect(&frame, &config, &mut workspace).unwrap();
        workspace.sky_area(&frame, &found)
    }

    #[test]
    fn the_sky_ends_along_a_roof() {
        let height = |x: f64| 300.0 + 0.3 * x;
        let is_roof = |x: f64, y: f64| y > height(x);
        let level = |x, y| if is_roof(x, y) { 25.0 } else { 80.0 };
        let found = area(level, |x, y| !is_roof(x, y)).unwrap();
        let line = |above_px: f64, slope: f64| {
            [100.0, 400.0]
                .map(|x| PixelPoint::new(x, height(100.0) - above_px + slope * (x - 100.0)))
        };
        assert!(found.ends_along(line(2.0, 0.3)));
        assert!(!found.ends_along(line(40.0, 0.3)) && !found.ends_along(line(2.0, -0.3)));
    }

    #[test]
    fn trees_hide_the_sky() {
        let is_tree = |x: f64, y: f64| y > 330.0 + 40.0 * (x / 40.0).sin();
        let level = |x, y| if is_tree(x, y) { 25.0 } else { 80.0 };
        let found = area(level, |x, y| !is_tree(x, y)).unwrap();
        let shows = |x, y| found.shows(&PixelPoint::new(x, y));
        assert!(shows(300.0, 100.0) && shows(0.0, 0.0) && shows(639.0, 250.0));
        assert!(!shows(300.0, 420.0) && !shows(0.0, 479.0) && !shows(639.0, 479.0));
        assert!(
            (found.share() - 330.0 / 480.0).abs() < 0.03,
            "{}",
            found.share()
        );
    }

    #[test]
    fn a_dark_area_with_stars_and_a_gradient_are_sky() {
        let dark = |_: f64, y: f64| if y > 330.0 { 25.0 } else { 80.0 };
        assert_eq!(area(dark, |_, _| true).map(|area| area.share()), None);
        let corners =
            |x: f64, y: f64| 100.0 - 80.0 * ((x - 320.0).hypot(y - 240.0) / 400.0).powi(2);
        assert!(area(corners, |_, _| true).is_none());
    }

    #[test]
    fn the_moon_hides_the_sky_around_it() {
        let moon =
            |x: f64, y: f64| 60.0 + 1.2e6 / (1.0 + (x - 200.0).powi(2) + (y - 200.0).powi(2));
        let found = area(moon, |_, _| true).unwrap();
        assert!(!found.shows(&PixelPoint::new(200.0, 200.0)));
        assert!(found.shows(&PixelPoint::new(500.0, 400.0)));
        assert!(found.share() > 0.9);
    }
}
