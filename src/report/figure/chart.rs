//! How a panel is drawn: axes, title, legend, colors and marks.

use super::axis::{Axis, Scale, Spacing};
use super::color::{ColorScale, Rgb};
use super::drawing::{Drawing, width_px, wrapped};
use super::layer::{Area, Dot, Marks, PlotLayer};
use super::panel::{Panel, PanelKind};
use super::shape::{Anchor, Halo, Letters, Stroke};
use super::ticks::Ticks;
use crate::base::format::five_digits;

const TITLE_PX: f32 = 14.0;
const NAME_PX: f32 = 13.0;
const NUMBER_PX: f32 = 12.0;
/// Height of a line of the title and of the legend.
const LINE_PX: f32 = 20.0;
const TICK_PX: f32 = 5.0;
const MINOR_TICK_PX: f32 = 3.0;
/// Between marks of an axis, their names and the name of the axis.
const GAP_PX: f32 = 5.0;
const MARGIN_PX: f32 = 10.0;
const BAR_PX: f32 = 13.0;
const AXIS: Stroke = Stroke::solid(1.0, Rgb([60, 60, 60]));
const GRID: Stroke = Stroke::solid(0.7, Rgb([222, 222, 222]));
/// Width of lines.
const LINE: f32 = 1.8;

/// A panel that knows its place. The upper left corner of its frame is the origin.
pub(super) struct Chart<'a> {
    panel: &'a Panel,
    /// Width and height of the frame.
    pub(super) size: [f32; 2],
    x: Scale,
    y: Scale,
    x_ticks: Ticks,
    y_ticks: Ticks,
    bar: Option<(&'a ColorScale, Scale, Ticks)>,
    title: Vec<String>,
    /// Names in lines, each with its distance from the left.
    legend: Vec<Vec<(f32, &'a PlotLayer)>>,
    has_x_names: bool,
}

/// Room around a frame, in pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rooms {
    pub(super) left: f32,
    pub(super) right: f32,
    pub(super) top: f32,
    pub(super) bottom: f32,
}

impl Rooms {
    /// So much that both have enough.
    pub(super) fn max(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            right: self.right.max(other.right),
            top: self.top.max(other.top),
            bottom: self.bottom.max(other.bottom),
        }
    }
}

impl<'a> Chart<'a> {
    /// The panel with a frame of at most this size; `has_x_names`: whether the x axis has its numbers and its name.
    pub(super) fn new(panel: &'a Panel, most_px: [f32; 2], has_x_names: bool) -> Self {
        let points: Vec<_> = panel.layers.iter().flat_map(PlotLayer::points).collect();
        let near = points_off_the_border(panel);
        let (x, y) = (&panel.x, &panel.y);
        let x_ends = x.ends(points.iter().map(|at| at.0), near.iter().map(|at| at.0));
        let y_ends = y.ends(points.iter().map(|at| at.1), near.iter().map(|at| at.1));
        let size = frame_size(panel.kind, [x_ends, y_ends], most_px);
        let [width, height] = size;
        let heights = |_: &str| NUMBER_PX;
        let bar = panel.layers.iter().find_map(|layer| layer.scale.as_ref());
        let bar = bar.map(|scale| {
            let axis = Axis::log("", scale.is_log);
            let ticks = axis.ticks(scale.ends, height, heights);
            (scale, axis.scale(scale.ends, [height, 0.0]), ticks)
        });
        let named = panel.layers.iter().filter(|layer| layer.label.is_some());
        Self {
            panel,
            size,
            x: x.scale(x_ends, [0.0, width]),
            y: y.scale(y_ends, [height, 0.0]),
            x_ticks: x.ticks(x_ends, width, |name| width_px(name, NUMBER_PX)),
            y_ticks: y.ticks(y_ends, height, heights),
            bar,
            title: wrapped(&panel.title, TITLE_PX, width + MARGIN_PX),
            legend: legend_lines(named, width + MARGIN_PX),
            has_x_names,
        }
    }

    fn has_axes(&self) -> bool {
        self.panel.kind != PanelKind::Bare
    }

    /// The room that it needs around its frame.
    pub(super) fn rooms(&self) -> Rooms {
        let beside = |ticks: &Ticks| {
            let widths = ticks
                .named
                .iter()
                .map(|(_, name)| width_px(name, NUMBER_PX));
            TICK_PX + GAP_PX + widths.fold(0.0, f32::max)
        };
        let name_px = |name: &str| {
            if name.is_empty() {
                MARGIN_PX
            } else {
                MARGIN_PX + GAP_PX + NAME_PX
            }
        };
        let right = self
            .bar
            .as_ref()
            .map_or(2.0 * MARGIN_PX, |(scale, _, ticks)| {
                MARGIN_PX + BAR_PX + beside(ticks) + name_px(&scale.title)
            });
        let lines = self.title.len() + self.legend.len();
        let mut rooms = Rooms {
            left: 2.0 * MARGIN_PX,
            right,
            top: MARGIN_PX + LINE_PX * lines as f32 + GAP_PX,
            bottom: MARGIN_PX,
        };
        if self.has_axes() {
            rooms.left = beside(&self.y_ticks) + name_px(&self.panel.y.title);
            if self.has_x_names {
                rooms.bottom += TICK_PX + GAP_PX + NUMBER_PX + name_px(&self.panel.x.title);
            }
        }
        rooms
    }

    /// Draws it; `sides` is the room left and right of its column.
    pub(super) fn draw(&self, drawing: &mut Drawing, sides: &Rooms) {
        self.draw_head(drawing);
        let is_area = |layer: &&PlotLayer| matches!(layer.marks, Marks::Areas(_));
        let layers = self.panel.layers.iter();
        for layer in layers.clone().filter(is_area) {
            self.draw_layer(drawing, layer);
        }
        if self.has_axes() && self.bar.is_none() {
            self.draw_grid(drawing);
        }
        for layer in layers.filter(|layer| !is_area(layer)) {
            self.draw_layer(drawing, layer);
        }
        if self.has_axes() {
            self.draw_axes(drawing, sides);
        }
        if let Some((scale, place, ticks)) = &self.bar {
            self.draw_bar(drawing, scale, (place, ticks));
        }
    }

    /// Draws the title, and the legend below it.
    fn draw_head(&self, drawing: &mut Drawing) {
        let lines = (self.title.len() + self.legend.len()) as f32;
        let height = |line: usize| LINE_PX * (line as f32 + 0.5 - lines) - GAP_PX;
        for (line, title) in self.title.iter().enumerate() {
            drawing.text(Letters::new(title, [0.0, height(line)], TITLE_PX));
        }
        for (line, names) in self.legend.iter().enumerate() {
            let y = height(self.title.len() + line);
            for (x, layer) in names {
                draw_legend_mark(drawing, layer, [*x, y]);
                let label = layer.label.as_deref().unwrap_or_default();
                drawing.text(Letters::new(label, [x + LEGEND_MARK_PX, y], NUMBER_PX));
            }
        }
    }

    fn draw_grid(&self, drawing: &mut Drawing) {
        let [width, height] = self.size;
        for (value, _) in &self.x_ticks.named {
            let x = self.x.px(*value);
            drawing.line(&[[x, 0.0], [x, height]], GRID);
        }
        for (value, _) in &self.y_ticks.named {
            let y = self.y.px(*value);
            drawing.line(&[[0.0, y], [width, y]], GRID);
        }
    }

    /// Draws the border, with marks outside, their names, and the names of the axes.
    fn draw_axes(&self, drawing: &mut Drawing, sides: &Rooms) {
        let [width, height] = self.size;
        draw_border(drawing, [0.0, width], height);
        let mut mark = |from: [f32; 2], to: [f32; 2]| drawing.line(&[from, to], AXIS);
        for value in &self.x_ticks.minor {
            let x = self.x.px(*value);
            mark([x, height], [x, height + MINOR_TICK_PX]);
        }
        for (value, _) in &self.x_ticks.named {
            let x = self.x.px(*value);
            mark([x, height], [x, height + TICK_PX]);
        }
        for value in &self.y_ticks.minor {
            let y = self.y.px(*value);
            mark([-MINOR_TICK_PX, y], [0.0, y]);
        }
        for (value, _) in &self.y_ticks.named {
            let y = self.y.px(*value);
            mark([-TICK_PX, y], [0.0, y]);
        }
        for (value, name) in &self.y_ticks.named {
            let at = [-TICK_PX - GAP_PX, self.y.px(*value)];
            drawing.text(Letters::new(name, at, NUMBER_PX).anchored(Anchor::End));
        }
        let left = MARGIN_PX + 0.5 * NAME_PX - sides.left;
        let title = &self.panel.y.title;
        if !title.is_empty() {
            drawing.text(Letters::upright(title, [left, 0.5 * height], NAME_PX));
        }
        if self.has_x_names {
            let y = height + TICK_PX + GAP_PX + 0.5 * NUMBER_PX;
            for (value, name) in &self.x_ticks.named {
                let at = [self.x.px(*value), y];
                drawing.text(Letters::new(name, at, NUMBER_PX).anchored(Anchor::Middle));
            }
            let at = [0.5 * width, y + 0.5 * (NUMBER_PX + NAME_PX) + GAP_PX];
            let title = &self.panel.x.title;
            if !title.is_empty() {
                drawing.text(Letters::new(title, at, NAME_PX).anchored(Anchor::Middle));
            }
        }
    }

    /// Draws the colors beside the frame, with their numbers and what they are.
    fn draw_bar(
        &self,
        drawing: &mut Drawing,
        scale: &ColorScale,
        (place, ticks): (&Scale, &Ticks),
    ) {
        const STEPS: usize = 64;
        let [width, height] = self.size;
        let [left, right] = [width + MARGIN_PX, width + MARGIN_PX + BAR_PX];
        for step in 0..STEPS {
            let color = (scale.palette)((step as f64 + 0.5) / STEPS as f64);
            let y = |step: usize| height * (1.0 - step as f32 / STEPS as f32);
            let (below, above) = (y(step), y(step + 1));
            drawing.polygon(
                &[[left, below], [right, below], [right, above], [left, above]],
                color,
                "",
            );
        }
        draw_border(drawing, [left, right], height);
        let minor = ticks.minor.iter().map(|value| (*value, MINOR_TICK_PX));
        let named = ticks.named.iter().map(|(value, _)| (*value, TICK_PX));
        for (value, length) in minor.chain(named) {
            let y = place.px(value);
            drawing.line(&[[right, y], [right + length, y]], AXIS);
        }
        for (value, name) in &ticks.named {
            let at = [right + TICK_PX + GAP_PX, place.px(*value)];
            drawing.text(Letters::new(name, at, NUMBER_PX));
        }
        let at = [
            width + self.rooms().right - MARGIN_PX - 0.5 * NAME_PX,
            0.5 * height,
        ];
        drawing.text(Letters::upright(&scale.title, at, NAME_PX));
    }

    fn draw_layer(&self, drawing: &mut Drawing, layer: &PlotLayer) {
        let color = layer.color;
        let [width, height] = self.size;
        let stroke = Stroke::solid(LINE, color);
        match &layer.marks {
            Marks::Line(points) => self.draw_line(drawing, points, stroke),
            Marks::Lines(lines) => lines
                .iter()
                .for_each(|line| self.draw_line(drawing, line, stroke)),
            Marks::Dots(dots) => self.draw_dots(drawing, dots, color),
            Marks::Bars(bars) => {
                for (x, y) in bars {
                    let note = format!(
                        "{} to {}: {}",
                        five_digits(x[0]),
                        five_digits(x[1]),
                        five_digits(*y)
                    );
                    let bar = Area::rectangle(*x, [0.0, *y], pale(color));
                    self.draw_area(drawing, &Area { note, ..bar });
                }
            }
            Marks::Levels(levels) => {
                let stroke = Stroke::solid(1.2, color);
                for y in levels.iter().map(|y| self.y.px(*y)) {
                    self.draw_clipped(drawing, &[[0.0, y], [width, y]], stroke);
                }
            }
            Marks::Moments(moments) => {
                for (x, name) in moments.iter().map(|(x, name)| (self.x.px(*x), name)) {
                    let dash = Some(3.5);
                    let stroke = Stroke {
                        width: 1.0,
                        color,
                        dash,
                    };
                    self.draw_clipped(drawing, &[[x, 0.0], [x, height]], stroke);
                    draw_label(drawing, name, [x, NUMBER_PX], color);
                }
            }
            Marks::Areas(areas) => areas.iter().for_each(|area| self.draw_area(drawing, area)),
            Marks::Texts(texts) => {
                for (x, y, text) in texts {
                    draw_label(drawing, text, self.place(*x, *y), color);
                }
            }
        }
    }

    fn place(&self, x: f64, y: f64) -> [f32; 2] {
        [self.x.px(x), self.y.px(y)]
    }

    /// Draws what of a line is within the frame.
    fn draw_line(&self, drawing: &mut Drawing, points: &[(f64, f64)], stroke: Stroke) {
        let points: Vec<[f32; 2]> = points.iter().map(|(x, y)| self.place(*x, *y)).collect();
        let is_known = |at: &[f32; 2]| at.iter().all(|along| along.is_finite());
        for run in points.split(|at| !is_known(at)) {
            self.draw_clipped(drawing, run, stroke);
        }
    }

    fn draw_clipped(&self, drawing: &mut Drawing, points: &[[f32; 2]], stroke: Stroke) {
        if points.iter().all(|at| self.has(*at)) {
            if points.len() > 1 {
                drawing.line(points, stroke);
            }
            return;
        }
        for pair in points.windows(2) {
            if let Some(part) = within([pair[0], pair[1]], self.size) {
                drawing.line(&part, stroke);
            }
        }
    }

    /// Whether a place is within the frame.
    fn has(&self, at: [f32; 2]) -> bool {
        const ROUNDING_PX: f32 = 0.01;
        let mut along = at.iter().zip(self.size);
        along.all(|(at, size)| (-ROUNDING_PX..=size + ROUNDING_PX).contains(at))
    }

    /// Draws the errors as far as they are within the frame, and the dots above them.
    fn draw_dots(&self, drawing: &mut Drawing, dots: &[Dot], color: Rgb) {
        /// More dots are smaller.
        const MANY: usize = 150;
        let radius = if dots.len() > MANY { 2.2 } else { 3.2 };
        let shown = dots.iter().filter(|dot| self.has(self.place(dot.x, dot.y)));
        let stroke = Stroke::solid(1.2, color);
        for dot in shown.clone() {
            if let Some([low, high]) = dot.y_range {
                self.draw_line(drawing, &[(dot.x, low), (dot.x, high)], stroke);
            }
            if let Some([left, right]) = dot.x_range {
                self.draw_line(drawing, &[(left, dot.y), (right, dot.y)], stroke);
            }
        }
        for dot in shown {
            let note = if dot.note.is_empty() {
                self.note_of(dot)
            } else {
                dot.note.clone()
            };
            drawing.disk(self.place(dot.x, dot.y), radius, color, &note);
        }
    }

    /// The numbers of a dot.
    fn note_of(&self, dot: &Dot) -> String {
        let with_range = |value: f64, range: Option<[f64; 2]>| match range {
            None => five_digits(value),
            Some([low, high]) => {
                format!(
                    "{} ({} to {})",
                    five_digits(value),
                    five_digits(low),
                    five_digits(high)
                )
            }
        };
        let y = with_range(dot.y, dot.y_range);
        match self.panel.y.spacing {
            Spacing::Named(_) => with_range(dot.x, dot.x_range),
            _ => format!("{}: {y}", with_range(dot.x, dot.x_range)),
        }
    }

    fn draw_area(&self, drawing: &mut Drawing, area: &Area) {
        let [width, height] = self.size;
        let corner = |(x, y): &(f64, f64)| {
            let [x, y] = self.place(*x, *y);
            [x.clamp(0.0, width), y.clamp(0.0, height)]
        };
        let corners: Vec<[f32; 2]> = area.points.iter().map(corner).collect();
        if corners.iter().flatten().all(|along| along.is_finite()) {
            drawing.polygon(&corners, area.color, &area.note);
        }
    }
}

/// The points that must not lie on the border, which ends maps and carries bars: dots, and for the y axis lines.
fn points_off_the_border(panel: &Panel) -> Vec<(f64, f64)> {
    let fills = |layer: &PlotLayer| layer.scale.is_some() || matches!(layer.marks, Marks::Bars(_));
    if panel.kind != PanelKind::Chart || panel.layers.iter().any(fills) {
        return Vec::new();
    }
    let points = |layer: &PlotLayer| match &layer.marks {
        Marks::Dots(_) => layer.points(),
        Marks::Line(line) => line.iter().map(|(_, y)| (f64::NAN, *y)).collect(),
        _ => Vec::new(),
    };
    panel.layers.iter().flat_map(points).collect()
}

/// Room for what a layer looks like, before its name.
const LEGEND_MARK_PX: f32 = 24.0;

/// The names of layers in lines of at most this width, each with its distance from the left.
fn legend_lines<'a>(
    layers: impl Iterator<Item = &'a PlotLayer>,
    most_px: f32,
) -> Vec<Vec<(f32, &'a PlotLayer)>> {
    let mut lines: Vec<Vec<(f32, &PlotLayer)>> = Vec::new();
    let mut x = 0.0;
    for layer in layers {
        let label = layer.label.as_deref().unwrap_or_default();
        let width = LEGEND_MARK_PX + width_px(label, NUMBER_PX);
        match lines.last_mut() {
            Some(line) if x + width <= most_px => line.push((x, layer)),
            _ => {
                x = 0.0;
                lines.push(vec![(0.0, layer)]);
            }
        }
        x += width + MARGIN_PX;
    }
    lines
}

/// Draws what a layer's marks look like, to the right of `at`.
fn draw_legend_mark(drawing: &mut Drawing, layer: &PlotLayer, [x, y]: [f32; 2]) {
    const HALF_PX: f32 = 5.0;
    const WIDTH_PX: f32 = 18.0;
    let [left, right] = [x, x + WIDTH_PX];
    match &layer.marks {
        Marks::Dots(dots) => {
            let middle = 0.5 * (left + right);
            if dots.iter().any(|dot| dot.y_range.is_some()) {
                let error = [[middle, y - 1.4 * HALF_PX], [middle, y + 1.4 * HALF_PX]];
                drawing.line(&error, Stroke::solid(1.2, layer.color));
            }
            drawing.disk([middle, y], 3.2, layer.color, "");
        }
        Marks::Bars(_) | Marks::Areas(_) => {
            let [top, bottom] = [y - HALF_PX, y + HALF_PX];
            let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
            let color = match layer.marks {
                Marks::Bars(_) => pale(layer.color),
                _ => layer.color,
            };
            drawing.polygon(&corners, color, "");
        }
        _ => drawing.line(&[[left, y], [right, y]], Stroke::solid(LINE, layer.color)),
    }
}

/// Draws text centred on a place, with a bright border.
fn draw_label(drawing: &mut Drawing, text: &str, at: [f32; 2], color: Rgb) {
    let halo = Some(Halo {
        width: 3.0,
        color: Rgb::PAPER,
    });
    drawing.text(Letters {
        color,
        halo,
        ..Letters::new(text, at, NUMBER_PX).anchored(Anchor::Middle)
    });
}

fn draw_border(drawing: &mut Drawing, [left, right]: [f32; 2], height: f32) {
    let corners = [
        [left, 0.0],
        [right, 0.0],
        [right, height],
        [left, height],
        [left, 0.0],
    ];
    drawing.line(&corners, AXIS);
}

/// The color of bars.
fn pale(color: Rgb) -> Rgb {
    color.mixed(Rgb::PAPER, 0.5)
}

/// Width and height of a frame: those of its plane in the scale that fits both.
fn frame_size(kind: PanelKind, ends: [[f64; 2]; 2], most_px: [f32; 2]) -> [f32; 2] {
    if kind == PanelKind::Chart {
        return most_px;
    }
    let lengths = ends.map(|[from, to]| (to - from).abs() as f32);
    let scale = (most_px[0] / lengths[0]).min(most_px[1] / lengths[1]);
    lengths.map(|length| (length * scale).max(1.0))
}

/// The part of a line that is within a frame (Liang & Barsky 1984).
fn within([from, to]: [[f32; 2]; 2], size: [f32; 2]) -> Option<[[f32; 2]; 2]> {
    let (mut first, mut last) = (0.0f32, 1.0f32);
    for axis in 0..2 {
        let step = to[axis] - from[axis];
        for (toward, room) in [(-step, from[axis]), (step, size[axis] - from[axis])] {
            if toward == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if toward < 0.0 {
                first = first.max(room / toward);
            } else {
                last = last.min(room / toward);
            }
        }
    }
    let at = |part: f32| [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
    (first < last).then(|| [at(first), at(last)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_frame() {
        let size = [10.0, 10.0];
        assert_eq!(
            within([[-5.0, 5.0], [15.0, 5.0]], size),
            Some([[0.0, 5.0], [10.0, 5.0]])
        );
        assert_eq!(within([[-5.0, 11.0], [15.0, 11.0]], size), None);
    }

    #[test]
    fn maps_have_one_scale_on_both_axes() {
        let ends = [[0.0, 3000.0], [2000.0, 0.0]];
        assert_eq!(
            frame_size(PanelKind::Map, ends, [300.0, 300.0]),
            [300.0, 200.0]
        );
        assert_eq!(
            frame_size(PanelKind::Chart, ends, [300.0, 300.0]),
            [300.0; 2]
        );
    }
}
