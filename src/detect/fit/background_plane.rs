//! The background in the window of a fit.

use super::window::Window;
use crate::detect::background::Mesh;
use crate::detect::pixels::View;
use nalgebra::{Matrix3, Vector3};

/// A plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct BackgroundPlane {
    /// Background in the first pixel of the window, in ADU.
    pub corner: f32,
    /// Increase from column to column, in ADU.
    pub across: f32,
    /// Increase from row to row, in ADU.
    pub down: f32,
}

impl BackgroundPlane {
    /// The background in `window`: that of the map, or of the pixels around it where the map does not
    /// follow an edge, as of the circle of an all-sky lens: its error would draw faint stars along.
    pub fn in_window(view: &View<'_>, map: &Mesh, window: &Window) -> Self {
        let of_map = Self::of_map(map, window);
        let [x, y] = [window.x0 + window.width / 2, window.y0 + window.height / 2];
        if map.is_bent_at(x as f32, y as f32) {
            of_map.through_ring(view, window).unwrap_or(of_map)
        } else {
            of_map
        }
    }

    /// That of the map.
    fn of_map(map: &Mesh, window: &Window) -> Self {
        let background = |x: usize, y: usize| map.at(x as f32, y as f32).0;
        let (x0, y0) = (window.x0, window.y0);
        let corner = background(x0, y0);
        Self {
            corner,
            across: (background(x0 + window.width, y0) - corner) / window.width.max(1) as f32,
            down: (background(x0, y0 + window.height) - corner) / window.height.max(1) as f32,
        }
    }

    /// The plane through the pixels in a ring around the window, without stars. `None` where they are
    /// too few.
    fn through_ring(self, view: &View<'_>, window: &Window) -> Option<Self> {
        /// Breadth of the ring, in pixels.
        const BREADTH_PX: usize = 5;
        /// Rounds of clipping: the first planes are of the stars, too.
        const ROUNDS: usize = 6;
        /// Pixels so many standard deviations off the plane of the round before are not its own.
        const CLIP_SIGMAS: f64 = 2.5;
        /// Share of the pixels that is left at least.
        const MIN_SHARE: f64 = 0.4;
        let columns = window.x0.saturating_sub(BREADTH_PX)
            ..(window.x0 + window.width + BREADTH_PX).min(view.width);
        let rows = window.y0.saturating_sub(BREADTH_PX)
            ..(window.y0 + window.height + BREADTH_PX).min(view.height);
        let is_inside = |x: usize, y: usize| {
            (window.x0..window.x0 + window.width).contains(&x)
                && (window.y0..window.y0 + window.height).contains(&y)
        };
        let ring = || {
            let all = rows
                .clone()
                .flat_map(|y| columns.clone().map(move |x| (x, y)));
            all.filter(|&(x, y)| !is_inside(x, y))
        };
        let offset = |x: usize, y: usize| {
            let [x, y] = [x as f64 - window.x0 as f64, y as f64 - window.y0 as f64];
            Vector3::new(1.0, x, y)
        };
        let mut plane: Option<(Vector3<f64>, f64)> = None;
        for _ in 0..ROUNDS {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            let (mut squares, mut all) = (0.0, 0.0);
            for (x, y) in ring() {
                let (terms, value) = (offset(x, y), f64::from(view.at(x, y) - self.corner));
                all += 1.0;
                let is_off = |(plane, sigma): (Vector3<f64>, f64)| {
                    (value - plane.dot(&terms)).abs() > CLIP_SIGMAS * sigma
                };
                if value.is_nan() || plane.is_some_and(is_off) {
                    continue;
                }
                normal += terms * terms.transpose();
                right += terms * value;
                squares += value * value;
            }
            let used: f64 = normal[(0, 0)];
            if used < (MIN_SHARE * all).max(4.0) {
                return None;
            }
            let fitted = normal.cholesky()?.solve(&right);
            let variance = (squares - fitted.dot(&right)) / (used - 3.0);
            plane = Some((fitted, variance.max(0.0).sqrt()));
        }
        let (plane, _) = plane?;
        Some(Self {
            corner: self.corner + plane[0] as f32,
            across: plane[1] as f32,
            down: plane[2] as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::base::coords::PixelPoint;
    use crate::detect::{DetectConfig, Workspace, detect};
    use crate::frame::Frame;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

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
}
