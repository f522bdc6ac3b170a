//! A picture of a night: its series over time, with Moon, twilight and moments, and a keogram, as SVG.

use super::cells::middles_deg;
use super::row::NightRow;
use super::summary::NightSummary;
use crate::report::figure::{
    Area, Axis, ColorScale, Dot, Marks, Panel, PlotLayer, Rgb, Sheet, Spacing, sequential,
};

/// Width and height of a plot.
const PLOT_PX: [f32; 2] = [840.0, 110.0];
/// What shades the background, at its strongest.
const TWILIGHT: Rgb = Rgb([240, 160, 48]);
const MOON: Rgb = Rgb([154, 154, 200]);

/// The value of a row, and its standard error.
type Measured = (Option<f64>, Option<f64>);

/// Points of a plot.
struct NightPlotLayer {
    name: &'static str,
    color: Rgb,
    value: fn(&NightRow) -> Measured,
}

/// A plot over time.
struct Plot {
    title: &'static str,
    unit: &'static str,
    layers: &'static [NightPlotLayer],
    /// Bounds of the values; `None` for those that there are.
    bounds: Option<[f64; 2]>,
}

const PLOTS: [Plot; 5] = [
    Plot {
        title: "Brightness of the zenith",
        unit: "V mag/arcsec²",
        layers: &[NightPlotLayer {
            name: "",
            color: Rgb::BLUE,
            value: |row| (row.zenith_mag_arcsec2, row.zenith_sigma_mag),
        }],
        bounds: None,
    },
    Plot {
        title: "Cloud cover",
        unit: "%",
        layers: &[NightPlotLayer {
            name: "",
            color: Rgb::BLUE,
            value: |row| {
                let [share, sigma] = [row.cloud_share, row.cloud_share_sigma];
                (
                    share.map(|share| 100.0 * share),
                    sigma.map(|sigma| 100.0 * sigma),
                )
            },
        }],
        bounds: Some([0.0, 100.0]),
    },
    Plot {
        title: "Limiting magnitude",
        unit: "V",
        layers: &[
            NightPlotLayer {
                name: "measured",
                color: Rgb::BLUE,
                value: |row| (row.limit_vmag, row.limit_sigma_mag),
            },
            NightPlotLayer {
                name: "expected",
                color: Rgb::ORANGE,
                value: |row| (row.expected_limit_vmag, None),
            },
            NightPlotLayer {
                name: "naked eye",
                color: Rgb::GREEN,
                value: |row| (row.naked_eye_limit_vmag, None),
            },
        ],
        bounds: None,
    },
    Plot {
        title: "Extinction and dimming",
        unit: "mag",
        layers: &[
            NightPlotLayer {
                name: "extinction per airmass",
                color: Rgb::BLUE,
                value: |row| {
                    let mag = row.extinction_mag_per_airmass;
                    (
                        mag.filter(|_| row.extinction_measured),
                        row.extinction_sigma_mag,
                    )
                },
            },
            NightPlotLayer {
                name: "dimming since the clearest frames",
                color: Rgb::ORANGE,
                value: |row| (row.dimming_mag, None),
            },
        ],
        bounds: None,
    },
    Plot {
        title: "Spot size of stars (standard deviation)",
        unit: "px",
        layers: &[NightPlotLayer {
            name: "",
            color: Rgb::BLUE,
            value: |row| (row.spot_sigma_px.filter(|_| row.is_identified()), None),
        }],
        bounds: None,
    },
];

/// The figure of a night; `None` where fewer than two frames have a date.
pub fn svg(rows: &[NightRow], night: &NightSummary) -> Option<String> {
    let spans = spans(rows);
    let ([first, _], [_, last]) = (spans.first()?.0, spans.last()?.0);
    if last <= first {
        return None;
    }
    // The first and the last point do not touch the border.
    let room = 0.02 * (last - first);
    let time = Axis {
        spacing: Spacing::Time,
        ..Axis::new("UTC").within(first - room, last + room)
    };
    let mut panels: Vec<Panel> = PLOTS
        .iter()
        .filter_map(|plot| plot.draw(rows, &time, shades(&spans)))
        .collect();
    panels.extend(keogram(&spans, &time));
    for (number, panel) in panels.iter_mut().enumerate() {
        panel.layers.push(moments(night, number == 0));
    }
    let numbered = (1..).zip(&night.moments);
    let notes = numbered.map(|(number, of)| format!("{number}: {}, {}", of.date, of.to_text()));
    let mut notes: Vec<String> = notes.collect();
    notes.push(
        "Background: orange in twilight, violet while the Moon is up, darker near full Moon."
            .to_owned(),
    );
    let sheet = Sheet {
        title: title(night),
        notes,
        frame_px: PLOT_PX,
        shares_x: true,
        ..Sheet::new(panels, 1)
    };
    Some(sheet.svg())
}

fn title(night: &NightSummary) -> String {
    let day = |date: &str| date.split('T').next().unwrap_or_default().to_owned();
    let (first, last) = (day(&night.first_date), day(&night.last_date));
    let mut parts = vec![if first == last {
        first
    } else {
        format!("{first} to {last}")
    }];
    parts.extend(night.hours.map(|hours| match night.clear_hours {
        Some(clear) => format!("{clear:.1} of {hours:.1} hours clear"),
        None => format!("{hours:.1} hours"),
    }));
    if let Some(hour) = &night.darkest_hour {
        parts.push(format!(
            "darkest hour V {:.2} mag/arcsec²",
            hour.zenith_mag_arcsec2
        ));
    }
    parts.join(" · ")
}

/// The frames that have a date, and from when to when each stands: half of the way to its neighbors.
fn spans(rows: &[NightRow]) -> Vec<([f64; 2], &NightRow)> {
    let dated = rows.iter().filter_map(|row| Some((row.mjd?, row)));
    let dated: Vec<(f64, &NightRow)> = dated.collect();
    let span = |(at, (mjd, _)): (usize, &(f64, &NightRow))| {
        let before = at.checked_sub(1).map_or(*mjd, |at| dated[at].0);
        let after = dated.get(at + 1).map_or(*mjd, |next| next.0);
        [0.5 * (before + mjd), 0.5 * (mjd + after)]
    };
    let spans = dated.iter().enumerate().map(|of| (span(of), of.1.1));
    spans.collect()
}

/// Twilight and the Moon behind a plot.
fn shades(spans: &[([f64; 2], &NightRow)]) -> PlotLayer {
    let alike = spans.chunk_by(|(_, a), (_, b)| shade(a) == shade(b));
    let areas = alike.filter_map(|run| {
        let ([from, _], [_, to]) = (run.first()?.0, run.last()?.0);
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        Some(Area::rectangle([from, to], all, shade(run[0].1)))
    });
    PlotLayer::unnamed(Rgb::PAPER, Marks::Areas(areas.collect()))
}

/// The background of a frame.
fn shade(row: &NightRow) -> Rgb {
    let twilight = match row.twilight.as_str() {
        "day" => 0.5,
        "civil" => 0.35,
        "nautical" => 0.22,
        "astronomical" => 0.1,
        _ => 0.0,
    };
    let is_moon_up = row
        .moon_altitude_deg
        .is_some_and(|altitude_deg| altitude_deg > 0.0);
    let moon = row
        .moon_illuminated
        .filter(|_| is_moon_up)
        .map_or(0.0, |share| 0.08 + 0.3 * share);
    Rgb::PAPER.mixed(TWILIGHT, twilight).mixed(MOON, moon)
}

impl Plot {
    /// The plot before a background; `None` where no value is known.
    fn draw(&self, rows: &[NightRow], time: &Axis, background: PlotLayer) -> Option<Panel> {
        let mut layers = vec![background];
        for of in self.layers {
            let dots: Vec<Dot> = rows.iter().filter_map(|row| of.dot(row)).collect();
            if dots.is_empty() {
                continue;
            }
            let marks = PlotLayer::unnamed(of.color, Marks::Dots(dots));
            layers.push(PlotLayer {
                label: (!of.name.is_empty()).then(|| of.name.to_owned()),
                ..marks
            });
        }
        let y = Axis::new(self.unit);
        let panel = Panel {
            title: self.title.to_owned(),
            x: time.clone(),
            y: match self.bounds {
                Some([from, to]) => y.within(from, to),
                None => y,
            },
            layers,
            ..Panel::default()
        };
        (panel.layers.len() > 1).then_some(panel)
    }
}

impl NightPlotLayer {
    fn dot(&self, row: &NightRow) -> Option<Dot> {
        let (value, sigma) = (self.value)(row);
        let (value, mjd) = (value?, row.mjd?);
        let error = sigma.map_or_else(String::new, |sigma| format!(" ± {sigma:.3}"));
        Some(Dot {
            y_range: sigma.map(|sigma| [value - sigma, value + sigma]),
            note: format!("{}: {value:.3}{error}", row.date),
            ..Dot::from((mjd, value))
        })
    }
}

/// The cells of the meridian, from the south through the zenith to the north: each with the angles from the
/// southern horizon between which it is, in degrees.
fn keogram_cells() -> Vec<(usize, f64)> {
    /// The middle of a ring of 5°.
    const HALF_DEG: f64 = 2.5;
    let middles = middles_deg();
    let nearest = |altitude_deg: f64, azimuth_deg: f64| {
        let off = |cell: &[f64; 2]| {
            let turn_deg = (cell[1] - azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
            (cell[0] - altitude_deg).abs() * 1000.0 + turn_deg.abs()
        };
        let cells = middles.iter().enumerate();
        let nearest = cells.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        nearest.map_or(0, |(cell, _)| cell)
    };
    let rings = (0..18).map(|ring| 5.0 * f64::from(ring) + HALF_DEG);
    let south = rings
        .clone()
        .map(|altitude| (nearest(altitude, 180.0), altitude));
    let north = rings
        .rev()
        .map(|altitude| (nearest(altitude, 0.0), 180.0 - altitude));
    south.chain(north).collect()
}

/// The brightness of the meridian over time; `None` where it is not known.
fn keogram(spans: &[([f64; 2], &NightRow)], time: &Axis) -> Option<Panel> {
    let cells = keogram_cells();
    let mag = |row: &NightRow, cell: usize| row.cells.as_ref()?.mag_arcsec2[cell].get();
    let values = spans
        .iter()
        .flat_map(|(_, row)| cells.iter().filter_map(move |(cell, _)| mag(row, *cell)));
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |share: f64| values[(share * last as f64) as usize];
    let scale = ColorScale {
        title: "V mag/arcsec²".to_owned(),
        ends: [at(0.99).max(at(0.01) + 0.1), at(0.01)],
        is_log: false,
        palette: sequential,
    };
    let half_deg = 90.0 / cells.len() as f64;
    let area = |span: &[f64; 2], row: &NightRow, (cell, from_south_deg): &(usize, f64)| {
        let value = mag(row, *cell)?;
        let ring = [from_south_deg - half_deg, from_south_deg + half_deg];
        Some(Area::rectangle(*span, ring, scale.color(value)))
    };
    let areas = spans
        .iter()
        .flat_map(|(span, row)| cells.iter().filter_map(|cell| area(span, row, cell)));
    let areas = areas.collect();
    let names = [(0.0, "S"), (90.0, "zenith"), (180.0, "N")];
    let names = names.map(|(angle_deg, name)| (angle_deg, name.to_owned()));
    Some(Panel {
        title: "Keogram: brightness along the meridian".to_owned(),
        x: time.clone(),
        y: Axis {
            spacing: Spacing::Named(names.into()),
            ..Axis::new("").within(0.0, 180.0)
        },
        layers: vec![PlotLayer::colored(areas, scale)],
        ..Panel::default()
    })
}

/// Lines at the moments, with their numbers if `is_named`.
fn moments(night: &NightSummary, is_named: bool) -> PlotLayer {
    let name = |number: usize| {
        if is_named {
            number.to_string()
        } else {
            String::new()
        }
    };
    let moments = (1..).zip(&night.moments);
    let moments = moments.map(|(number, moment)| (moment.mjd, name(number)));
    PlotLayer::unnamed(Rgb::ORANGE, Marks::Moments(moments.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keogram_goes_from_south_to_north() {
        let cells = keogram_cells();
        let middles = middles_deg();
        assert_eq!(cells.len(), 36);
        let azimuth = |at: usize| middles[cells[at].0][1];
        assert!((azimuth(0) - 180.0).abs() < 4.0);
        assert!(azimuth(35) < 4.0 || azimuth(35) > 356.0);
        assert!(cells.windows(2).all(|pair| pair[0].1 < pair[1].1));
    }
}
