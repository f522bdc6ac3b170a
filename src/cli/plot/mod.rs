//! Figures for people, as SVG or PNG.

mod finer;
pub(crate) mod panel;

use anyhow::Context;
use clap::ValueEnum;
use clap::builder::{PathBufValueParser, TypedValueParser};
use finer::Finer;
use panel::Sheet;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use starpipe::report::overlay;
use std::fmt::Display;
use std::path::PathBuf;

/// The family of all letters.
pub(crate) const FONT: &str = "sans-serif";
/// Two colours that everybody can tell apart.
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);

/// Where a figure goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlotFile {
    pub(crate) path: PathBuf,
    form: Form,
}

/// What a figure is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Svg,
    Png,
}

/// What figures are drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum FigureForm {
    /// Lines and letters
    Svg,
    /// Pixels
    Png,
    /// Not at all
    None,
}

impl PlotFile {
    /// The form is told from the name.
    fn new(path: PathBuf) -> Result<Self, String> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        let form = match extension.to_ascii_lowercase().as_str() {
            "svg" => Form::Svg,
            "png" => Form::Png,
            _ => return Err("figures are .svg or .png".to_owned()),
        };
        Ok(Self { path, form })
    }

    /// Parses the value of an option.
    pub(crate) fn parser() -> impl TypedValueParser<Value = Self> {
        PathBufValueParser::new().try_map(Self::new)
    }

    /// The file with the figure in it, to be written.
    pub(crate) fn with(&self, figure: &impl Figure) -> anyhow::Result<(PathBuf, Vec<u8>)> {
        Ok((self.path.clone(), rendered(figure, self.form)?))
    }
}

/// Part of a figure to draw on.
pub(crate) type Area<B> = DrawingArea<B, Shift>;

/// About a chart.
pub(crate) const MARGIN_PX: u32 = 10;
pub(crate) const LETTERS_PX: u32 = 15;

/// A chart with a margin, and with so much room below the axis of x and left of that of y.
pub(crate) fn chart_on<'a, 'b, B: DrawingBackend>(
    area: &'a Area<B>,
    axis_px: (u32, u32),
) -> ChartBuilder<'a, 'b, B> {
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(MARGIN_PX)
        .margin_top(2)
        // The last number of the axis is as wide.
        .margin_right(2 * MARGIN_PX)
        .x_label_area_size(axis_px.0)
        .y_label_area_size(axis_px.1);
    builder
}

/// Something to be drawn.
pub(crate) trait Figure {
    /// Width and height.
    fn size_px(&self) -> (u32, u32);

    /// Draws it on white.
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()>;
}

/// The figure as the content of a file.
pub(crate) fn rendered(figure: &impl Figure, form: Form) -> anyhow::Result<Vec<u8>> {
    // Without it there would be no letters: the system's fonts are not looked for.
    register_font(FONT, FontStyle::Normal, overlay::FONT)
        .map_err(|_| anyhow::anyhow!("the built-in font is no font"))?;
    let (width, height) = figure.size_px();
    match form {
        Form::Svg => {
            let mut drawing = String::new();
            draw(
                figure,
                SVGBackend::with_string(&mut drawing, (width, height)),
            )?;
            Ok(drawing.into_bytes())
        }
        Form::Png => {
            let size = (width * finer::FACTOR, height * finer::FACTOR);
            let mut pixels = vec![0; size.0 as usize * size.1 as usize * 3];
            draw(figure, Finer(BitMapBackend::with_buffer(&mut pixels, size)))?;
            png(&pixels, size)
        }
    }
}

/// Names and contents of the files of sheets.
pub(crate) fn drawn(
    sheets: Vec<(&str, Sheet)>,
    form: FigureForm,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let (form, extension) = match form {
        FigureForm::Svg => (Form::Svg, "svg"),
        FigureForm::Png => (Form::Png, "png"),
        FigureForm::None => return Ok(Vec::new()),
    };
    let file = |(name, sheet): (&str, Sheet)| {
        let drawing = rendered(&sheet, form).with_context(|| format!("drawing {name}"))?;
        Ok((format!("{name}.{extension}"), drawing))
    };
    sheets.into_iter().map(file).collect()
}

/// Red, green and blue of each pixel as the content of a PNG file.
fn png(pixels: &[u8], (width, height): (u32, u32)) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(bytes)
}

fn draw<B: DrawingBackend>(figure: &impl Figure, backend: B) -> anyhow::Result<()> {
    let area = backend.into_drawing_area();
    area.fill(&WHITE).map_err(said)?;
    figure.draw(&area)?;
    area.present().map_err(said)
}

/// Draws words of so many pixels, with this side of their middle at `place`.
pub(crate) fn draw_words<B: DrawingBackend>(
    area: &Area<B>,
    words: &str,
    (size_px, side): (u32, HPos),
    place: (i32, i32),
) -> anyhow::Result<()> {
    let style = (FONT, size_px)
        .into_text_style(area)
        .color(&BLACK)
        .pos(Pos::new(side, VPos::Center));
    area.draw_text(words, &style, place).map_err(said)
}

/// The backend's errors borrow the drawing; their words do not.
pub(crate) fn said(error: impl Display) -> anyhow::Error {
    anyhow::anyhow!("{error}")
}
