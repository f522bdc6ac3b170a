//! Panels side by side.

use super::figure::Figure;
use super::layer::Marks;
use super::panel::Panel;
use super::style::{Area, LETTERS_PX, draw_text};
use plotters::prelude::DrawingBackend;

const PANEL_PX: (u32, u32) = (440, 330);
/// A panel that stands alone.
const ALONE_PX: (u32, u32) = (640, 440);
/// Where notes begin in the place of a panel.
const NOTES_PX: (i32, i32) = (76, 50);

/// Panels in lines.
pub(crate) struct Sheet {
    panels: Vec<Panel>,
    /// Panels in a line.
    abreast: usize,
    /// Lines of text in the place after the last panel.
    pub(crate) notes: Vec<String>,
}

impl Sheet {
    /// Panels in lines of at most `abreast`.
    pub(crate) fn new(panels: Vec<Panel>, abreast: usize) -> Self {
        Self {
            abreast: abreast.min(panels.len()),
            panels,
            notes: Vec::new(),
        }
    }

    /// A panel that stands alone.
    pub(crate) fn of_one(panel: Panel) -> Self {
        Self::new(vec![panel], 1)
    }

    /// Whether nothing is drawn.
    pub(crate) fn is_empty(&self) -> bool {
        self.panels.is_empty()
    }

    /// Whether it needs the whole width of a page.
    pub(crate) fn is_wide(&self) -> bool {
        self.abreast > 1
    }

    /// Whether areas have colors with a meaning.
    pub(crate) fn is_colored(&self) -> bool {
        let mut layers = self.panels.iter().flat_map(|panel| &panel.layers);
        layers.any(|layer| matches!(layer.marks, Marks::Cells(_)))
    }

    fn lines(&self) -> usize {
        self.panels.len().div_ceil(self.abreast)
    }
}

impl Figure for Sheet {
    fn size_px(&self) -> (u32, u32) {
        match self.panels.len() {
            1 => ALONE_PX,
            _ => {
                let (width, height) = PANEL_PX;
                (width * self.abreast as u32, height * self.lines() as u32)
            }
        }
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let places = area.split_evenly((self.lines(), self.abreast));
        for (place, panel) in places.iter().zip(&self.panels) {
            panel.draw(place)?;
        }
        let Some(rest) = places.get(self.panels.len()) else {
            return Ok(());
        };
        for (line, note) in self.notes.iter().enumerate() {
            let y = NOTES_PX.1 + line as i32 * (LETTERS_PX as i32 + 8);
            draw_text(rest, note, LETTERS_PX, (NOTES_PX.0, y))?;
        }
        Ok(())
    }
}
