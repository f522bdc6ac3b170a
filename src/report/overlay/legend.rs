//! The strip below the frame: what it shows, name, field, counts, scale bar and compass.

use super::canvas::{Canvas, STRIP_HEIGHT as HEIGHT};
use super::mark::{Mark, MarkKind};
use super::picture::Picture;
use crate::base::format::{counted, degrees, hours};
use crate::base::size::Size;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::CameraModel;
use crate::ephemeris::places::AttitudeFrame;
use crate::identify::Identification;
use crate::report::figure::{Rgb, text_width};
use crate::solve::Solution;

// Lengths are in units of strokes.

/// Smallest width of the strip, also below a narrow frame.
const MIN_WIDTH: f32 = 460.0;
/// Size of letters.
const LETTERS: f32 = 13.0;
/// Space around the contents.
const PADDING: f32 = 10.0;
/// Distance of the lines of text.
const LINE: f32 = 20.0;
/// Largest length of the scale bar, and as a share of the picture's width.
const BAR: f32 = 150.0;
const BAR_FRACTION: f32 = 0.3;
/// Between the text and the scale bar.
const GAP: f32 = 24.0;
/// Side of the square with the arrows.
const COMPASS: f32 = 72.0;

/// Lengths of the scale bar in arcseconds, and their names.
const LENGTHS: [(f64, &str); 20] = [
    (72_000.0, "20°"),
    (36_000.0, "10°"),
    (18_000.0, "5°"),
    (7_200.0, "2°"),
    (3_600.0, "1°"),
    (1_800.0, "30′"),
    (1_200.0, "20′"),
    (600.0, "10′"),
    (300.0, "5′"),
    (120.0, "2′"),
    (60.0, "1′"),
    (30.0, "30″"),
    (20.0, "20″"),
    (10.0, "10″"),
    (5.0, "5″"),
    (2.0, "2″"),
    (1.0, "1″"),
    (0.5, "0.5″"),
    (0.2, "0.2″"),
    (0.1, "0.1″"),
];

/// Size of the whole picture, frame and strip; the strip grows with a `sentence` that takes more than a line.
pub(super) fn size(picture: &Picture, unit: f32, sentence: Option<&str>) -> Size {
    let width = picture.width.max((MIN_WIDTH * unit) as usize);
    let lines = match sentence {
        Some(text) if !picture.is_cut() => wrapped(text, text_room(width as f32 / unit)).len(),
        _ => 1,
    };
    let height = HEIGHT + LINE * (lines - 1) as f32;
    Size::new(width, picture.height + (height * unit) as usize)
}

/// Width of the text in a strip of this width, beside scale and compass, in units.
fn text_room(width: f32) -> f32 {
    let scale = BAR.min(BAR_FRACTION * width);
    width - 2.0 * PADDING - COMPASS - scale - GAP
}

/// `text` in lines of at most `width` units.
fn wrapped(text: &str, width: f32) -> Vec<String> {
    const MOST: usize = 3;
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let longer = match lines.last().map_or("", String::as_str) {
            "" => word.to_owned(),
            line => format!("{line} {word}"),
        };
        if text_width(&longer, LETTERS) <= width || lines.len() == MOST {
            lines.pop();
            lines.push(longer);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// Draws the strip.
pub(super) fn draw(
    canvas: &mut Canvas,
    picture: &Picture,
    (title, sentence): (&str, Option<&str>),
    solution: &Solution,
    marks: &[Mark],
) {
    let top = picture.height as f32;
    let left = PADDING * canvas.unit;
    let mut right = canvas.width() - PADDING * canvas.unit;
    if picture.is_cut() {
        let room = (right - left) / canvas.unit;
        let lines = wrapped(sentence.unwrap_or(title), room);
        draw_lines(canvas, [left, top], room, &lines);
        return;
    }
    let room = text_room(canvas.width() / canvas.unit);
    if let Some(found) = solution.outcome.identification() {
        right -= COMPASS * canvas.unit;
        let centre = [
            right + COMPASS * canvas.unit / 2.0,
            top + HEIGHT * canvas.unit / 2.0,
        ];
        draw_compass(canvas, centre, found);
        right = draw_scale(canvas, picture, [right, top], found) - GAP * canvas.unit;
    }
    let field = field_line(solution);
    let lines = match sentence {
        Some(sentence) => {
            let mut lines = wrapped(sentence, room);
            lines.push(format!("{title} · {field}"));
            lines
        }
        None => vec![title.to_owned(), field],
    };
    draw_lines(canvas, [left, top], (right - left) / canvas.unit, &lines);
    let below = [left, baseline(canvas, top, lines.len())];
    draw_counts(canvas, below, right, marks);
}

/// Draws lines of text, the last of several dimmer.
fn draw_lines(canvas: &mut Canvas, [left, top]: [f32; 2], room: f32, lines: &[String]) {
    for (number, line) in lines.iter().enumerate() {
        let is_last = number > 0 && number + 1 == lines.len();
        let color = if is_last { Rgb::DIM } else { Rgb::WHITE };
        let at = [left, baseline(canvas, top, number)];
        canvas.text(&shortened(line, room), at, LETTERS, color);
    }
}

fn baseline(canvas: &Canvas, top: f32, line: usize) -> f32 {
    top + (PADDING + LETTERS + LINE * line as f32) * canvas.unit
}

/// Centre and field of the frame.
fn field_line(solution: &Solution) -> String {
    let Some(found) = solution.outcome.identification() else {
        return "not identified".to_owned();
    };
    let (boresight, _) = found.attitude(AttitudeFrame::Icrs).boresight_and_up();
    let (ra_rad, dec_rad) = boresight.to_ra_dec();
    format!(
        "RA {}  Dec {} · {}",
        hours(ra_rad * DEG_PER_RAD, 1),
        degrees(dec_rad * DEG_PER_RAD, 0),
        field_text(&found.camera),
    )
}

/// The angles that a camera sees.
fn field_text(camera: &CameraModel) -> String {
    match camera.fov_x_rad().zip(camera.fov_y_rad()) {
        Some((x_rad, y_rad)) => {
            format!("{:.2}° × {:.2}°", x_rad * DEG_PER_RAD, y_rad * DEG_PER_RAD)
        }
        None => format!(
            "within {:.0}° of the axis",
            camera.radius_rad() * DEG_PER_RAD
        ),
    }
}

/// Draws the number of detections of each kind, in the color of its rings.
fn draw_counts(canvas: &mut Canvas, [left, y]: [f32; 2], right: f32, marks: &[Mark]) {
    let count = |kind: MarkKind| marks.iter().filter(|mark| mark.kind == kind).count();
    let kinds = [
        (MarkKind::Identified, "identified"),
        (MarkKind::Placed, "not measured, at catalog position"),
        (MarkKind::Body, "solar system objects"),
        (MarkKind::Unidentified, "not identified"),
        (MarkKind::NotAStar, "not a star"),
    ];
    let mut x = left;
    if marks.is_empty() {
        canvas.text(&counted(0, "detection"), [left, y], LETTERS, Rgb::DIM);
    }
    for (kind, word) in kinds.into_iter().filter(|(kind, _)| count(*kind) > 0) {
        let text = format!("{} {word}", count(kind));
        let ring = 4.5 * canvas.unit;
        let width = 3.5 * ring + text_width(&text, LETTERS * canvas.unit);
        if x + width > right {
            break;
        }
        kind.draw(canvas, [x + ring, y - ring], ring);
        canvas.text(&text, [x + 3.0 * ring, y], LETTERS, kind.color());
        x += width + 12.0 * canvas.unit;
    }
}

/// Draws a scale bar of a round length that ends at the right; returns where it begins.
fn draw_scale(
    canvas: &mut Canvas,
    picture: &Picture,
    [right, top]: [f32; 2],
    found: &Identification,
) -> f32 {
    let most = (BAR * canvas.unit).min(BAR_FRACTION * canvas.width());
    let pixels = |arcsec: f64| {
        length_px(&found.camera, arcsec / 3600.0 * RAD_PER_DEG) as f32 * picture.scale()
    };
    let fits = |(arcsec, _): &&(f64, &str)| pixels(*arcsec) <= most;
    let Some((arcsec, name)) = LENGTHS.iter().find(fits) else {
        return right;
    };
    let left = right - pixels(*arcsec);
    let (y, tick) = (top + HEIGHT * 0.62 * canvas.unit, 4.0 * canvas.unit);
    canvas.line(
        &[
            [left, y - tick],
            [left, y + tick],
            [left, y],
            [right, y],
            [right, y - tick],
            [right, y + tick],
        ],
        1.5,
        Rgb::WHITE,
    );
    let width = text_width(name, LETTERS * canvas.unit);
    let at = [(left + right - width) / 2.0, y - 8.0 * canvas.unit];
    canvas.text(name, at, LETTERS, Rgb::WHITE);
    left.min(at[0])
}

/// Draws arrows to the north (the longer one) and to the east.
fn draw_compass(canvas: &mut Canvas, centre: [f32; 2], found: &Identification) {
    /// Length of the arrow to the north.
    const ARROW: f32 = 20.0;
    let arrows = north_and_east(found)
        .into_iter()
        .zip([("N", 1.0, Rgb::WHITE), ("E", 0.75, Rgb::DIM)]);
    for ([dx, dy], (letter, length, color)) in arrows {
        let point = |along: f32, aside: f32| {
            let (along, aside) = (along * canvas.unit, aside * canvas.unit);
            [
                centre[0] + along * dx - aside * dy,
                centre[1] + along * dy + aside * dx,
            ]
        };
        let tip = length * ARROW;
        let arrow = [point(0.0, 0.0), point(tip, 0.0)];
        let head = [
            point(tip - 6.0, 3.5),
            point(tip, 0.0),
            point(tip - 6.0, -3.5),
        ];
        let middle = point(tip + 8.0, 0.0);
        canvas.line(&arrow, 1.5, color);
        canvas.line(&head, 1.5, color);
        let size = LETTERS - 2.0;
        let at = [
            middle[0] - text_width(letter, size * canvas.unit) / 2.0,
            middle[1] + 0.36 * size * canvas.unit,
        ];
        canvas.text(letter, at, size, color);
    }
}

/// Directions of north and east at the frame's centre: unit vectors, y down.
pub(super) fn north_and_east(identification: &Identification) -> [[f32; 2]; 2] {
    let (boresight, _) = identification.icrs_to_camera.boresight_and_up();
    let (east, north) = boresight.east_north();
    [north, east].map(|axis| {
        let along = identification.icrs_to_camera.matrix() * axis;
        let x = if identification.camera.mirrored {
            -along.x
        } else {
            along.x
        };
        let length = libm::hypot(x, along.y);
        [(x / length) as f32, (along.y / length) as f32]
    })
}

/// Length of an angle across the centre, in pixels of the frame.
fn length_px(camera: &CameraModel, angle_rad: f64) -> f64 {
    2.0 * camera.focal_length_px() * libm::tan(angle_rad / 2.0)
}

/// `text` cut to this width, in units.
fn shortened(text: &str, width: f32) -> String {
    if text_width(text, LETTERS) <= width {
        return text.to_owned();
    }
    let mut kept: String = text.to_owned();
    while kept.pop().is_some() {
        let cut = format!("{}…", kept.trim_end());
        if text_width(&cut, LETTERS) <= width {
            return cut;
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_is_cut_and_a_short_one_is_not() {
        assert_eq!(shortened("a.png", 200.0), "a.png");
        let cut = shortened(&"long ".repeat(40), 200.0);
        assert!(
            cut.ends_with('…') && text_width(&cut, LETTERS) <= 200.0,
            "{cut}"
        );
        assert_eq!(shortened("anything", 1.0), "");
    }

    #[test]
    fn bars_are_listed_longest_first_by_their_true_lengths() {
        assert!(LENGTHS.is_sorted_by(|a, b| a.0 > b.0));
        for (arcsec, name) in LENGTHS {
            let unit = name.chars().last().unwrap();
            let number: f64 = name.trim_end_matches(unit).parse().unwrap();
            let in_unit = match unit {
                '°' => 3600.0,
                '′' => 60.0,
                _ => 1.0,
            };
            assert_eq!(number * in_unit, arcsec, "{name}");
        }
    }
}
