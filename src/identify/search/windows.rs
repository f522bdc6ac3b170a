//! Windows of a frame: parts so small that any lens is like a pinhole there.

use crate::base::coords::PixelPoint;
use crate::camera::frame_centre;
use crate::identify::field::{ObservedStar, StarField};
use crate::identify::priors::{Priors, ScalePrior};

/// Side of the large window, of the small ones and of the smallest, in units of the frame's shorter side.
const LARGE: f64 = 0.5;
const SMALL: f64 = 0.25;
const SMALLEST: f64 = 0.16;
/// Centres of the windows from that of the frame, in units of the frame's shorter side, and their
/// sides. The middle comes first: lenses distort least there, and it is highest in the sky.
const WINDOWS: [([f64; 2], f64); 11] = [
    ([0.0, 0.0], SMALLEST),
    ([0.0, 0.0], SMALL),
    ([0.0, 0.0], LARGE),
    ([-SMALL, 0.0], SMALL),
    ([SMALL, 0.0], SMALL),
    ([0.0, -SMALL], SMALL),
    ([0.0, SMALL], SMALL),
    ([-SMALL, -SMALL], SMALL),
    ([SMALL, SMALL], SMALL),
    ([-SMALL, SMALL], SMALL),
    ([SMALL, -SMALL], SMALL),
];
/// Fewest stars that are worth a search, and in the smallest window.
const MIN_STARS: usize = 8;
const MIN_STARS_OF_SMALLEST: usize = 25;

/// A window.
#[derive(Debug, Clone)]
pub struct SearchWindow {
    /// Its stars, in its own pixels.
    pub field: StarField,
    /// Its first pixel in the frame.
    corner: PixelPoint,
    /// Whether it is in the middle of the frame.
    pub is_central: bool,
    /// Whether it is worth a long search: in the middle, and not the smallest.
    pub is_main: bool,
}

impl SearchWindow {
    /// Its centre, in the frame.
    pub fn centre(&self) -> PixelPoint {
        let StarField {
            width_px,
            height_px,
            ..
        } = self.field;
        self.in_frame(&frame_centre(width_px, height_px))
    }

    /// What the priors of a frame of this width say of the window.
    pub fn priors(&self, of_frame: &Priors, width_px: f64) -> Priors {
        let scale = of_frame.pixel_scale_range_rad(width_px);
        Priors {
            scale: scale.map(|[low_rad, high_rad]| ScalePrior::between(low_rad, high_rad)),
            // The frame's centre is told, not the window's.
            near: of_frame.near.filter(|_| self.is_central),
            ..*of_frame
        }
    }

    /// The place in the frame of one in the window.
    pub fn in_frame(&self, place: &PixelPoint) -> PixelPoint {
        PixelPoint::new(self.corner.x + place.x, self.corner.y + place.y)
    }
}

/// Cuts windows. Their buffers are reused.
#[derive(Debug, Default)]
pub struct Windows(Vec<SearchWindow>);

impl Windows {
    /// The windows of `field` that have stars enough.
    pub fn cut(&mut self, field: &StarField) -> &[SearchWindow] {
        let shorter_px = field.width_px.min(field.height_px);
        let mut count = 0;
        for ([x, y], side) in WINDOWS {
            let side_px = (side * shorter_px).round();
            let first =
                |extent_px: f64, off: f64| (0.5 * (extent_px - side_px) + off * shorter_px).round();
            let corner = PixelPoint::new(first(field.width_px, x), first(field.height_px, y));
            let old = self.0.get_mut(count);
            let mut stars = old.map_or_else(Vec::new, |old| std::mem::take(&mut old.field.stars));
            stars.clear();
            stars.extend(
                field
                    .stars
                    .iter()
                    .filter_map(|star| inside(star, &corner, side_px)),
            );
            let least = if side < SMALL {
                MIN_STARS_OF_SMALLEST
            } else {
                MIN_STARS
            };
            let is_worth_it = stars.len() >= least;
            let window = SearchWindow {
                field: StarField {
                    width_px: side_px,
                    height_px: side_px,
                    stars,
                    sky_area: None,
                    ..*field
                },
                corner,
                is_central: [x, y] == [0.0; 2],
                is_main: [x, y] == [0.0; 2] && side >= SMALL,
            };
            match self.0.get_mut(count) {
                Some(reused) => *reused = window,
                None => self.0.push(window),
            }
            count += usize::from(is_worth_it);
        }
        &self.0[..count]
    }
}

/// A star at its place in a window; `None` outside it.
fn inside(star: &ObservedStar, corner: &PixelPoint, side_px: f64) -> Option<ObservedStar> {
    let position = PixelPoint::new(star.position.x - corner.x, star.position.y - corner.y);
    let range_px = -0.5..side_px - 0.5;
    let is_inside = range_px.contains(&position.x) && range_px.contains(&position.y);
    is_inside.then_some(ObservedStar { position, ..*star })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_the_stars_of_their_part_of_the_frame() {
        let places: Vec<_> = (0..400)
            .map(|i| {
                (
                    f64::from(i % 20) * 50.0 + 20.0,
                    f64::from(i / 20) * 40.0 + 15.0,
                )
            })
            .collect();
        let field = StarField::of_places([1000.0, 800.0], &places);
        let mut windows = Windows::default();
        let all = windows.cut(&field);
        assert_eq!(all.len(), 10, "the smallest has too few");
        for window in all {
            assert!(window.field.stars.windows(2).all(|w| w[0].mag < w[1].mag));
            for star in &window.field.stars {
                let place = window.in_frame(&star.position);
                let known = field.stars[star.source.get()].position;
                assert!(place.distance_to(&known) < 1e-9);
            }
        }
        assert_eq!(all[0].corner, PixelPoint::new(400.0, 300.0));
        assert_eq!(all[1].field.width_px, 400.0);
    }

    #[test]
    fn windows_with_few_stars_are_left_out() {
        let places: Vec<_> = (0..9).map(|i| (480.0 + f64::from(i), 390.0)).collect();
        let field = StarField::of_places([1000.0, 800.0], &places);
        assert_eq!(Windows::default().cut(&field).len(), 2);
    }
}
