//! Grids of right ascension and declination, and of azimuth and altitude.

use super::view::PictureView;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;
use crate::report::overlay::labels::Room;

const EQUATORIAL: Rgb = Rgb([110, 130, 145]);
const HORIZONTAL: Rgb = Rgb([150, 125, 105]);
/// Size of the letters, in units of strokes.
const LETTERS: f32 = 10.5;
/// Lines between the frame's centre and its corner.
const LINES: f64 = 2.0;
/// Distances of lines along meridians, in degrees.
const STEPS_DEG: [f64; 10] = [30.0, 15.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1, 0.05];
/// Distances of meridians of right ascension, in degrees: 2 h, 1 h, 30, 20, 10, 5, 2, 1 and half a minute.
const STEPS_OF_HOURS_DEG: [f64; 9] = [30.0, 15.0, 7.5, 5.0, 2.5, 1.25, 0.5, 0.25, 0.125];
/// Meridians end at this distance from a pole, in degrees.
const POLE_DEG: f64 = 1.0;

/// Draws right ascension and declination (ICRS).
pub(super) fn equatorial(canvas: &mut Canvas, view: &PictureView<'_>, room: &mut Room<'_>) {
    let (centre, _) = view.found.icrs_to_camera.boresight_and_up();
    let (ra_rad, dec_rad) = centre.to_ra_dec();
    let place = |ra_deg: f64, dec_deg: f64| {
        let direction =
            UnitVector::<Icrs>::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
        view.of_catalog(&direction)
    };
    let grid = CoordinateGrid {
        centre_deg: [ra_rad * DEG_PER_RAD, dec_rad * DEG_PER_RAD],
        steps_deg: [&STEPS_OF_HOURS_DEG, &STEPS_DEG],
        color: EQUATORIAL,
        longitude: hours,
        latitude: degrees,
    };
    grid.draw(canvas, view, &place, room);
}

/// Draws azimuth and altitude, where they are known.
pub(super) fn horizontal(canvas: &mut Canvas, view: &PictureView<'_>, room: &mut Room<'_>) {
    let places = &view.found.places;
    let (centre, _) = view.found.icrs_to_camera.boresight_and_up();
    let (Some(zenith), Some(north), Some(east)) = (
        places.zenith(),
        places.in_horizon(0.0, 0.0),
        places.in_horizon(90.0 * RAD_PER_DEG, 0.0),
    ) else {
        return;
    };
    let azimuth_rad = libm::atan2(centre.dot(&east), centre.dot(&north));
    let altitude_rad = libm::asin(centre.dot(zenith).clamp(-1.0, 1.0));
    let place = |azimuth_deg: f64, altitude_deg: f64| {
        let [azimuth_rad, altitude_rad] = [azimuth_deg, altitude_deg].map(|deg| deg * RAD_PER_DEG);
        view.apparent(&places.in_horizon(azimuth_rad, altitude_rad)?)
    };
    let grid = CoordinateGrid {
        centre_deg: [azimuth_rad * DEG_PER_RAD, altitude_rad * DEG_PER_RAD],
        steps_deg: [&STEPS_DEG, &STEPS_DEG],
        color: HORIZONTAL,
        longitude: |deg| format!("az {deg}°"),
        latitude: |deg| format!("alt {deg}°"),
    };
    grid.draw(canvas, view, &place, room);
}

/// A right ascension.
fn hours(deg: f64) -> String {
    let seconds = (deg * 240.0).round() as i64;
    let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match (minute, second) {
        (0, 0) => format!("{hour}h"),
        (_, 0) => format!("{hour}h{minute:02}m"),
        _ => format!("{hour}h{minute:02}m{second:02}s"),
    }
}

/// A declination.
fn degrees(deg: f64) -> String {
    if deg == 0.0 {
        return "0°".to_owned();
    }
    format!("{deg:+}°").replace('-', "−")
}

/// A grid of longitudes and latitudes.
struct CoordinateGrid<'a> {
    /// Longitude and latitude of the frame's centre.
    centre_deg: [f64; 2],
    /// Distances of lines that the grid may have, largest first.
    steps_deg: [&'a [f64]; 2],
    color: Rgb,
    /// What is written beside lines.
    longitude: fn(f64) -> String,
    latitude: fn(f64) -> String,
}

impl CoordinateGrid<'_> {
    fn draw(
        &self,
        canvas: &mut Canvas,
        view: &PictureView<'_>,
        place: &impl Fn(f64, f64) -> Option<[f32; 2]>,
        room: &mut Room<'_>,
    ) {
        let reach_deg = view.found.camera.radius_rad() * DEG_PER_RAD;
        let [longitude, latitude] = self.centre_deg;
        let (south, north) = (
            (latitude - reach_deg).max(-90.0 + POLE_DEG),
            (latitude + reach_deg).min(90.0 - POLE_DEG),
        );
        // Meridians are closest on the side of the nearer pole.
        let narrowest = libm::cos(south.abs().max(north.abs()) * RAD_PER_DEG);
        let wide = latitude.abs() + reach_deg > 85.0;
        let reach_longitude = if wide {
            180.0
        } else {
            (reach_deg / narrowest).min(180.0)
        };
        let middle = libm::cos(latitude * RAD_PER_DEG).max(0.1);
        let [step_longitude, step_latitude] = [
            step(self.steps_deg[0], reach_deg / middle),
            step(self.steps_deg[1], reach_deg),
        ];
        let point_deg = view.step_rad() * DEG_PER_RAD;
        for line in multiples(
            longitude - reach_longitude,
            longitude + reach_longitude,
            step_longitude,
        ) {
            let points = between(south, north, point_deg).map(|at| place(line, at));
            let text = (self.longitude)(line.rem_euclid(360.0));
            self.draw_line(canvas, &points.collect::<Vec<_>>(), &text, room);
        }
        let along_deg = point_deg / narrowest.max(0.05);
        for line in multiples(south, north, step_latitude) {
            let (from, to) = (longitude - reach_longitude, longitude + reach_longitude);
            let points = between(from, to, along_deg).map(|at| place(at, line));
            self.draw_line(
                canvas,
                &points.collect::<Vec<_>>(),
                &(self.latitude)(line),
                room,
            );
        }
    }

    /// Draws what is visible of a line, and its value where it begins.
    fn draw_line(
        &self,
        canvas: &mut Canvas,
        places: &[Option<[f32; 2]>],
        text: &str,
        room: &mut Room<'_>,
    ) {
        PictureView::draw_line(canvas, places, 0.7, self.color);
        let parts = PictureView::visible(places);
        let ends = parts
            .iter()
            .flat_map(|part| [part[0], part[part.len() - 1]]);
        let mut free = ends.filter_map(|end| room.beside(text, end, 0.0, LETTERS));
        if let Some(at) = free.next() {
            canvas.text(text, at, LETTERS, self.color.lighter());
        }
    }
}

/// The largest step that gives enough lines.
fn step(steps_deg: &[f64], reach_deg: f64) -> f64 {
    let enough = steps_deg.iter().find(|step| reach_deg / **step >= LINES);
    enough.or(steps_deg.last()).copied().unwrap_or(1.0)
}

/// The multiples of `step` between two values; those of a whole turn once.
fn multiples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    let turn = (360.0 / step).round() as i64;
    (first..=last.min(first + turn - 1)).map(move |i| i as f64 * step)
}

/// Values from one to another, at most `step` apart.
fn between(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let count = ((to - from) / step).ceil().max(1.0) as u32;
    (0..=count).map(move |i| from + (to - from) * f64::from(i) / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_written_as_people_do() {
        for (deg, text) in [
            (0.0, "0h"),
            (82.5, "5h30m"),
            (0.125, "0h00m30s"),
            (345.0, "23h"),
        ] {
            assert_eq!(hours(deg), text);
        }
        for (deg, text) in [(30.0, "+30°"), (-7.5, "−7.5°"), (0.0, "0°"), (-0.0, "0°")] {
            assert_eq!(degrees(deg), text);
        }
    }

    #[test]
    fn a_grid_has_a_few_lines_at_any_scale() {
        for reach_deg in [0.1, 0.7, 3.0, 10.0, 45.0, 90.0] {
            let step = step(&STEPS_DEG, reach_deg);
            let lines = 2.0 * reach_deg / step;
            assert!((4.0..16.0).contains(&lines), "{reach_deg}: {lines}");
        }
        let all: Vec<f64> = multiples(-180.0, 180.0, 30.0).collect();
        assert_eq!(all.len(), 12);
    }
}
