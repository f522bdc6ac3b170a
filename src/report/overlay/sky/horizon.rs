//! Zenith, horizon and cardinal points, where site and time are known.

use super::view::PictureView;
use crate::base::units::RAD_PER_DEG;
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;

/// Color of the lines.
const COLOR: Rgb = Rgb([110, 170, 255]);
/// Size of the letters, in units of strokes.
const LETTERS: f32 = 17.0;
/// Half of the cross in the zenith, in units of strokes.
const CROSS: f32 = 9.0;
/// Azimuths of the cardinal points, in degrees.
const CARDINALS: [(&str, f64); 4] = [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)];
/// Distance of the points of the horizon, in degrees.
const STEP_DEG: u32 = 1;
/// Altitudes at which a cardinal point is written, the lowest that the frame sees, in degrees.
const LOWEST_DEG: std::ops::RangeInclusive<u32> = 1..=20;

/// Draws what of them is in the frame.
pub(super) fn draw(canvas: &mut Canvas, view: &PictureView<'_>) {
    let place = |azimuth_deg: f64, altitude_deg: f64| {
        let [azimuth_rad, altitude_rad] = [azimuth_deg, altitude_deg].map(|deg| deg * RAD_PER_DEG);
        view.apparent(&view.found.places.in_horizon(azimuth_rad, altitude_rad)?)
    };
    let horizon: Vec<_> = (0..=360)
        .step_by(STEP_DEG as usize)
        .map(|azimuth_deg| place(f64::from(azimuth_deg), 0.0))
        .collect();
    PictureView::draw_line(canvas, &horizon, 1.2, COLOR);
    for (letter, azimuth_deg) in CARDINALS {
        let mut seen = LOWEST_DEG.filter_map(|altitude| place(azimuth_deg, f64::from(altitude)));
        if let Some([x, y]) = seen.next() {
            let width = canvas.text_width(letter, LETTERS);
            let at = [x - width / 2.0, y + 0.36 * LETTERS * canvas.unit];
            canvas.text(letter, at, LETTERS, COLOR);
        }
    }
    if let Some([x, y]) = place(0.0, 90.0) {
        let arm = CROSS * canvas.unit;
        canvas.line(&[[x - arm, y], [x + arm, y]], 1.5, COLOR);
        canvas.line(&[[x, y - arm], [x, y + arm]], 1.5, COLOR);
    }
}
