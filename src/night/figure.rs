//! A picture of a night: its series over time, with Moon, twilight and moments, and a keogram, as SVG.

use super::cells::middles_deg;
use super::moments::Moment;
use super::row::NightRow;
use super::summary::NightSummary;
use crate::base::format::xml_escaped;
use crate::report::sky_figure::color;
use std::fmt::Write as _;

/// Width of the figure, and where its plots begin and end.
const WIDTH: f64 = 1000.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 976.0;
/// Height of the first plot's top, of a plot, and of the gap below it.
const TOP: f64 = 64.0;
const PLOT: f64 = 120.0;
const GAP: f64 = 26.0;
/// Height of a line of the list of moments.
const LINE: f64 = 16.0;
const BLUE: &str = "#0072b2";
const ORANGE: &str = "#d55e00";
const GREEN: &str = "#009e73";

/// A line or points of a plot.
struct NightPlotLayer {
    name: &'static str,
    color: &'static str,
    value: fn(&NightRow) -> Option<f64>,
}

/// A plot over time.
struct Plot {
    title: &'static str,
    layers: &'static [NightPlotLayer],
    /// Bounds of the values; `None` for those that there are.
    bounds: Option<[f64; 2]>,
}

const PLOTS: [Plot; 5] = [
    Plot {
        title: "Zenith, V magnitude of a square arcsecond",
        layers: &[NightPlotLayer {
            name: "",
            color: BLUE,
            value: |row| row.zenith_mag_arcsec2,
        }],
        bounds: None,
    },
    Plot {
        title: "Sky behind clouds, %",
        layers: &[NightPlotLayer {
            name: "",
            color: BLUE,
            value: |row| row.cloud_share.map(|share| 100.0 * share),
        }],
        bounds: Some([0.0, 100.0]),
    },
    Plot {
        title: "Limits, V magnitude",
        layers: &[
            NightPlotLayer {
                name: "measured",
                color: BLUE,
                value: |row| row.limit_vmag,
            },
            NightPlotLayer {
                name: "expected",
                color: ORANGE,
                value: |row| row.expected_limit_vmag,
            },
            NightPlotLayer {
                name: "unaided eye",
                color: GREEN,
                value: |row| row.naked_eye_limit_vmag,
            },
        ],
        bounds: None,
    },
    Plot {
        title: "Magnitudes",
        layers: &[
            NightPlotLayer {
                name: "extinction per airmass",
                color: BLUE,
                value: |row| {
                    row.extinction_mag_per_airmass
                        .filter(|_| row.extinction_measured)
                },
            },
            NightPlotLayer {
                name: "stars dimmer than at their best",
                color: ORANGE,
                value: |row| row.dimming_mag,
            },
        ],
        bounds: None,
    },
    Plot {
        title: "Spot, pixels (standard deviation)",
        layers: &[NightPlotLayer {
            name: "",
            color: BLUE,
            value: |row| row.spot_sigma_px.filter(|_| row.is_identified()),
        }],
        bounds: None,
    },
];

/// Time as the figure has it.
struct TimeAxis {
    first: f64,
    last: f64,
}

impl TimeAxis {
    fn x(&self, mjd: f64) -> f64 {
        LEFT + (RIGHT - LEFT) * (mjd - self.first) / (self.last - self.first)
    }

    /// Full hours, not too close.
    fn hours(&self) -> impl Iterator<Item = u32> + use<> {
        const MAX: f64 = 14.0;
        let (first, last) = (24.0 * self.first, 24.0 * self.last);
        let step = [1.0, 2.0, 3.0, 6.0, 12.0, 24.0, 168.0];
        let step = step.into_iter().find(|step| (last - first) / step < MAX);
        let step = step.unwrap_or(720.0);
        let start = (first / step).ceil();
        let count = ((last / step).floor() - start + 1.0).max(0.0) as u32;
        (0..count).map(move |hour| ((start + f64::from(hour)) * step) as u32)
    }
}

/// The figure of a night; `None` where fewer than two frames have a date.
pub fn svg(rows: &[NightRow], night: &NightSummary) -> Option<String> {
    let mut dates = rows.iter().filter_map(|row| row.mjd);
    let time = TimeAxis {
        first: dates.next()?,
        last: dates.next_back()?,
    };
    if time.last <= time.first {
        return None;
    }
    let shown: Vec<&Plot> = PLOTS.iter().filter(|plot| plot.has_values(rows)).collect();
    let keogram = keogram_cells();
    let has_keogram = rows.iter().any(|row| row.cells.is_some());
    let bottom = TOP + (PLOT + GAP) * (shown.len() + usize::from(has_keogram)) as f64;
    let height = bottom + LINE * (night.moments.len() as f64 + 3.0);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n<!-- starpipe night -->\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"16\" y=\"26\" font-size=\"16\">{}</text>\n",
        xml_escaped(&title(night))
    );
    for (number, plot) in shown.iter().enumerate() {
        let top = TOP + (PLOT + GAP) * number as f64;
        shade(&mut out, rows, &time, top);
        plot.draw(&mut out, rows, &time, top);
    }
    if has_keogram {
        let top = bottom - PLOT - GAP;
        draw_keogram(&mut out, rows, &keogram, &time, top);
    }
    draw_time(&mut out, &time, bottom - GAP);
    draw_moments(&mut out, &night.moments, &time, bottom);
    out.push_str("</svg>\n");
    Some(out)
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

/// Shades twilight and the Moon behind a plot: each frame stands for half of the way to its neighbors.
fn shade(out: &mut String, rows: &[NightRow], time: &TimeAxis, top: f64) {
    let dated: Vec<(f64, &NightRow)> = rows
        .iter()
        .filter_map(|row| Some((row.mjd?, row)))
        .collect();
    for (at, (mjd, row)) in dated.iter().enumerate() {
        let before = at.checked_sub(1).map_or(*mjd, |at| dated[at].0);
        let after = dated.get(at + 1).map_or(*mjd, |next| next.0);
        let (from, to) = (time.x(0.5 * (before + mjd)), time.x(0.5 * (mjd + after)));
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
        for (shade, color) in [(twilight, "#f0a030"), (moon, "#9a9ac8")] {
            if shade > 0.0 {
                let _ = writeln!(
                    out,
                    "<rect x=\"{from:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"{PLOT}\" fill=\"{color}\" \
                     fill-opacity=\"{shade:.2}\"/>",
                    to - from
                );
            }
        }
    }
}

impl Plot {
    fn has_values(&self, rows: &[NightRow]) -> bool {
        let mut layers = self.layers.iter();
        layers.any(|layer| rows.iter().any(|row| (layer.value)(row).is_some()))
    }

    /// The bounds of what is shown, with some room.
    fn range(&self, rows: &[NightRow]) -> [f64; 2] {
        /// Least range, in the units of the values.
        const MIN: f64 = 0.2;
        if let Some(bounds) = self.bounds {
            return bounds;
        }
        let values = self
            .layers
            .iter()
            .flat_map(|layer| rows.iter().filter_map(layer.value));
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        let room = 0.08 * (high - low).max(MIN);
        [low - room, high + room]
    }

    fn draw(&self, out: &mut String, rows: &[NightRow], time: &TimeAxis, top: f64) {
        let [low, high] = self.range(rows);
        let y = |value: f64| top + PLOT * (high - value) / (high - low);
        let (ticks, decimals) = ticks([low, high]);
        for value in ticks {
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"10\">{value:.decimals$}</text>\
                 <path d=\"M{LEFT} {y:.1}H{RIGHT}\" stroke=\"black\" stroke-opacity=\"0.12\"/>",
                LEFT - 6.0,
                y(value) + 3.5,
                y = y(value),
            );
        }
        frame(out, self.title, top);
        let mut x = RIGHT;
        for layer in self.layers.iter().rev() {
            for row in rows {
                if let (Some(mjd), Some(value)) = (row.mjd, (layer.value)(row)) {
                    let _ = writeln!(
                        out,
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.8\" fill=\"{}\"><title>{} {value:.3}</title></circle>",
                        time.x(mjd),
                        y(value.clamp(low, high)),
                        layer.color,
                        xml_escaped(&row.date),
                    );
                }
            }
            if !layer.name.is_empty() {
                let _ = writeln!(
                    out,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"{}\">{}</text>",
                    top - 5.0,
                    layer.color,
                    layer.name
                );
                x -= 7.0 * layer.name.len() as f64 + 14.0;
            }
        }
    }
}

/// Round values between bounds, and the decimals that they need.
fn ticks([low, high]: [f64; 2]) -> (Vec<f64>, usize) {
    /// Ticks at most.
    const MAX: f64 = 5.0;
    let least = (high - low) / MAX;
    let exponent = libm::floor(libm::log10(least));
    let power = libm::pow(10.0, exponent);
    let step = [1.0, 2.0, 5.0].into_iter().map(|part| part * power);
    let step = step.into_iter().find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let decimals = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
    let first = libm::ceil(low / step);
    let count = (libm::floor(high / step) - first).max(0.0) as u32;
    let ticks = (0..=count).map(|tick| (first + f64::from(tick)) * step);
    (ticks.collect(), decimals)
}

/// The border and the title of a plot.
fn frame(out: &mut String, title: &str, top: f64) {
    let _ = writeln!(
        out,
        "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{PLOT}\" fill=\"none\" stroke=\"black\" \
         stroke-width=\"0.7\"/>\n<text x=\"{LEFT}\" y=\"{:.1}\">{title}</text>",
        RIGHT - LEFT,
        top - 5.0
    );
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

fn draw_keogram(
    out: &mut String,
    rows: &[NightRow],
    cells: &[(usize, f64)],
    time: &TimeAxis,
    top: f64,
) {
    let mag = |row: &NightRow, cell: usize| row.cells.as_ref()?.mag_arcsec2[cell].get();
    let values = rows
        .iter()
        .flat_map(|row| cells.iter().filter_map(move |(cell, _)| mag(row, *cell)));
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return frame(out, "Keogram: no brightness was measured", top);
    }
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| values[(share * (values.len() - 1) as f64) as usize];
    let (bright, dark) = (at(0.01), at(0.99));
    let dated: Vec<(f64, &NightRow)> = rows
        .iter()
        .filter_map(|row| Some((row.mjd?, row)))
        .collect();
    let step = PLOT / cells.len() as f64;
    for (number, (mjd, row)) in dated.iter().enumerate() {
        let before = number.checked_sub(1).map_or(*mjd, |at| dated[at].0);
        let after = dated.get(number + 1).map_or(*mjd, |next| next.0);
        let (from, to) = (time.x(0.5 * (before + mjd)), time.x(0.5 * (mjd + after)));
        for (cell, from_south_deg) in cells {
            let Some(value) = mag(row, *cell) else {
                continue;
            };
            let _ = writeln!(
                out,
                "<rect x=\"{from:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                top + PLOT * (1.0 - from_south_deg / 180.0) - 0.5 * step,
                to - from + 0.3,
                step + 0.3,
                color((dark - value) / (dark - bright).max(1e-9)),
            );
        }
    }
    frame(
        out,
        &format!(
            "Keogram: the meridian, from V {dark:.1} (dark) to {bright:.1} mag/arcsec² (bright)"
        ),
        top,
    );
    for (name, share) in [("N", 0.0), ("zenith", 0.5), ("S", 1.0)] {
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"10\">{name}</text>",
            LEFT - 6.0,
            top + PLOT * share + 3.5
        );
    }
}

fn draw_time(out: &mut String, time: &TimeAxis, bottom: f64) {
    for hour in time.hours() {
        let x = time.x(f64::from(hour) / 24.0);
        let _ = writeln!(
            out,
            "<path d=\"M{x:.1} {bottom}v4\" stroke=\"black\"/><text x=\"{x:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\" font-size=\"10\">{:02}:00</text>",
            bottom + 15.0,
            hour % 24
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"10\">UTC</text>",
        LEFT - 6.0,
        bottom + 15.0
    );
}

/// Numbered lines at the moments, and the list of them.
fn draw_moments(out: &mut String, moments: &[Moment], time: &TimeAxis, bottom: f64) {
    for (number, moment) in moments.iter().enumerate() {
        let x = time.x(moment.mjd);
        let _ = writeln!(
            out,
            "<path d=\"M{x:.1} {TOP}V{:.1}\" stroke=\"{ORANGE}\" stroke-dasharray=\"3 3\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"10\" fill=\"{ORANGE}\">{}</text>\n\
             <text x=\"{LEFT}\" y=\"{:.1}\">{}  {}  {}</text>",
            bottom - GAP,
            TOP - 18.0,
            number + 1,
            bottom + LINE * (number as f64 + 1.5),
            number + 1,
            xml_escaped(&moment.date),
            xml_escaped(&moment.to_text()),
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{LEFT}\" y=\"{:.1}\" font-size=\"10\" fill-opacity=\"0.7\">Orange: twilight. Violet: the Moon \
         is up, darker as more of it is lit.</text>",
        bottom + LINE * (moments.len() as f64 + 2.0)
    );
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

    #[test]
    fn ticks_are_round_values() {
        assert_eq!(
            ticks([0.0, 100.0]),
            (vec![0.0, 20.0, 40.0, 60.0, 80.0, 100.0], 0)
        );
        let (values, decimals) = ticks([20.49, 21.08]);
        assert_eq!(decimals, 1);
        assert_eq!(values.len(), 3);
        assert!((values[0] - 20.6).abs() < 1e-9 && (values[2] - 21.0).abs() < 1e-9);
    }

    #[test]
    fn hours_are_full_ones() {
        let time = TimeAxis {
            first: 61_000.76,
            last: 61_001.1,
        };
        let hours: Vec<u32> = time.hours().map(|hour| hour % 24).collect();
        assert_eq!(hours, [19, 20, 21, 22, 23, 0, 1, 2]);
    }
}
