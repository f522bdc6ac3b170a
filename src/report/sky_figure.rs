//! A picture of the sky at each place of a frame: brightness, extinction and limits, as SVG.

use super::figure::{
    Area, Axis, ColorScale, Dot, Marks, Panel, PanelKind, PlotLayer, Rgb, Sheet, diverging,
    sequential,
};
use super::frame_report::{AnnotationReport, FrameReport};
use super::sky::{SkyCellReport, SkyReport};
use crate::base::units::RAD_PER_DEG;
use std::ffi::OsStr;
use std::path::Path;

/// Most width and height of a sky.
const SKY_PX: f32 = 300.0;
/// Half of the width of a sky in degrees from the zenith, with room for the cardinal points.
const REACH_DEG: f64 = 100.0;
/// Cells where a quantity is not measured.
const UNMEASURED: Rgb = Rgb([222, 222, 222]);
/// Stars that are marked in maps of the frame, and those of them that have their names.
const STARS: usize = 40;
const NAMES: usize = 6;
/// Points along the side of a cell at most 5° long.
const SIDE_POINTS: usize = 4;

/// One picture of the sky.
struct SkyPanel {
    title: &'static str,
    unit: &'static str,
    value: fn(&SkyCellReport) -> Option<f64>,
    /// Whether low values are light: bright skies have low magnitudes.
    is_low_light: bool,
    /// Values of the first and the last color; `None` for those that there are.
    ends: Option<[f64; 2]>,
    palette: fn(f64) -> Rgb,
}

const PANELS: [SkyPanel; 3] = [
    SkyPanel {
        title: "Brightness",
        unit: "V mag/arcsec²",
        value: |cell| cell.mag_arcsec2,
        is_low_light: true,
        ends: None,
        palette: sequential,
    },
    SkyPanel {
        title: "Extinction by clouds",
        unit: "mag more than clear air",
        value: |cell| cell.extinction_mag,
        is_low_light: false,
        ends: Some([0.0, 2.0]),
        palette: sequential,
    },
    SkyPanel {
        title: "Limit, measured − expected",
        unit: "mag; white: as expected",
        value: |cell| Some(cell.limit_vmag? - cell.expected_limit_vmag?),
        is_low_light: false,
        ends: Some([-1.0, 1.0]),
        palette: diverging,
    },
];

/// The figure of `report`; `None` if its sky was not measured.
pub fn svg(report: &FrameReport) -> Option<String> {
    let sky = report.sky.as_ref()?;
    let panels = PANELS.iter().filter_map(|panel| panel.draw(report, sky));
    let panels: Vec<Panel> = panels.collect();
    let abreast = panels.len();
    let has_unmeasured = |panel: &SkyPanel| {
        let is_known = |cell: &SkyCellReport| (panel.value)(cell).is_some();
        sky.cells.iter().any(is_known) && !sky.cells.iter().all(is_known)
    };
    let note = "Gray: not measured.".to_owned();
    let sheet = Sheet {
        title: title(report, sky),
        notes: PANELS
            .iter()
            .any(has_unmeasured)
            .then_some(note)
            .into_iter()
            .collect(),
        frame_px: [SKY_PX; 2],
        ..Sheet::new(panels, abreast)
    };
    Some(sheet.svg())
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
    /// The picture; `None` where no value is known.
    fn draw(&self, report: &FrameReport, sky: &SkyReport) -> Option<Panel> {
        let known = |cell: &'_ SkyCellReport| (self.value)(cell);
        let [low, high] = sky
            .cells
            .iter()
            .filter_map(known)
            .fold(None, |range, value| {
                let [low, high] = range.unwrap_or([value; 2]);
                Some([f64::min(low, value), f64::max(high, value)])
            })?;
        let scale = ColorScale {
            title: self.unit.to_owned(),
            ends: match self.ends {
                Some(ends) => ends,
                None if self.is_low_light => [high.max(low + 0.1), low],
                None => [low, high.max(low + 0.1)],
            },
            is_log: false,
            palette: self.palette,
        };
        let area = |cell: &SkyCellReport| {
            let value = known(cell);
            let told = value.map_or("not measured".to_owned(), |value| {
                format!("{value:.2}").replace('-', "−")
            });
            Area {
                points: outline(cell),
                color: value.map_or(UNMEASURED, |value| scale.color(value)),
                note: format!("{} {told}", place(cell)),
            }
        };
        let areas = sky.cells.iter().map(area).collect();
        let mut layers = vec![PlotLayer::colored(areas, scale.clone())];
        let [x, y] = if sky.cells.iter().any(|cell| cell.altitude_deg.is_some()) {
            layers.extend(horizon());
            [[-REACH_DEG, REACH_DEG]; 2]
        } else {
            layers.extend(frame(report));
            let [width, height] = [report.width, report.height].map(|side| side as f64);
            // The compass is beside the frame.
            [
                [-0.5, width + 2.5 * compass_px(report)],
                [height - 0.5, -0.5],
            ]
        };
        Some(Panel {
            title: self.title.to_owned(),
            x: Axis::new("").within(x[0], x[1]),
            y: Axis::new("").within(y[0], y[1]),
            layers,
            kind: PanelKind::Bare,
        })
    }
}

/// The outline of the frame, its brightest stars, and where north and east are.
fn frame(report: &FrameReport) -> Vec<PlotLayer> {
    let [right, below] = [report.width, report.height].map(|side| side as f64 - 0.5);
    let corners = [(-0.5, -0.5), (right, -0.5), (right, below), (-0.5, below)];
    let outline = corners.into_iter().chain([corners[0]]).collect();
    let stars = || report.annotations.iter().filter(|it| it.kind == "star");
    let dot = |star: &AnnotationReport| Dot {
        note: star.label.clone(),
        ..Dot::from((star.x, star.y))
    };
    // A name is above its star, and within the frame.
    let [wide, high] = [report.width, report.height].map(|side| side as f64);
    let name = |star: &AnnotationReport| {
        let x = star.x.clamp(0.14 * wide, 0.86 * wide);
        (
            x,
            (star.y - 0.05 * high).max(0.04 * high),
            star.label.clone(),
        )
    };
    let mut layers = vec![
        PlotLayer::guide(Marks::Line(outline)),
        PlotLayer::unnamed(
            Rgb::ORANGE,
            Marks::Dots(stars().take(STARS).map(dot).collect()),
        ),
        PlotLayer::unnamed(
            Rgb::BLACK,
            Marks::Texts(stars().take(NAMES).map(name).collect()),
        ),
    ];
    layers.extend(compass(report).into_iter().flatten());
    layers
}

fn compass_px(report: &FrameReport) -> f64 {
    0.06 * report.width as f64
}

/// Arrows to north and east beside the frame; `None` where the directions differ over the frame, as with a
/// whole sky.
fn compass(report: &FrameReport) -> Option<[PlotLayer; 2]> {
    let attitude = report.attitude.as_ref().filter(|of| of.at != "axis")?;
    let is_mirrored = report.optics.as_ref().is_some_and(|of| of.mirrored);
    let long = compass_px(report);
    let center = (report.width as f64 + 1.3 * long, 1.5 * long);
    // Position angles grow to the left of up, as seen from within the sky.
    let toward = |position_angle_deg: f64, length: f64| {
        let from_up = (attitude.up_pa_deg - position_angle_deg) * RAD_PER_DEG;
        let (sin, cos) = libm::sincos(if is_mirrored { -from_up } else { from_up });
        (center.0 + length * sin, center.1 - length * cos)
    };
    let arrows = [0.0, 90.0].map(|angle_deg| vec![center, toward(angle_deg, 0.7 * long)]);
    let names = [("N", 0.0), ("E", 90.0)].map(|(name, angle_deg)| {
        let (x, y) = toward(angle_deg, long);
        (x, y, name.to_owned())
    });
    Some([
        PlotLayer::unnamed(Rgb::BLACK, Marks::Lines(arrows.into())),
        PlotLayer::unnamed(Rgb::BLACK, Marks::Texts(names.into())),
    ])
}

/// Circles of altitude and the cardinal points: as one looks up, with east on the left.
fn horizon() -> [PlotLayer; 2] {
    let circle = |altitude_deg: f64| {
        let azimuths = (0..=72).map(|step| 5.0 * f64::from(step));
        azimuths
            .map(|azimuth_deg| on_sky(altitude_deg, azimuth_deg))
            .collect()
    };
    let named = |name: &str, altitude_deg: f64, azimuth_deg: f64| {
        let (x, y) = on_sky(altitude_deg, azimuth_deg);
        (x, y, name.to_owned())
    };
    let names = [
        named("N", -6.0, 0.0),
        named("E", -6.0, 90.0),
        named("S", -6.0, 180.0),
        named("W", -6.0, 270.0),
        named("30°", 30.0, 0.0),
        named("60°", 60.0, 0.0),
    ];
    let circles = [0.0, 30.0, 60.0].map(circle).into();
    [
        PlotLayer::guide(Marks::Lines(circles)),
        PlotLayer::unnamed(Rgb::BLACK, Marks::Texts(names.into())),
    ]
}

/// Where a direction is: the zenith in the middle, north above, east on the left.
fn on_sky(altitude_deg: f64, azimuth_deg: f64) -> (f64, f64) {
    let from_zenith_deg = 90.0 - altitude_deg;
    let (sin, cos) = libm::sincos(azimuth_deg * RAD_PER_DEG);
    (-from_zenith_deg * sin, from_zenith_deg * cos)
}

/// The outline of a cell.
fn outline(cell: &SkyCellReport) -> Vec<(f64, f64)> {
    match (cell.altitude_deg, cell.azimuth_deg, cell.x, cell.y) {
        (Some([low, high]), Some([from, to]), _, _) => {
            let azimuth = |i: usize| from + (to - from) * i as f64 / SIDE_POINTS as f64;
            let below = (0..=SIDE_POINTS).map(|i| on_sky(low, azimuth(i)));
            let above = (0..=SIDE_POINTS).rev().map(|i| on_sky(high, azimuth(i)));
            below.chain(above).collect()
        }
        (_, _, Some(x), Some(y)) => Area::rectangle(x, y, Rgb::PAPER).points,
        _ => Vec::new(),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_is_in_the_middle_and_east_on_the_left() {
        assert_eq!(on_sky(90.0, 123.0), (0.0, 0.0));
        let (x, y) = on_sky(0.0, 90.0);
        assert!((x + 90.0).abs() < 1e-9 && y.abs() < 1e-9);
    }
}
