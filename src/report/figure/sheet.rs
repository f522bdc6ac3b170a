//! Panels side by side.

use super::chart::{Chart, Rooms};
use super::color::Rgb;
use super::drawing::Drawing;
use super::layer::Marks;
use super::panel::Panel;
use super::shape::{DrawnShape, Letters};
use super::svg::{COMMENT, beginning, write_shape};

/// Frame of a panel among others.
const FRAME_PX: [f32; 2] = [350.0, 235.0];
/// Frame of a panel that stands alone.
const ALONE_PX: [f32; 2] = [540.0, 350.0];
const MARGIN_PX: f32 = 16.0;
const TITLE_PX: f32 = 16.0;
const NOTE_PX: f32 = 13.0;
const NOTE_LINE_PX: f32 = 20.0;

/// Panels in lines.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    /// Above all panels.
    pub title: String,
    /// From left to right, and from the first line to the last.
    pub panels: Vec<Panel>,
    /// Panels in a line.
    pub abreast: usize,
    /// Lines of text in the place after the last panel, or below all.
    pub notes: Vec<String>,
    /// Most width and height of a frame.
    pub frame_px: [f32; 2],
    /// Whether panels above each other share their x axis, which the lowest names.
    pub shares_x: bool,
}

impl Sheet {
    /// Panels in lines of at most `abreast`.
    pub fn new(panels: Vec<Panel>, abreast: usize) -> Self {
        let frame_px = if panels.len() == 1 {
            ALONE_PX
        } else {
            FRAME_PX
        };
        Self {
            abreast: abreast.min(panels.len()),
            panels,
            frame_px,
            ..Self::default()
        }
    }

    /// A panel that stands alone.
    pub fn of_one(panel: Panel) -> Self {
        Self::new(vec![panel], 1)
    }

    /// Whether nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.panels.is_empty()
    }

    /// Whether it needs the whole width of a page.
    pub fn is_wide(&self) -> bool {
        self.abreast > 1
    }

    /// Whether areas have colors with a meaning.
    pub fn is_colored(&self) -> bool {
        let mut layers = self.panels.iter().flat_map(|panel| &panel.layers);
        layers.any(|layer| matches!(layer.marks, Marks::Areas(_)))
    }

    /// The figure as SVG.
    pub fn svg(&self) -> String {
        let (size, shapes) = self.shapes();
        let mut svg = beginning(size, COMMENT, Rgb::PAPER);
        for shape in &shapes {
            // Writing into a string does not fail.
            let _ = write_shape(&mut svg, shape);
        }
        svg + "</svg>\n"
    }

    /// The figure as the content of a PNG file.
    ///
    /// # Errors
    /// If it is too large for one.
    #[cfg(feature = "overlay")]
    pub fn png(&self) -> std::io::Result<Vec<u8>> {
        let (size, shapes) = self.shapes();
        super::raster::png(size, &shapes)
    }

    /// Width and height, and what is drawn.
    fn shapes(&self) -> ([usize; 2], Vec<DrawnShape>) {
        let abreast = self.abreast.max(1);
        let last_line = self.panels.len().saturating_sub(abreast);
        let chart = |(number, panel)| {
            let has_x_names = !self.shares_x || number >= last_line;
            Chart::new(panel, self.frame_px, has_x_names)
        };
        let charts: Vec<Chart> = self.panels.iter().enumerate().map(chart).collect();
        let lines = charts.len().div_ceil(abreast);
        // All panels of a column, and all of a line, begin and end together.
        let columns = (0..abreast).map(|column| room(charts.iter().skip(column).step_by(abreast)));
        let columns: Vec<(Rooms, [f32; 2])> = columns.collect();
        let lines_room: Vec<(Rooms, [f32; 2])> = charts
            .chunks(abreast)
            .map(|line| room(line.iter()))
            .collect();
        let title_px = if self.title.is_empty() {
            0.0
        } else {
            2.0 * TITLE_PX
        };
        let mut drawing = Drawing::default();
        if !self.title.is_empty() {
            drawing.text(Letters::new(
                &self.title,
                [MARGIN_PX, TITLE_PX + 4.0],
                TITLE_PX,
            ));
        }
        let mut y = title_px;
        for (line, (rooms, [_, height])) in lines_room.iter().enumerate() {
            let mut x = 0.0;
            for (column, (sides, [width, _])) in columns.iter().enumerate() {
                drawing.origin = [x + sides.left, y + rooms.top];
                if let Some(chart) = charts.get(line * abreast + column) {
                    chart.draw(&mut drawing, sides);
                } else if charts.len() % abreast == column {
                    draw_notes(&mut drawing, &self.notes);
                }
                x += sides.left + width + sides.right;
            }
            y += rooms.top + height + rooms.bottom;
        }
        let width = columns
            .iter()
            .map(|(rooms, size)| rooms.left + size[0] + rooms.right);
        if charts.len() == lines * abreast && !self.notes.is_empty() {
            drawing.origin = [MARGIN_PX, y];
            draw_notes(&mut drawing, &self.notes);
            y += NOTE_LINE_PX * self.notes.len() as f32 + MARGIN_PX;
        }
        (
            [width.sum(), y].map(|side: f32| side.ceil() as usize),
            drawing.shapes,
        )
    }
}

/// The largest rooms and frames of panels.
fn room<'c>(charts: impl Iterator<Item = &'c Chart<'c>>) -> (Rooms, [f32; 2]) {
    charts.fold(Default::default(), |(rooms, [width, height]), chart| {
        let size = [width.max(chart.size[0]), height.max(chart.size[1])];
        (rooms.max(chart.rooms()), size)
    })
}

fn draw_notes(drawing: &mut Drawing, notes: &[String]) {
    for (line, note) in notes.iter().enumerate() {
        let y = NOTE_LINE_PX * (line as f32 + 0.5);
        drawing.text(Letters::new(note, [0.0, y], NOTE_PX));
    }
}
