//! The background in the window of a fit.

use super::edge::Edge;
use super::ring::Ring;
use super::window::Window;
use crate::detect::background::Mesh;
use crate::detect::pixels::View;

/// A plane, and what is not in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct BackgroundPlane {
    /// Background in the first pixel of the window, in ADU.
    pub corner: f32,
    /// Increase from column to column, in ADU.
    pub across: f32,
    /// Increase from row to row, in ADU.
    pub down: f32,
    /// An edge beyond which it does not hold.
    edge: Option<Edge>,
    /// What the background has more, in ADU: the coefficients of x², xy and y², from the middle of the window.
    bend: [f64; 3],
    /// Standard deviation of the pixels around the window about it, in ADU; 0 where they were not looked at.
    pub scatter_adu: f64,
}

impl BackgroundPlane {
    /// The background in `window`: that of the map, or of the pixels around it where the map does not
    /// follow an edge, as of the circle of an all-sky lens: its error would draw faint stars along.
    pub fn in_window(view: &View<'_>, map: &Mesh, window: &Window) -> Self {
        let of_map = Self::of_map(map, window);
        let [x, y] = [window.x0 + window.width / 2, window.y0 + window.height / 2];
        let [x, y] = [x as f32, y as f32];
        if !map.is_bent_at(x, y) {
            return of_map;
        }
        let (_, noise_adu) = map.at(x, y);
        Self::through_ring(view, window, f64::from(noise_adu)).unwrap_or(of_map)
    }

    /// That of the map.
    fn of_map(map: &Mesh, window: &Window) -> Self {
        let background = |x: usize, y: usize| map.background_at(x as f32, y as f32);
        let (x0, y0) = (window.x0, window.y0);
        let corner = background(x0, y0);
        Self {
            corner,
            across: (background(x0 + window.width, y0) - corner) / window.width.max(1) as f32,
            down: (background(x0, y0 + window.height) - corner) / window.height.max(1) as f32,
            edge: None,
            bend: [0.0; 3],
            scatter_adu: 0.0,
        }
    }

    /// What the background has more than the plane, in ADU, at places from the middle of the window: NaN where
    /// it is not known. `None` where it has nothing more.
    pub fn rest(&self) -> Option<impl Fn([f64; 2]) -> f64> {
        let Self { edge, bend, .. } = *self;
        let has_rest = edge.is_some() || bend != [0.0; 3];
        has_rest.then_some(move |[x, y]: [f64; 2]| {
            if edge.is_some_and(|edge| edge.hides([x, y])) {
                f64::NAN
            } else {
                bend[0] * x * x + bend[1] * x * y + bend[2] * y * y
            }
        })
    }

    /// That through the pixels in a ring around the window, without stars, on this side of an edge. `None`
    /// where they are too few.
    fn through_ring(view: &View<'_>, window: &Window, noise_adu: f64) -> Option<Self> {
        let mut ring = Ring::default();
        ring.gather(view, window);
        let edge = Edge::in_ring(&ring, noise_adu);
        if let Some(edge) = edge {
            ring.retain(|place| !edge.hides(place.map(f64::from)));
        }
        let ([level, across, down, bend @ ..], variance) = match edge {
            Some(_) => surface_through(&ring)?,
            None => plane_through(&ring)?,
        };
        let [x, y] = window.middle();
        Some(Self {
            corner: (level - across * x - down * y) as f32,
            across: across as f32,
            down: down as f32,
            edge,
            bend,
            scatter_adu: edge.map_or(0.0, |_| variance.sqrt()),
        })
    }
}

/// The plane through pixels without stars: its value in the middle of the window, its increase from column to
/// column and from row to row, and three zeros; and their variance about it. `None` where they are too few.
fn plane_through(ring: &Ring) -> Option<([f64; 6], f64)> {
    let (plane, variance) = ring.surface::<3>()?;
    Some(([plane[0], plane[1], plane[2], 0.0, 0.0, 0.0], variance))
}

/// The same, with the coefficients of x², xy and y² where a plane is not enough.
fn surface_through(ring: &Ring) -> Option<([f64; 6], f64)> {
    /// The gain in χ² over a plane that they need.
    const MIN_GAIN: f64 = 25.0;
    let plane = plane_through(ring)?;
    let count = ring.values().len() as f64;
    let bent = ring
        .surface::<6>()
        .filter(|(_, variance)| count * (plane.1 / variance - 1.0) > MIN_GAIN);
    Some(bent.map_or(plane, |(surface, variance)| (surface.into(), variance)))
}

#[cfg(test)]
mod tests {
    use crate::base::coords::PixelPoint;
    use crate::detect::{DetectConfig, Detection, Workspace, detect};
    use crate::frame::Frame;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use std::f64::consts::TAU;

    #[test]
    fn an_edge_draws_no_stars_along() {
        const WIDTH: usize = 512;
        const HEIGHT: usize = 3072;
        const EDGE: usize = 300;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut pixel = |index: usize| {
            let level = if index % WIDTH < EDGE { 300.0 } else { 200.0 };
            level + 5.0 * rng.sample::<f64, _>(StandardNormal)
        };
        let mut pixels: Vec<f64> = (0..WIDTH * HEIGHT).map(&mut pixel).collect();
        let mut stars = Vec::new();
        for row in (16..HEIGHT - 16).step_by(16) {
            let (x, y) = (rng.random_range(230.0..260.0), row as f64);
            stars.push((x, y));
            for column in x as usize - 5..x as usize + 6 {
                for row in row - 5..row + 6 {
                    let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    pixels[row * WIDTH + column] += 90.0 * (-0.5 * r2 / 0.95_f64.powi(2)).exp();
                }
            }
        }
        let pixels = pixels.into_iter().map(|pixel| pixel as f32).collect();
        let frame = Frame::new(WIDTH, HEIGHT, pixels).unwrap();
        let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new()).unwrap();
        let (mut count, mut off_px) = (0.0, 0.0);
        for (x, y) in stars {
            let off = |position: &PixelPoint| (position.x - x).hypot(position.y - y);
            let mut sources = found.sources.iter();
            if let Some(star) = sources.find(|source| off(&source.position) < 1.0) {
                count += 1.0;
                off_px += star.position.x - x;
            }
        }
        let mean_px = off_px / count;
        // By the map it is 0.02; the error of the mean is 0.003.
        assert!(count > 150.0 && mean_px.abs() < 0.009, "{count} {mean_px}");
    }

    #[test]
    fn stars_next_to_the_edge_of_a_circle_are_where_they_are() {
        const SIDE: usize = 1024;
        const RADIUS_PX: f64 = 420.0;
        const SIGMA_PX: f64 = 0.95;
        let middle = 0.5 * (SIDE as f64 - 1.0);
        for beyond_adu in [200.0, 10.0] {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            // The first hundred next to the edge.
            let mut star = |index: u32| {
                let way_rad = f64::from(index % 100) / 100.0 * TAU + rng.random_range(0.0..0.03);
                let (near, far) = if index < 100 {
                    (5.0, 15.0)
                } else {
                    (40.0, RADIUS_PX)
                };
                (way_rad, RADIUS_PX - rng.random_range(near..far))
            };
            let stars: Vec<(f64, f64)> = (0..300).map(&mut star).collect();
            let mut pixel = |index: usize| {
                let (x, y) = (
                    (index % SIDE) as f64 - middle,
                    (index / SIDE) as f64 - middle,
                );
                let level = if x.hypot(y) < RADIUS_PX {
                    300.0
                } else {
                    beyond_adu
                };
                level + 5.0 * rng.sample::<f64, _>(StandardNormal)
            };
            let mut pixels: Vec<f64> = (0..SIDE * SIDE).map(&mut pixel).collect();
            let place = |(way_rad, radius_px): (f64, f64)| {
                (
                    middle + radius_px * way_rad.cos(),
                    middle + radius_px * way_rad.sin(),
                )
            };
            for &star in &stars {
                let (x, y) = place(star);
                for column in x as usize - 6..x as usize + 8 {
                    for row in y as usize - 6..y as usize + 8 {
                        let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                        pixels[row * SIDE + column] += 90.0 * (-0.5 * r2 / SIGMA_PX.powi(2)).exp();
                    }
                }
            }
            let pixels = pixels.into_iter().map(|pixel| pixel as f32).collect();
            let frame = Frame::new(SIDE, SIDE, pixels).unwrap();
            let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new()).unwrap();
            let (mut count, mut outwards_px, mut squared_pulls) = (0.0, 0.0, 0.0);
            for star in &stars[..100] {
                let (x, y) = place(*star);
                let off = |position: &PixelPoint| (position.x - x, position.y - y);
                let is_it = |source: &&Detection| {
                    let (x, y) = off(&source.position);
                    x.hypot(y) < 1.0
                };
                if let Some(source) = found.sources.iter().find(is_it) {
                    let (x, y) = off(&source.position);
                    count += 1.0;
                    outwards_px += x * star.0.cos() + y * star.0.sin();
                    squared_pulls += (x / source.sigma_x_px).powi(2);
                }
            }
            let (mean_px, pulls) = (outwards_px / count, (squared_pulls / count).sqrt());
            // The error of the mean is 0.004; it was 0.04 and 0.12, with pulls of 2 and 5.
            let is_there = count > 80.0 && mean_px.abs() < 0.013 && pulls < 1.15;
            assert!(is_there, "{beyond_adu}: {count} {mean_px} {pulls}");
        }
    }
}
