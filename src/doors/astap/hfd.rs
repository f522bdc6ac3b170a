//! How sharp are the stars? Their half-flux diameters.
//!
//! The half-flux diameter is that of a circle with half of a star's light. ASTAP takes twice the mean distance from
//! the centroid, weighted with the light, which is 2.51 σ of a Gaussian, where half of the light is within 2.35 σ;
//! and so does this, so that curves of focus go on.
//!
//! # Reference
//! K. Miyashita, "Half flux diameter"; <https://en.wikipedia.org/wiki/Half_flux_diameter>.

use crate::base::coords::PixelPoint;
use crate::base::statistics::median_of;
use crate::base::units::DEG_PER_RAD;
use crate::frame::{Frame, RowOrder};
use crate::identify::Identification;
use crate::solve::Source;
use std::fmt::Write;

/// Diameters that a star can have, in pixels.
const DIAMETERS_PX: [f64; 2] = [0.8, 30.0];
/// Signal over noise of stars, where the caller states none.
const USUAL_SNR: f64 = 30.0;

/// A star with its diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SharpStar {
    /// Column and row, from 1.
    pixel: [f64; 2],
    hfd_px: f64,
    snr: f64,
    flux: f64,
    /// Right ascension and declination, in degrees.
    sky_deg: Option<[f64; 2]>,
}

/// The stars of a frame with their diameters, brightest first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StarList {
    stars: Vec<SharpStar>,
}

impl StarList {
    /// Those among `sources` with more signal over noise than `min_snr`, or than is usual if that is 0; rows are in
    /// this order.
    pub fn measure(frame: &Frame, sources: &[Source], rows: RowOrder, min_snr: f64) -> Self {
        let min_snr = if min_snr > 0.0 { min_snr } else { USUAL_SNR };
        let star = |source: &Source| {
            let measured = source.measured?;
            let flags = measured.flags;
            let is_star = !(flags.hot_pixel || flags.trail || flags.border);
            if !is_star || measured.snr <= min_snr {
                return None;
            }
            let hfd_px = half_flux_diameter_px(frame, &source.position)?;
            let PixelPoint { x, y } = source.position;
            let y = match rows {
                RowOrder::TopDown => y + 1.0,
                RowOrder::BottomUp => frame.height as f64 - y,
            };
            Some(SharpStar {
                pixel: [x + 1.0, y],
                hfd_px,
                snr: measured.snr,
                flux: source.flux?,
                sky_deg: None,
            })
        };
        Self {
            stars: sources.iter().filter_map(star).collect(),
        }
    }

    /// The same with directions, where the frame is identified.
    #[must_use]
    pub fn with_directions(mut self, found: &Identification, rows: RowOrder) -> Self {
        for star in &mut self.stars {
            let [x, y] = star.pixel;
            let y = match rows {
                RowOrder::TopDown => y - 1.0,
                RowOrder::BottomUp => found.camera.height_px - y,
            };
            let direction = found.direction_of(&PixelPoint::new(x - 1.0, y));
            star.sky_deg = direction.map(|sky| {
                let (ra_rad, dec_rad) = sky.to_ra_dec();
                [ra_rad, dec_rad].map(|rad| rad * DEG_PER_RAD)
            });
        }
        self
    }

    /// The lines that ASTAP prints.
    pub fn lines(&self) -> String {
        /// That of a frame without stars.
        const NONE_PX: f64 = 99.0;
        let median_px = median_of(self.stars.iter().map(|star| star.hfd_px)).unwrap_or(NONE_PX);
        format!("HFD_MEDIAN={median_px:.1}\nSTARS={}\n", self.stars.len())
    }

    /// The table.
    pub fn csv(&self) -> String {
        let mut text = "x,y,hfd,snr,flux".to_owned();
        if self.stars.iter().any(|star| star.sky_deg.is_some()) {
            text += ",ra[0..360],dec[0..360]";
        }
        text.push('\n');
        for star in &self.stars {
            let SharpStar {
                pixel: [x, y],
                hfd_px,
                snr,
                flux,
                ..
            } = star;
            // Writing to a string does not fail.
            let _ = write!(text, "{x:.4},{y:.4},{hfd_px:.4},{snr:.0},{flux:.0}");
            if let Some([ra_deg, dec_deg]) = star.sky_deg {
                let _ = write!(text, ",{ra_deg:.8},{dec_deg:.8}");
            }
            text.push('\n');
        }
        text
    }
}

/// The half-flux diameter of a star in pixels; `None` where it has no light, is too near to the border, or is too
/// wide or too narrow for a star.
fn half_flux_diameter_px(frame: &Frame, centre: &PixelPoint) -> Option<f64> {
    /// Radius with nearly all light, in diameters: 3.8 σ of a Gaussian.
    const RADIUS: f64 = 1.5;
    const FIRST_RADIUS_PX: f64 = 4.0;
    const ROUNDS: usize = 8;
    let mut radius_px = FIRST_RADIUS_PX;
    let mut diameter_px = within(frame, centre, radius_px)?;
    // The circle grows as long as the star does: a large one has neighbors and noise in it.
    for _ in 0..ROUNDS {
        let next_px = (RADIUS * diameter_px).max(FIRST_RADIUS_PX);
        if (next_px - radius_px).abs() < 0.1 {
            break;
        }
        radius_px = next_px;
        diameter_px = within(frame, centre, radius_px)?;
    }
    let [least, most] = DIAMETERS_PX;
    (least..=most).contains(&diameter_px).then_some(diameter_px)
}

/// Twice the mean distance of the light within a radius.
fn within(frame: &Frame, centre: &PixelPoint, radius_px: f64) -> Option<f64> {
    /// Smallest inner radius of the ring that the background is measured in, and its width, in pixels.
    const RING_PX: [f64; 2] = [14.0, 5.0];
    let inner_px = RING_PX[0].max(radius_px + 1.0);
    let outer_px = inner_px + RING_PX[1];
    let range = |middle: f64, side: usize| {
        let (low, high) = ((middle - outer_px).ceil(), (middle + outer_px).floor());
        let is_inside = low >= 0.0 && high < side as f64;
        is_inside.then_some(low as usize..=high as usize)
    };
    let (columns, rows) = (
        range(centre.x, frame.width)?,
        range(centre.y, frame.height)?,
    );
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| {
        let distance = libm::hypot(x as f64 - centre.x, y as f64 - centre.y);
        (distance, f64::from(frame.at(x, y)))
    });
    let pixels: Vec<(f64, f64)> = pixels.filter(|(_, level)| level.is_finite()).collect();
    let ring = pixels
        .iter()
        .filter(|(distance, _)| (inner_px..outer_px).contains(distance));
    let background = median_of(ring.map(|(_, level)| *level))?;
    let (mut total, mut moment) = (0.0, 0.0);
    for (distance, level) in pixels.iter().filter(|(distance, _)| *distance < radius_px) {
        total += level - background;
        moment += (level - background) * distance;
    }
    (total > 0.0 && moment > 0.0).then(|| 2.0 * moment / total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::{DetectConfig, Workspace, detect};

    /// A frame with stars of this form: level at a distance.
    fn frame(stars: &[(f64, f64)], form: impl Fn(f64) -> f64) -> Frame<'static> {
        let (width, height) = (160, 120);
        let pixel = |place: usize| {
            let (x, y) = ((place % width) as f64, (place / width) as f64);
            let light = stars.iter().map(|(sx, sy)| form((x - sx).hypot(y - sy)));
            let noise = (place * 7919 % 101) as f64 * 0.1;
            (1000.0 + noise + light.sum::<f64>()) as f32
        };
        Frame::new(width, height, (0..width * height).map(pixel).collect()).unwrap()
    }

    #[test]
    fn diameters_are_those_of_the_forms() {
        let at = PixelPoint::new(80.3, 60.4);
        for sigma in [1.0, 1.5, 3.0] {
            let gaussian = |r: f64| 20_000.0 * (-0.5 * (r / sigma).powi(2)).exp();
            let found = half_flux_diameter_px(&frame(&[(at.x, at.y)], gaussian), &at).unwrap();
            let expected = (2.0 * std::f64::consts::PI).sqrt() * sigma;
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{sigma}: {found} {expected}"
            );
        }
        // Out of focus, a disk, whose mean distance is a third of its diameter.
        let disk = |r: f64| if r < 9.0 { 2000.0 } else { 0.0 };
        let found = half_flux_diameter_px(&frame(&[(at.x, at.y)], disk), &at).unwrap();
        assert!((found / 12.0 - 1.0).abs() < 0.02, "{found}");
        // No light, and no room.
        let empty = frame(&[], |_| 0.0);
        assert_eq!(
            half_flux_diameter_px(&empty, &PixelPoint::new(5.0, 60.0)),
            None
        );
    }

    #[test]
    fn a_list_has_the_columns_of_astap() {
        let gaussian = |r: f64| 20_000.0 * (-0.5 * (r / 1.5).powi(2)).exp();
        let frame = frame(&[(40.0, 30.0), (120.0, 80.0)], gaussian);
        let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new()).unwrap();
        let sources: Vec<Source> = found.sources.iter().map(Source::from).collect();
        let list = StarList::measure(&frame, &sources, RowOrder::BottomUp, 0.0);
        let lines = list.lines();
        let (median, count) = lines.trim_end().split_once('\n').unwrap();
        let median_px: f64 = median["HFD_MEDIAN=".len()..].parse().unwrap();
        assert!((median_px - 3.76).abs() < 0.1, "{median}");
        assert_eq!(count, "STARS=2");
        let csv = list.csv();
        assert!(csv.starts_with("x,y,hfd,snr,flux\n"));
        let mut places: Vec<[i32; 2]> = Vec::new();
        for line in csv.lines().skip(1) {
            let values: Vec<f64> = line
                .split(',')
                .map(|value| value.parse().unwrap())
                .collect();
            assert_eq!(values.len(), 5);
            places.push([values[0].round() as i32, values[1].round() as i32]);
        }
        places.sort_unstable();
        assert_eq!(places, [[41, 90], [121, 40]]);
        let none = StarList::measure(&frame, &sources, RowOrder::BottomUp, 1e9);
        assert_eq!(none.lines(), "HFD_MEDIAN=99.0\nSTARS=0\n");
    }
}
