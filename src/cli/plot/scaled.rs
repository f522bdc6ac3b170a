//! A backend with several pixels for each unit, so that PNG figures are sharp.
//!
//! Everything is drawn in the units of the SVG figure, so that both are the same picture. Larger
//! letters alone would not do: lines, dots, margins and panels would have to grow with them, each
//! in its place. Rendering the SVG would need an SVG renderer, which is larger than starpipe.

use plotters::style::{FontDesc, RGBAColor, TextStyle};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

/// Pixels in a unit, on either axis.
pub(super) const FACTOR: u32 = 2;

/// Draws on the backend `B` with [`FACTOR`] pixels for each unit.
pub(super) struct Scaled<B>(pub(super) B);

type Drawn<B> = Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

struct Style {
    color: BackendColor,
    stroke_width: u32,
}

impl BackendStyle for Style {
    fn color(&self) -> BackendColor {
        self.color
    }

    fn stroke_width(&self) -> u32 {
        self.stroke_width
    }
}

fn scaled_style(style: &impl BackendStyle) -> Style {
    Style {
        color: style.color(),
        stroke_width: style.stroke_width() * FACTOR,
    }
}

fn scaled((x, y): BackendCoord) -> BackendCoord {
    (x * FACTOR as i32, y * FACTOR as i32)
}

impl<B: DrawingBackend> DrawingBackend for Scaled<B> {
    type ErrorType = B::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        let (width, height) = self.0.get_size();
        (width / FACTOR, height / FACTOR)
    }

    fn ensure_prepared(&mut self) -> Drawn<B> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Drawn<B> {
        self.0.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn<B> {
        let next = scaled((point.0 + 1, point.1 + 1));
        let last = (next.0 - 1, next.1 - 1);
        self.0.draw_rect(scaled(point), last, &color, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn<B> {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn<B> {
        let (from, to) = (scaled(upper_left), scaled(bottom_right));
        self.0.draw_rect(from, to, &scaled_style(style), fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn<B> {
        self.0
            .draw_path(path.into_iter().map(scaled), &scaled_style(style))
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn<B> {
        let style = scaled_style(style);
        self.0
            .draw_circle(scaled(center), radius * FACTOR, &style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Drawn<B> {
        self.0.fill_polygon(corners.into_iter().map(scaled), style)
    }

    fn draw_text<T: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &T,
        place: BackendCoord,
    ) -> Drawn<B> {
        let size = style.size() * f64::from(FACTOR);
        let font = FontDesc::new(style.family(), size, style.style()).transform(style.transform());
        let BackendColor { rgb, alpha } = style.color();
        let color = RGBAColor(rgb.0, rgb.1, rgb.2, alpha);
        let style = TextStyle::from(font).color(&color).pos(style.anchor());
        self.0.draw_text(text, &style, scaled(place))
    }
}
