//! Orientation, tested with frames drawn by independent code: mirrored frames, the poles, RA 0h,
//! corners, half a pixel.

use crate::common::drawing::{Picture, View, bright_stars, save};
use crate::common::{Ran, number, starpipe};
use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// Tolerance of the centre in pixels: an error of half a pixel would fail.
const CENTRE_TOLERANCE_PX: f64 = 0.1;
/// Tolerance of the corners, where fitted scale and roll matter, too.
const CORNER_TOLERANCE_PX: f64 = 0.2;
/// Tolerance of the position of a star above V 5.5, with an SNR of 200.
const STAR_TOLERANCE_PX: f64 = 0.1;
/// Stars closer than this shift each other's measured positions.
const CLOSE_PX: f64 = 12.0;
/// Tolerance of directions: the catalogue's CSV and the report have the same numbers.
const SAME_DIRECTION_DEG: f64 = 1e-5;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 400;

fn view(ra_deg: f64, dec_deg: f64, up_pa_deg: f64, mirrored: bool) -> View {
    View {
        ra_deg,
        dec_deg,
        up_pa_deg,
        fov_deg: 30.0,
        width: WIDTH,
        height: HEIGHT,
        mirrored,
    }
}

fn unit((ra_deg, dec_deg): (f64, f64)) -> [f64; 3] {
    let (ra, dec) = (ra_deg.to_radians(), dec_deg.to_radians());
    [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()]
}

pub fn angle_deg(a: (f64, f64), b: (f64, f64)) -> f64 {
    let (a, b) = (unit(a), unit(b));
    let chord_sq: f64 = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum();
    2.0 * (chord_sq.sqrt() / 2.0).asin().to_degrees()
}

/// The numbers of the first header of a FITS file by keyword.
pub fn header(path: &Path) -> HashMap<String, f64> {
    let bytes = fs::read(path).unwrap();
    assert_eq!(bytes.len() % 2880, 0);
    let cards = bytes
        .chunks(80)
        .take_while(|card| !card.starts_with(b"END     "))
        .map(|card| std::str::from_utf8(card).unwrap());
    cards
        .filter(|card| &card[8..10] == "= ")
        .filter_map(|card| {
            let value = card[10..].split('/').next().unwrap().trim();
            Some((card[..8].trim().to_owned(), value.parse().ok()?))
        })
        .collect()
}

/// The direction in degrees of the FITS pixel (x, y) by a header, by the formulas of the `TAN`
/// projection and SIP.
pub fn header_direction(header: &HashMap<String, f64>, x: f64, y: f64) -> (f64, f64) {
    let value = |keyword: &str| header.get(keyword).copied().unwrap_or(0.0);
    let (u, v) = (x - value("CRPIX1"), y - value("CRPIX2"));
    let distortion = |name: &str| {
        let order = value(&format!("{name}_ORDER")) as i32;
        let terms = (0..=order).flat_map(|p| (0..=order - p).map(move |q| (p, q)));
        terms
            .map(|(p, q)| value(&format!("{name}_{p}_{q}")) * u.powi(p) * v.powi(q))
            .sum::<f64>()
    };
    let (u, v) = (u + distortion("A"), v + distortion("B"));
    let xi = (value("CD1_1") * u + value("CD1_2") * v).to_radians();
    let eta = (value("CD2_1") * u + value("CD2_2") * v).to_radians();
    let (sin_0, cos_0) = value("CRVAL2").to_radians().sin_cos();
    let down = cos_0 - eta * sin_0;
    let ra_deg = value("CRVAL1") + xi.atan2(down).to_degrees();
    let dec_deg = (sin_0 + eta * cos_0).atan2(xi.hypot(down)).to_degrees();
    (ra_deg.rem_euclid(360.0), dec_deg)
}

/// q v q*, written out.
fn turned([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let once = cross([x, y, z], v);
    let twice = cross([x, y, z], once);
    std::array::from_fn(|i| v[i] + 2.0 * w * once[i] + 2.0 * twice[i])
}

struct Solved {
    view: View,
    report: Value,
    header: HashMap<String, f64>,
}

impl Solved {
    fn new(view: View) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let path = save(
            &view.picture(&bright_stars()),
            directory.path(),
            "drawn.png",
        );
        Self::of_file(view, &path, &[])
    }

    /// The picture of `view` in the file `path`, solved with more options.
    fn of_file(view: View, path: &Path, options: &[&str]) -> Self {
        let out = tempfile::tempdir().unwrap();
        let mut command = starpipe();
        command.args(["process", "--format", "json"]).args(options);
        let ran = Ran::new(command.arg("--out").args([out.path(), path]));
        let report = ran.reports().remove(0);
        assert_eq!(
            ran.status, 0,
            "{view:?}: {}{}",
            report["reason"], ran.stderr
        );
        Self {
            view,
            report,
            header: header(&out.path().join("drawn.wcs")),
        }
    }

    fn pixel_deg(&self) -> f64 {
        let half_width = f64::from(self.view.width) / 2.0;
        (1.0 / half_width * (self.view.fov_deg.to_radians() / 2.0).tan()).to_degrees()
    }

    fn check_all(&self) {
        self.check_attitude();
        self.check_stars();
        self.check_header();
        assert_eq!(self.report["optics"]["mirrored"], self.view.mirrored);
    }

    fn check_attitude(&self) {
        let (view, report) = (&self.view, &self.report);
        let at = |name: &str| number(report, &format!("/attitude/{name}"));
        let off_px = angle_deg((at("ra_deg"), at("dec_deg")), (view.ra_deg, view.dec_deg))
            / self.pixel_deg();
        assert!(
            off_px < CENTRE_TOLERANCE_PX,
            "{view:?}: centre off by {off_px} px"
        );
        let quaternion: [f64; 4] = std::array::from_fn(|i| at(&format!("quaternion/{i}")));
        let length_sq: f64 = quaternion.iter().map(|q| q * q).sum();
        assert!(
            (length_sq - 1.0).abs() < 1e-8 && quaternion[0] >= 0.0,
            "{quaternion:?}"
        );
        // The quaternion turns the axes on the sky into the camera's x, y and z.
        for (k, axis) in view.axes().into_iter().enumerate() {
            let camera = turned(quaternion, axis);
            let off = (0..3).map(|i| (camera[i] - f64::from(u8::from(i == k))).powi(2));
            let off_px = off.sum::<f64>().sqrt().to_degrees() / self.pixel_deg();
            assert!(
                off_px < CORNER_TOLERANCE_PX,
                "{view:?}: axis {k} off by {off_px} px"
            );
        }
        // At a pole, the angle from north depends on the meridian of the centre.
        if view.dec_deg.abs() < 89.9 {
            let turn_deg = (at("up_pa_deg") - view.up_pa_deg + 180.0).rem_euclid(360.0) - 180.0;
            let off_px = turn_deg.to_radians().abs() * f64::from(view.width) / 2.0;
            assert!(
                off_px < CORNER_TOLERANCE_PX,
                "{view:?}: up off by {turn_deg}°"
            );
        }
    }

    /// Asserts that every bright star has the position and the identity that it was drawn with.
    fn check_stars(&self) {
        let view = &self.view;
        let mut checked = 0;
        let drawn = view.stars(&bright_stars());
        for &(star, x, y) in &drawn {
            let near = |&&(_, other_x, other_y): &&(_, f64, f64)| {
                (other_x - x).hypot(other_y - y) < CLOSE_PX
            };
            if drawn.iter().filter(near).count() > 1 {
                continue;
            }
            let inside = |at: f64, side: u32| (6.0..f64::from(side) - 7.0).contains(&at);
            if star.v_mag > 5.5 || !inside(x, view.width) || !inside(y, view.height) {
                continue;
            }
            let stars = self.report["stars"].as_array().unwrap();
            let same = |found: &&Value| {
                let value = |name: &str| found[name].as_f64();
                value("ra_deg")
                    .zip(value("dec_deg"))
                    .is_some_and(|direction| {
                        angle_deg(direction, (star.ra_deg, star.dec_deg)) < SAME_DIRECTION_DEG
                    })
            };
            let found = stars.iter().find(same);
            let found = found.unwrap_or_else(|| panic!("{view:?}: {star:?} is not named"));
            let value = |name: &str| found[name].as_f64().unwrap();
            let off_px = (value("x") - x).hypot(value("y") - y);
            assert!(
                off_px < STAR_TOLERANCE_PX,
                "{view:?}: {star:?} off by {off_px} px"
            );
            checked += 1;
        }
        assert!(checked >= 5, "{view:?}: {checked} stars");
    }

    fn check_header(&self) {
        let view = &self.view;
        let (right, bottom) = (f64::from(view.width) - 1.0, f64::from(view.height) - 1.0);
        for x in [0.0, right / 2.0, right] {
            for y in [0.0, bottom / 2.0, bottom] {
                let found = header_direction(&self.header, x + 1.0, y + 1.0);
                let off_px = angle_deg(found, view.direction(x, y)) / self.pixel_deg();
                assert!(
                    off_px < CORNER_TOLERANCE_PX,
                    "{view:?}: ({x}, {y}) off by {off_px} px"
                );
            }
        }
    }
}

/// Checks the drawing by hand: upright, towards the equinox, 45° wide in 101 pixels.
#[test]
fn the_drawing_has_north_up_east_left_and_its_centre_in_the_middle() {
    let mut view = View {
        fov_deg: 90.0,
        width: 101,
        height: 101,
        ..view(0.0, 0.0, 0.0, false)
    };
    let close = |found: Option<(f64, f64)>, (x, y): (f64, f64)| {
        let (found_x, found_y) = found.unwrap();
        assert!(
            (found_x - x).hypot(found_y - y) < 1e-9,
            "({found_x}, {found_y})"
        );
    };
    close(view.pixel(0.0, 0.0), (50.0, 50.0));
    // The edge is half a pixel beyond the last pixel's centre.
    close(view.pixel(45.0, 0.0), (-0.5, 50.0));
    close(view.pixel(0.0, 45.0), (50.0, -0.5));
    view.mirrored = true;
    close(view.pixel(45.0, 0.0), (100.5, 50.0));
    view.mirrored = false;
    view.up_pa_deg = 90.0;
    // East is up, so north is to the right.
    close(view.pixel(0.0, 45.0), (100.5, 50.0));
    let (ra_deg, dec_deg) = view.direction(100.5, 50.0);
    assert!(angle_deg((ra_deg, dec_deg), (0.0, 45.0)) < 1e-9);
}

#[test]
fn upright_and_turned_frames_are_where_they_were_drawn() {
    for (ra_deg, dec_deg, up_pa_deg) in [(83.0, 0.0, 0.0), (83.0, 0.0, 90.0), (200.0, 50.0, -137.0)]
    {
        Solved::new(view(ra_deg, dec_deg, up_pa_deg, false)).check_all();
    }
}

#[test]
fn mirrored_frames_are_where_they_were_drawn() {
    for (ra_deg, dec_deg, up_pa_deg) in [(83.0, 0.0, 0.0), (83.0, 0.0, 90.0), (310.0, 40.0, 33.0)] {
        Solved::new(view(ra_deg, dec_deg, up_pa_deg, true)).check_all();
    }
}

#[test]
fn frames_on_and_near_the_poles_are_where_they_were_drawn() {
    for (dec_deg, up_pa_deg, mirrored) in [
        (90.0, 20.0, false),
        (90.0, -70.0, true),
        (-90.0, 160.0, false),
        (-90.0, 0.0, true),
        (88.0, 45.0, false),
        (-88.0, 45.0, false),
    ] {
        Solved::new(view(120.0, dec_deg, up_pa_deg, mirrored)).check_all();
    }
}

#[test]
fn frames_across_the_line_of_0h_are_where_they_were_drawn() {
    for (ra_deg, dec_deg) in [(0.0, 20.0), (359.99, -10.0), (0.01, 60.0)] {
        Solved::new(view(ra_deg, dec_deg, 12.0, false)).check_all();
    }
}

/// Writes the rows of a detector as a TIFF file with an `Orientation`.
fn save_stored(rows: &Picture, orientation: u16, path: &Path) {
    use tiff::encoder::TiffEncoder;
    use tiff::encoder::colortype::Gray16;
    let mut encoder = TiffEncoder::new(fs::File::create(path).unwrap()).unwrap();
    let image = encoder.new_image::<Gray16>(rows.width(), rows.height());
    let mut image = image.unwrap();
    let tag = tiff::tags::Tag::Orientation;
    image.encoder().write_tag(tag, orientation).unwrap();
    image.write_data(rows.as_raw()).unwrap();
}

#[test]
fn a_picture_that_its_file_turns_is_where_it_was_drawn() {
    use image::imageops::{flip_vertical, rotate90, rotate180, rotate270};
    let portrait = View {
        width: HEIGHT,
        height: WIDTH,
        fov_deg: 20.0,
        ..view(280.0, -25.0, 75.0, false)
    };
    let picture = portrait.picture(&bright_stars());
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("drawn.tif");
    for (orientation, rows) in [
        (3, rotate180(&picture)),
        (6, rotate270(&picture)),
        (7, flip_vertical(&rotate90(&picture))),
        (8, rotate90(&picture)),
    ] {
        save_stored(&rows, orientation, &path);
        let solved = Solved::of_file(portrait, &path, &[]);
        solved.check_all();
        let notes = solved.report["notes"].to_string();
        let stated = format!("(Orientation {orientation})");
        assert!(notes.contains(&stated), "{notes}");
    }
}

#[test]
fn a_turned_picture_is_calibrated_in_the_rows_of_its_file() {
    const PEDESTAL_ADU: u16 = 100;
    let portrait = View {
        width: HEIGHT,
        height: WIDTH,
        fov_deg: 20.0,
        ..view(280.0, -25.0, 75.0, false)
    };
    let mut rows = image::imageops::rotate270(&portrait.picture(&bright_stars()));
    // Bright columns of the detector, which the dark has, too: rows of the picture.
    let mut dark = Picture::new(rows.width(), rows.height());
    for (x, _, level) in dark.enumerate_pixels_mut() {
        let is_bright = x.is_multiple_of(16);
        level.0[0] = PEDESTAL_ADU + if is_bright { 3000 } else { 0 };
    }
    for (level, dark) in rows.pixels_mut().zip(dark.pixels()) {
        level.0[0] = level.0[0].saturating_add(dark.0[0] - PEDESTAL_ADU);
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("drawn.tif");
    save_stored(&rows, 6, &path);
    let master = save(&dark, directory.path(), "dark.png");
    // The last column and row of the detector.
    let list = directory.path().join("hot.csv");
    let (x, y) = (rows.width() - 1, rows.height() - 1);
    fs::write(&list, format!("x,y\n{x},{y}\n")).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let options = ["--dark", &text(&master), "--hot-pixels", &text(&list)];
    let solved = Solved::of_file(portrait, &path, &options);
    solved.check_attitude();
    solved.check_stars();
}

#[test]
fn portrait_frames_are_where_they_were_drawn() {
    let portrait = View {
        width: HEIGHT,
        height: WIDTH,
        fov_deg: 20.0,
        ..view(280.0, -25.0, 75.0, false)
    };
    Solved::new(portrait).check_all();
}
