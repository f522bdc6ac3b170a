//! A panel: layers over two axes, with a title and a legend above.

use super::axis::{Axis, Scale};
use super::layer::{ColorScale, Dot, FilledRectangle, Marks, PlotLayer};
use super::style::{
    Area, FONT, LETTERS_PX, MARGIN_PX, chart_on, draw_text, plot_error, two_digits,
};
use plotters::element::{CoordMapper, Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters_backend::BackendCoord;
use starpipe::base::format::five_digits;

const TITLE_PX: u32 = 17;
/// Height of title and legend.
const HEAD_PX: u32 = 50;
/// Room below the x axis.
const BELOW_PX: u32 = 44;
/// Room left of the y axis.
const LEFT_PX: u32 = 66;
/// Room for a scale of colors.
const BAR_PX: u32 = 84;
/// Opacity of bars.
const PALE: f64 = 0.45;

/// Layers over two axes.
#[derive(Clone)]
pub(crate) struct Panel {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) layers: Vec<PlotLayer>,
}

impl Panel {
    pub(super) fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let (head, body) = area.split_vertically(HEAD_PX);
        self.draw_head(&head)?;
        let scale = self.layers.iter().find_map(|layer| layer.scale.as_ref());
        let body = match scale {
            None => body,
            Some(scale) => {
                let (width, _) = body.dim_in_pixel();
                let (body, side) = body.split_horizontally(width.saturating_sub(BAR_PX));
                draw_scale(&side, scale)?;
                body
            }
        };
        let points: Vec<_> = self.layers.iter().flat_map(PlotLayer::points).collect();
        let x = self.x.range(points.iter().map(|point| point.0));
        let y = self.y.range(points.iter().map(|point| point.1));
        self.draw_chart(&body, Ends { x, y })
    }

    /// Draws the title, and the legend below it.
    fn draw_head<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        const TITLE_Y: i32 = 14;
        const LEGEND_Y: i32 = 38;
        let left = (MARGIN_PX + LEFT_PX) as i32;
        if !self.title.is_empty() {
            draw_text(area, &self.title, TITLE_PX, (left, TITLE_Y))?;
        }
        let mut x = left;
        for layer in &self.layers {
            let Some(label) = &layer.label else {
                continue;
            };
            draw_legend_mark(area, layer, (x, LEGEND_Y))?;
            draw_text(area, label, LETTERS_PX, (x + 24, LEGEND_Y))?;
            let style = (FONT, LETTERS_PX).into_text_style(area);
            let (width, _) = area.estimate_text_size(label, &style).map_err(plot_error)?;
            x += 24 + width as i32 + 12;
        }
        Ok(())
    }

    fn draw_chart<B: DrawingBackend>(&self, area: &Area<B>, ends: Ends) -> anyhow::Result<()> {
        let mut builder = chart_on(area, BELOW_PX, LEFT_PX);
        let (x, y) = (self.x.scale(ends.x), self.y.scale(ends.y));
        let mut context = builder.build_cartesian_2d(x, y).map_err(plot_error)?;
        context
            .configure_mesh()
            .x_desc(&self.x.title)
            .y_desc(&self.y.title)
            .x_label_formatter(&|value| tick(*value))
            .y_label_formatter(&|value| tick(*value))
            .x_labels(8)
            .y_labels(8)
            .label_style((FONT, LETTERS_PX))
            .max_light_lines(1)
            .draw()
            .map_err(plot_error)?;
        let mut chart = Chart {
            context,
            area,
            ends,
        };
        for layer in &self.layers {
            chart.draw(layer)?;
        }
        Ok(())
    }
}

/// The number at a line of an axis. The one at 0 is off by what rounding leaves.
fn tick(value: f64) -> String {
    const ROUNDING: f64 = 1e-12;
    five_digits(if value.abs() < ROUNDING { 0.0 } else { value })
}

/// Draws a bar of colors from bottom to top, with numbers beside it and its title above.
fn draw_scale<B: DrawingBackend>(area: &Area<B>, scale: &ColorScale) -> anyhow::Result<()> {
    const STEPS: i32 = 64;
    const NUMBERS: i32 = 4;
    const WIDTH: i32 = 14;
    const TITLE_Y: i32 = 10;
    const TOP: i32 = 24;
    let (_, height) = area.dim_in_pixel();
    let bottom = height as i32 - BELOW_PX as i32 - MARGIN_PX as i32;
    let y = |step: i32, steps: i32| bottom - (bottom - TOP) * step / steps;
    draw_text(area, &scale.title, LETTERS_PX, (0, TITLE_Y))?;
    for step in 0..STEPS {
        let color = (scale.color_of)((f64::from(step) + 0.5) / f64::from(STEPS));
        let corners = [(0, y(step + 1, STEPS)), (WIDTH, y(step, STEPS))];
        area.draw(&Rectangle::new(corners, color.filled()))
            .map_err(plot_error)?;
    }
    for number in 0..=NUMBERS {
        let value = scale.number_at(f64::from(number) / f64::from(NUMBERS));
        let text = five_digits(two_digits(value));
        draw_text(area, &text, LETTERS_PX, (WIDTH + 6, y(number, NUMBERS)))?;
    }
    Ok(())
}

/// Draws what a layer's marks look like, to the right of `place`.
fn draw_legend_mark<B: DrawingBackend>(
    area: &Area<B>,
    layer: &PlotLayer,
    place: BackendCoord,
) -> anyhow::Result<()> {
    let (x, y) = place;
    let color = layer.color;
    match layer.marks {
        Marks::Dots(_) | Marks::Points(_) => area.draw(&Circle::new((x + 8, y), 4, color.filled())),
        Marks::Bars(_) => {
            let corners = [(x, y - 6), (x + 16, y + 6)];
            area.draw(&Rectangle::new(corners, color.mix(PALE).filled()))
        }
        _ => area.draw(&PathElement::new(
            [(x, y), (x + 18, y)],
            color.stroke_width(2),
        )),
    }
    .map_err(plot_error)
}

/// The first and the last value of both axes.
#[derive(Clone, Copy)]
struct Ends {
    x: [f64; 2],
    y: [f64; 2],
}

/// Axes on which layers are drawn.
struct Chart<'a, B: DrawingBackend> {
    context: ChartContext<'a, B, Cartesian2d<Scale, Scale>>,
    area: &'a Area<B>,
    ends: Ends,
}

impl<B: DrawingBackend> Chart<'_, B> {
    fn draw(&mut self, layer: &PlotLayer) -> anyhow::Result<()> {
        let color = layer.color;
        match &layer.marks {
            Marks::Line(points) => self.draw_line(points, color),
            Marks::Lines(lines) => lines
                .iter()
                .try_for_each(|line| self.draw_line(line, color)),
            Marks::Points(points) => {
                self.draw_all(points.iter().map(|&at| Circle::new(at, 4, color.filled())))
            }
            Marks::Dots(dots) => self.draw_dots(dots, color),
            Marks::Bars(bars) => {
                let pale = color.mix(PALE).filled();
                let bar = |&([from, to], y): &([f64; 2], f64)| {
                    Rectangle::new([(from, 0.0), (to, y)], pale)
                };
                self.draw_all(bars.iter().map(bar))
            }
            Marks::Levels(levels) => {
                let [from, to] = self.ends.x;
                let stroke = color.stroke_width(2);
                let line = |&y: &f64| PathElement::new([(from, y), (to, y)], stroke);
                self.draw_all(levels.iter().map(line))
            }
            Marks::Cells(cells) => self.draw_cells(cells),
            Marks::Texts(texts) => self.draw_texts(texts, color),
        }
    }

    fn draw_all<E, M>(&mut self, elements: impl IntoIterator<Item = E>) -> anyhow::Result<()>
    where
        M: CoordMapper,
        E: Drawable<B, M>,
        for<'e> &'e E: PointCollection<'e, (f64, f64), M>,
    {
        let drawn = self.context.draw_series::<M, E, E, _>(elements);
        drawn.map(drop).map_err(plot_error)
    }

    fn draw_line(&mut self, points: &[(f64, f64)], color: RGBColor) -> anyhow::Result<()> {
        self.draw_all(LineSeries::new(
            points.iter().copied(),
            color.stroke_width(2),
        ))
    }

    /// Draws the intervals within the chart, and the dots above them.
    fn draw_dots(&mut self, dots: &[Dot], color: RGBColor) -> anyhow::Result<()> {
        let [bottom, top] = self.ends.y;
        let interval = |&(x, _, [low, high]): &Dot| {
            let ends = [(x, low.max(bottom)), (x, high.min(top))];
            PathElement::new(ends, color.stroke_width(1))
        };
        self.draw_all(dots.iter().map(interval))?;
        let dot = |&(x, y, _): &Dot| Circle::new((x, y), 3, color.filled());
        self.draw_all(dots.iter().map(dot))
    }

    fn draw_cells(&mut self, cells: &[FilledRectangle]) -> anyhow::Result<()> {
        let Ends {
            x: [left, right],
            y: [bottom, top],
        } = self.ends;
        // Each cell reaches a little under the next ones: white would show through the seams.
        let overlap = [0.003 * (right - left), 0.003 * (top - bottom)];
        let rectangle = |cell: &FilledRectangle| {
            let x = (cell.x[1] + overlap[0]).min(right);
            let y = (cell.y[1] + overlap[1]).min(top);
            Rectangle::new([(cell.x[0], cell.y[0]), (x, y)], cell.color.filled())
        };
        self.draw_all(cells.iter().map(rectangle))
    }

    /// Draws text centred on its place, on a bright background.
    fn draw_texts(&mut self, texts: &[(f64, f64, String)], color: RGBColor) -> anyhow::Result<()> {
        let style = (FONT, LETTERS_PX)
            .into_text_style(self.area)
            .color(&color)
            .pos(Pos::new(HPos::Center, VPos::Center));
        for (x, y, text) in texts {
            let size = self.area.estimate_text_size(text, &style);
            let (width, height) = size.map_err(plot_error)?;
            let half = (width as i32 / 2 + 2, height as i32 / 2);
            let corners = [(-half.0, -half.1), (half.0, half.1)];
            let background = Rectangle::new(corners, WHITE.mix(0.8).filled());
            let text = Text::new(text.clone(), (0, 0), style.clone());
            self.draw_all([EmptyElement::at((*x, *y)) + background + text])?;
        }
        Ok(())
    }
}
