//! A picture of the sky at each place of a frame: brightness, extinction and limits, as SVG.

use super::frame_report::FrameReport;
use super::sky::{SkyCellReport, SkyReport};
use crate::base::format::xml_escaped;
use crate::base::units::RAD_PER_DEG;
use memchr::memmem;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;

/// Radius of a sky, in units of the figure.
const RADIUS: f64 = 150.0;
/// Width of a panel.
const PANEL: f64 = 380.0;
/// Height of the figure.
const HEIGHT: f64 = 490.0;
/// Height of the centre of a sky.
const MIDDLE: f64 = 238.0;
/// Steps of the color bar.
const BAR_STEPS: usize = 40;
/// Points along the side of a cell at most 5° long.
const SIDE_POINTS: usize = 4;

/// Says what the figure is.
const COMMENT: &str = "<!-- starpipe sky -->";

/// Whether a file that begins like this is such a figure.
pub fn is_figure(head: &[u8]) -> bool {
    memmem::find(head, COMMENT.as_bytes()).is_some()
}

/// One picture of the sky.
struct SkyPanel {
    title: &'static str,
    unit: &'static str,
    value: fn(&SkyCellReport) -> Option<f64>,
    /// Whether low values are light: bright skies have low magnitudes.
    is_low_light: bool,
    /// Bounds of the colors; `None` for those of the values.
    bounds: Option<[f64; 2]>,
    decimals: usize,
}

const PANELS: [SkyPanel; 3] = [
    SkyPanel {
        title: "Brightness",
        unit: "V magnitude of a square arcsecond",
        value: |cell| cell.mag_arcsec2,
        is_low_light: true,
        bounds: None,
        decimals: 1,
    },
    SkyPanel {
        title: "Extinction by clouds",
        unit: "magnitudes beyond clear air",
        value: |cell| cell.extinction_mag,
        is_low_light: false,
        bounds: Some([0.0, 2.0]),
        decimals: 1,
    },
    SkyPanel {
        title: "Limit, measured − expected",
        unit: "magnitudes",
        value: |cell| Some(cell.limit_vmag? - cell.expected_limit_vmag?),
        is_low_light: false,
        bounds: Some([-1.0, 1.0]),
        decimals: 1,
    },
];

/// The figure of `report`; `None` if its sky was not measured.
pub fn svg(report: &FrameReport) -> Option<String> {
    let sky = report.sky.as_ref()?;
    let shown = PANELS.iter().filter(|panel| {
        let mut cells = sky.cells.iter();
        cells.any(|cell| (panel.value)(cell).is_some())
    });
    let shown: Vec<&SkyPanel> = shown.collect();
    let width = PANEL * shown.len().max(1) as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" width=\"{width}\" \
         height=\"{HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n{COMMENT}\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"16\" y=\"26\" font-size=\"16\">{}</text>\n",
        xml_escaped(&title(report, sky))
    );
    for (number, panel) in shown.into_iter().enumerate() {
        let _ = writeln!(
            out,
            "<g transform=\"translate({} 0)\">",
            PANEL * number as f64
        );
        panel.draw(&mut out, report, sky);
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    Some(out)
}

/// The result in words.
fn title(report: &FrameReport, sky: &SkyReport) -> String {
    let name = Path::new(&report.frame).file_name();
    let name = name.map_or(report.frame.as_str().into(), OsStr::to_string_lossy);
    let mut parts = vec![name.into_owned()];
    if let Some(zenith) = &sky.zenith {
        parts.push(format!("zenith V {:.2} mag/arcsec²", zenith.mag_arcsec2));
    }
    if let Some(share) = sky.cloud_share {
        parts.push(format!("{:.0} % clouds", 100.0 * share));
    }
    if let Some(mag) = sky
        .extinction_mag_per_airmass
        .filter(|_| sky.extinction_measured)
    {
        parts.push(format!("extinction {mag:.2} mag per airmass"));
    }
    parts.join(" · ")
}

impl SkyPanel {
    /// The color of a value from 0 to 1 between the bounds.
    fn color(&self, value: f64) -> String {
        color(if self.is_low_light {
            1.0 - value
        } else {
            value
        })
    }

    fn draw(&self, out: &mut String, report: &FrameReport, sky: &SkyReport) {
        let values = sky.cells.iter().filter_map(self.value);
        let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        let bounds = self.bounds.unwrap_or(range);
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"52\" text-anchor=\"middle\">{}</text>",
            PANEL / 2.0,
            self.title
        );
        for cell in &sky.cells {
            let Some(value) = (self.value)(cell) else {
                continue;
            };
            let span = (bounds[1] - bounds[0]).max(1e-9);
            let color = self.color((value - bounds[0]) / span);
            let outline = outline(cell, report);
            let _ = writeln!(
                out,
                "<path d=\"{outline}\" fill=\"{color}\" stroke=\"{color}\" stroke-width=\"0.5\">\
                 <title>{} {value:.2}</title></path>",
                place(cell),
            );
        }
        if sky.cells.iter().any(|cell| cell.altitude_deg.is_some()) {
            draw_horizon(out);
        }
        self.draw_bar(out, bounds);
    }

    fn draw_bar(&self, out: &mut String, bounds: [f64; 2]) {
        let (left, top, length) = (PANEL / 2.0 - RADIUS, MIDDLE + RADIUS + 40.0, 2.0 * RADIUS);
        let step = length / BAR_STEPS as f64;
        for i in 0..BAR_STEPS {
            let _ = writeln!(
                out,
                "<rect x=\"{:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"12\" fill=\"{}\"/>",
                left + i as f64 * step,
                step + 0.5,
                self.color((i as f64 + 0.5) / BAR_STEPS as f64),
            );
        }
        let decimals = self.decimals;
        let middle = 0.5 * (bounds[0] + bounds[1]);
        for (at, value) in [(0.0, bounds[0]), (0.5, middle), (1.0, bounds[1])] {
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\" font-size=\"11\">{value:.decimals$}</text>",
                left + at * length,
                top + 26.0,
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"11\">{}</text>",
            PANEL / 2.0,
            top + 42.0,
            self.unit
        );
    }
}

/// Circles of altitude and the cardinal points: as one looks up, with east on the left.
fn draw_horizon(out: &mut String) {
    for altitude_deg in [0.0, 30.0, 60.0] {
        let radius = RADIUS * (90.0 - altitude_deg) / 90.0;
        let _ = writeln!(
            out,
            "<circle cx=\"{}\" cy=\"{MIDDLE}\" r=\"{radius:.1}\" fill=\"none\" stroke=\"black\" \
             stroke-opacity=\"0.4\" stroke-width=\"0.7\"/>",
            PANEL / 2.0,
        );
        if altitude_deg > 0.0 {
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"9\" fill-opacity=\"0.7\">{altitude_deg:.0}°</text>",
                PANEL / 2.0 + 2.0,
                MIDDLE - radius - 2.0,
            );
        }
    }
    for (name, azimuth_deg) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)] {
        let [x, y] = on_sky(-8.0, azimuth_deg);
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            y + 4.5
        );
    }
}

/// Where a direction is: the zenith in the middle, north above, east on the left.
fn on_sky(altitude_deg: f64, azimuth_deg: f64) -> [f64; 2] {
    let radius = RADIUS * (90.0 - altitude_deg) / 90.0;
    let (sin, cos) = libm::sincos(azimuth_deg * RAD_PER_DEG);
    [PANEL / 2.0 - radius * sin, MIDDLE - radius * cos]
}

/// The outline of a cell.
fn outline(cell: &SkyCellReport, report: &FrameReport) -> String {
    let mut points = Vec::new();
    if let (Some([low, high]), Some([from, to])) = (cell.altitude_deg, cell.azimuth_deg) {
        let azimuth = |i: usize| from + (to - from) * i as f64 / SIDE_POINTS as f64;
        points.extend((0..=SIDE_POINTS).map(|i| on_sky(low, azimuth(i))));
        points.extend((0..=SIDE_POINTS).rev().map(|i| on_sky(high, azimuth(i))));
    } else if let (Some(x), Some(y)) = (cell.x, cell.y) {
        let (width, height) = (report.width as f64, report.height as f64);
        let scale = 2.0 * RADIUS / width.max(height);
        let at = |x: f64, y: f64| {
            [
                PANEL / 2.0 + (x + 0.5 - width / 2.0) * scale,
                MIDDLE + (y + 0.5 - height / 2.0) * scale,
            ]
        };
        points.extend([
            at(x[0], y[0]),
            at(x[1], y[0]),
            at(x[1], y[1]),
            at(x[0], y[1]),
        ]);
    }
    let mut path = String::new();
    for (number, [x, y]) in points.into_iter().enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if number == 0 { "M" } else { "L" });
    }
    path + "Z"
}

/// Where a cell is, in words.
fn place(cell: &SkyCellReport) -> String {
    match (cell.altitude_deg, cell.azimuth_deg, cell.x, cell.y) {
        (Some(altitude), Some(azimuth), _, _) => format!(
            "altitude {:.0}° to {:.0}°, azimuth {:.0}° to {:.0}°:",
            altitude[0], altitude[1], azimuth[0], azimuth[1]
        ),
        (_, _, Some(x), Some(y)) => format!("x {:.0}, y {:.0}:", x[0].max(0.0), y[0].max(0.0)),
        _ => String::new(),
    }
}

/// The color of a value from 0 to 1, whose lightness grows evenly: cividis, which deuteranopes see alike.
///
/// # Reference
/// Nuñez, Anderton & Renslow 2018, PLoS ONE 13, e0199239.
pub(crate) fn color(value: f64) -> String {
    const STOPS: [[f64; 3]; 6] = [
        [0.0, 34.0, 78.0],
        [53.0, 69.0, 108.0],
        [102.0, 105.0, 112.0],
        [148.0, 142.0, 119.0],
        [200.0, 184.0, 102.0],
        [254.0, 232.0, 56.0],
    ];
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let stop = (at as usize).min(STOPS.len() - 2);
    let part = at - stop as f64;
    let [red, green, blue] = [0, 1, 2].map(|channel| {
        let [from, to] = [STOPS[stop][channel], STOPS[stop + 1][channel]];
        (from + part * (to - from)).round() as u8
    });
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_is_in_the_middle_and_east_on_the_left() {
        assert_eq!(on_sky(90.0, 123.0), [PANEL / 2.0, MIDDLE]);
        let [x, y] = on_sky(0.0, 90.0);
        assert!((x - (PANEL / 2.0 - RADIUS)).abs() < 1e-9 && (y - MIDDLE).abs() < 1e-9);
    }

    #[test]
    fn colors_grow_lighter() {
        assert_eq!(color(-1.0), "#00224e");
        assert_eq!(color(2.0), "#fee838");
        assert_eq!(color(0.4), "#666970");
    }
}
