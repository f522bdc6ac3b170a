//! Rendering of figures.

use super::scaled::{FACTOR, Scaled};
use super::style::{Area, FONT, plot_error};
use plotters::prelude::*;
use plotters::style::register_font;
use starpipe::report::overlay;

/// What a figure is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Svg,
    Png,
}

/// A figure that can be drawn on any backend.
pub(crate) trait Figure {
    /// Width and height.
    fn size_px(&self) -> (u32, u32);

    /// Draws it on white.
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()>;

    /// The content of a file with the figure.
    fn render(&self, form: Form) -> anyhow::Result<Vec<u8>>
    where
        Self: Sized,
    {
        // The built-in font: plotters does not look for those of the system.
        register_font(FONT, FontStyle::Normal, overlay::FONT)
            .map_err(|_| anyhow::anyhow!("the built-in font is no font"))?;
        let (width, height) = self.size_px();
        match form {
            Form::Svg => {
                let mut drawing = String::new();
                let backend = SVGBackend::with_string(&mut drawing, (width, height));
                draw_on(self, backend)?;
                Ok(drawing.into_bytes())
            }
            Form::Png => {
                let (width, height) = (width * FACTOR, height * FACTOR);
                let mut pixels = vec![0; width as usize * height as usize * 3];
                let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
                draw_on(self, Scaled(backend))?;
                png(&pixels, width, height)
            }
        }
    }
}

fn draw_on<B: DrawingBackend>(figure: &impl Figure, backend: B) -> anyhow::Result<()> {
    let area = backend.into_drawing_area();
    area.fill(&WHITE).map_err(plot_error)?;
    figure.draw(&area)?;
    area.present().map_err(plot_error)
}

/// Red, green and blue of each pixel as the content of a PNG file.
fn png(pixels: &[u8], width: u32, height: u32) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(bytes)
}
