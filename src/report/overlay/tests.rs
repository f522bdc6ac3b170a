//! Tests of pictures of drawn frames.

use super::*;
use crate::base::coords::{PixelPoint, Rotation, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::CameraModel;
use crate::catalog::StarIndex;
use crate::detect::DetectionFlags;
use crate::ephemeris::places::StarPlaces;
use crate::frame::Frame;
use crate::identify::{Identification, SearchFailure, SourceIndex, StarMatch};
use crate::report::figure::{DrawnShape, Rgb};
use crate::solve::sample;
use crate::solve::{Background, Measured, Outcome, Reason, Source};
use nalgebra::Matrix3;

const WIDTH: usize = 900;
const HEIGHT: usize = 700;

fn frame(width: usize, height: usize) -> Frame<'static> {
    let noise = |i: usize| 50.0 + ((i * 7919) % 101) as f32 * 0.1;
    Frame::new(width, height, (0..width * height).map(noise).collect()).unwrap()
}

fn source(x: f64, y: f64, flags: DetectionFlags) -> Source {
    Source {
        position: PixelPoint::new(x, y),
        measured: Some(Measured {
            sigma_px: [0.1, 0.1],
            peak: 100.0,
            snr: 20.0,
            flags,
        }),
        flux: Some(1000.0),
    }
}

fn solution(width: usize, height: usize, outcome: Outcome) -> Solution {
    let hot = DetectionFlags {
        hot_pixel: true,
        ..DetectionFlags::default()
    };
    let star = DetectionFlags::default();
    Solution {
        sources: vec![
            source(200.0, 300.0, star),
            source(500.0, 400.0, star),
            source(700.0, 100.0, hot),
        ],
        background: Some(Background {
            level_adu: 55.0,
            noise_adu: 2.9,
            sky_share: 1.0,
        }),
        ..sample::solution(width, height, outcome)
    }
}

/// An identification at RA 80°, Dec 30° with image-up at the position angle `up_deg`; the first
/// source is Sirius.
fn identified(up_deg: f64, mirrored: bool) -> Outcome {
    let boresight = UnitVector::from_ra_dec(80.0 * RAD_PER_DEG, 30.0 * RAD_PER_DEG);
    Outcome::Identified(Box::new(Identification {
        places: StarPlaces::default(),
        lens_is_known: false,
        camera: CameraModel::pinhole(WIDTH as f64, HEIGHT as f64, 3000.0, mirrored),
        icrs_to_camera: Rotation::looking_at(&boresight, up_deg * RAD_PER_DEG),
        attitude_covariance_rad2: Matrix3::identity() * 1e-10,
        focal_length_sigma_px: 0.1,
        centre_sigma_px: [0.0; 2],
        matches: vec![StarMatch {
            source: SourceIndex::new(0),
            star: StarIndex::new(0),
            light: boresight,
            residual_px: 0.1,
            p_chance: 1e-6,
        }],
        excess_sigma_px: 0.0,
        rms_px: 0.1,
        log10_false_alarm: -30.0,
    }))
}

fn not_identified() -> Outcome {
    Outcome::NotIdentified(Reason::Search(SearchFailure::TooFewStars {
        found: 2,
        needed: 4,
    }))
}

/// Number of pixels of about this color within a square around (x, y).
fn count(picture: &RgbImage, color: Rgb, [x, y]: [u32; 2], reach: u32) -> usize {
    let columns = x - reach..=x + reach;
    let rows = y - reach..=y + reach;
    rows.flat_map(|row| columns.clone().map(move |column| (column, row)))
        .filter(|&(column, row)| {
            let found = picture.get_pixel(column, row).0;
            (0..3).all(|i| found[i].abs_diff(color.0[i]) < 30)
        })
        .count()
}

/// A picture with all detections marked.
fn drawn(title: &str, frame: &Frame, solution: &Solution) -> RgbImage {
    let options = OverlayOptions {
        rings: Rings::All,
        ..OverlayOptions::default()
    };
    draw(
        &Shown::new(title, frame),
        solution,
        Catalog::built_in(),
        &options,
    )
}

#[test]
fn every_detection_is_marked_in_the_color_of_its_kind() {
    let frame = frame(WIDTH, HEIGHT);
    let solution = solution(WIDTH, HEIGHT, identified(0.0, false));
    let picture = drawn("a.tif", &frame, &solution);
    for (kind, center) in [
        (MarkKind::Identified, [200, 300]),
        (MarkKind::Unidentified, [500, 400]),
        (MarkKind::NotAStar, [700, 100]),
    ] {
        for other in [
            MarkKind::Identified,
            MarkKind::Unidentified,
            MarkKind::NotAStar,
        ] {
            let drawn = count(&picture, other.color(), center, 8);
            // A thin line mixes its color with the sky's.
            assert_eq!(
                drawn >= 3,
                other == kind,
                "{other:?} at {center:?}: {drawn}"
            );
        }
    }
    // Sirius is named to the right of its ring.
    let letters = MarkKind::Identified.color().lighter();
    assert!(count(&picture, letters, [250, 300], 30) > 15);
}

#[test]
fn a_frame_that_is_not_identified_is_drawn_as_well() {
    let frame = frame(WIDTH, HEIGHT);
    let solution = solution(WIDTH, HEIGHT, not_identified());
    let picture = drawn("a.tif", &frame, &solution);
    assert!(count(&picture, MarkKind::Unidentified.color(), [200, 300], 8) > 3);
    assert_eq!(
        count(&picture, MarkKind::Identified.color(), [200, 300], 8),
        0
    );
}

#[test]
fn frames_of_any_size_are_drawn() {
    for (width, height) in [(3, 3), (50, 1000), (1000, 4), (2600, 30), (9000, 3)] {
        for outcome in [not_identified(), identified(10.0, false)] {
            let solution = solution(width, height, outcome);
            let title = "a long name of a file, ".repeat(9);
            let picture = drawn(&title, &frame(width, height), &solution);
            assert!(picture.width() >= 460 && picture.height() > 76);
        }
    }
    let nothing = Solution {
        sources: Vec::new(),
        ..solution(100, 100, not_identified())
    };
    let black = Frame::new(100, 100, vec![0.0; 10_000]).unwrap();
    drawn("black", &black, &nothing);
}

#[test]
fn north_and_east_are_where_the_camera_sees_them() {
    let close =
        |found: [f32; 2], expected: [f32; 2]| (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-6);
    let (up, right, left) = ([0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]);
    for (up_deg, mirrored, north, east) in [
        (0.0, false, up, left),
        (0.0, true, up, right),
        // East is up.
        (90.0, false, right, up),
        (90.0, true, left, up),
    ] {
        let solution = solution(WIDTH, HEIGHT, identified(up_deg, mirrored));
        let [n, e] = legend::north_and_east(solution.outcome.identification().unwrap());
        assert!(
            close(n, north) && close(e, east),
            "{up_deg} {mirrored}: {n:?} {e:?}"
        );
    }
}

#[test]
fn a_picture_is_the_same_after_it_was_a_file() {
    let (frame, solution) = (
        frame(WIDTH, HEIGHT),
        solution(WIDTH, HEIGHT, identified(0.0, false)),
    );
    let shown = Shown::new("a.tif", &frame);
    let file = |format| {
        let options = OverlayOptions {
            format,
            ..OverlayOptions::default()
        };
        encoded(&shown, &solution, Catalog::built_in(), &options).unwrap()
    };
    let picture = draw(
        &shown,
        &solution,
        Catalog::built_in(),
        &OverlayOptions::default(),
    );
    let png = image::load_from_memory(&file(OverlayFormat::Png)).unwrap();
    assert_eq!(png.to_rgb8(), picture);
    let jpeg = image::load_from_memory(&file(OverlayFormat::Jpeg)).unwrap();
    assert_eq!(jpeg.to_rgb8().dimensions(), picture.dimensions());
    let svg = file(OverlayFormat::Svg);
    assert!(is_svg(&svg));
    let svg = String::from_utf8(svg).unwrap();
    assert!(svg.contains(">Sirius −1.4</text>") && svg.contains("data:image/jpeg"));
}

/// What is written on the picture of an identified frame.
fn texts(sky: SkyLayers, solution: &Solution) -> Vec<String> {
    let frame = frame(WIDTH, HEIGHT);
    let options = OverlayOptions {
        sky,
        ..OverlayOptions::default()
    };
    let (canvas, _) = drawing(
        &Shown::new("", &frame),
        solution,
        Catalog::built_in(),
        &options,
    );
    let texts = canvas.shapes.into_iter().filter_map(|shape| match shape {
        DrawnShape::Text(letters) => Some(letters.text),
        _ => None,
    });
    texts.collect()
}

#[test]
fn the_sky_is_drawn_where_it_is_wanted() {
    let auriga = solution(WIDTH, HEIGHT, identified(0.0, false));
    let none = SkyLayers::NONE;
    let wanted = SkyLayers {
        constellations: true,
        deep_sky: true,
        equatorial_grid: true,
        horizontal_grid: true,
    };
    let written = |text: &str, sky| texts(sky, &auriga).iter().any(|other| other == text);
    for text in ["M 36", "M 38", "+30°", "5h20m"] {
        assert!(
            written(text, wanted),
            "{text}: {:?}",
            texts(wanted, &auriga)
        );
        assert!(!written(text, none), "{text}");
    }
    // There is no site.
    assert!(
        !texts(wanted, &auriga)
            .iter()
            .any(|text| text.starts_with("alt"))
    );
    let nothing = texts(wanted, &solution(WIDTH, HEIGHT, not_identified()));
    assert!(!nothing.contains(&"M 36".to_owned()));
}

#[cfg(feature = "page")]
#[test]
fn layers_for_pages_are_in_pixels_of_the_frame() {
    let auriga = solution(WIDTH, HEIGHT, identified(0.0, false));
    let layers = serde_json::to_value(sky_layers(&auriga, Catalog::built_in())).unwrap();
    let keys: Vec<&str> = layers
        .as_array()
        .unwrap()
        .iter()
        .map(|layer| layer["key"].as_str().unwrap())
        .collect();
    // Without a site there is neither a horizon nor its grid.
    assert_eq!(keys, ["constellations", "deepsky", "equatorial"]);
    // The line of the centre's declination passes through the centre.
    let lines = layers[2]["lines"].as_array().unwrap();
    let centre = [(WIDTH - 1) as f64 / 2.0, (HEIGHT - 1) as f64 / 2.0];
    let distance = |point: &serde_json::Value| {
        (point[0].as_f64().unwrap() - centre[0]).hypot(point[1].as_f64().unwrap() - centre[1])
    };
    let points = lines.iter().flat_map(|line| line.as_array().unwrap());
    let nearest = points.map(distance).fold(f64::INFINITY, f64::min);
    assert!(nearest < 6.0, "{nearest}");
}
