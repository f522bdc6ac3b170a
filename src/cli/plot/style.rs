//! Letters, colors and margins of all figures.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters_backend::BackendCoord;
use starpipe::base::format::printable;
use std::fmt::Display;

/// The family of all letters.
pub(crate) const FONT: &str = "sans-serif";
/// Size of letters.
pub(crate) const LETTERS_PX: u32 = 15;
/// Margin of a chart.
pub(super) const MARGIN_PX: u32 = 10;

/// With [`ORANGE`], a pair of colors that everybody can tell apart.
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
/// The other of the pair.
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);
/// Guides.
pub(super) const GREY: RGBColor = RGBColor(130, 130, 130);
pub(crate) const WHITE: RGBColor = RGBColor(255, 255, 255);
pub(crate) const BLACK: RGBColor = RGBColor(0, 0, 0);

/// Part of a figure to draw on.
pub(crate) type Area<B> = DrawingArea<B, Shift>;

/// A chart with a margin, and with so much room below the x axis and left of the y axis.
pub(crate) fn chart_on<'a, 'b, B: DrawingBackend>(
    area: &'a Area<B>,
    below_px: u32,
    left_px: u32,
) -> ChartBuilder<'a, 'b, B> {
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(MARGIN_PX)
        .margin_top(2)
        // Room for the half of the last number that stands beyond the axis.
        .margin_right(2 * MARGIN_PX)
        .x_label_area_size(below_px)
        .y_label_area_size(left_px);
    builder
}

/// Draws text to the right of `place`, vertically centred.
pub(super) fn draw_text<B: DrawingBackend>(
    area: &Area<B>,
    text: &str,
    size_px: u32,
    place: BackendCoord,
) -> anyhow::Result<()> {
    let style = (FONT, size_px)
        .into_text_style(area)
        .color(&BLACK)
        .pos(Pos::new(HPos::Left, VPos::Center));
    let text = printable(text);
    area.draw_text(&text, &style, place).map_err(plot_error)
}

/// A number as figures label it.
pub(crate) fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// An error of a backend, which borrows the drawing, as an error that does not.
pub(crate) fn plot_error(error: impl Display) -> anyhow::Error {
    anyhow::anyhow!("{error}")
}
