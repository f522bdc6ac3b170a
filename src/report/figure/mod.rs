//! Figures for people: charts and maps, as SVG or PNG.
//!
//! [`PlotLayer`]s of marks over two [`Axis`] → [`Panel`] → [`Sheet`] of panels → SVG or PNG
//!
//! Where a number stands, and what it is called, is decided once, for all figures: round numbers beside the axes,
//! true minus signs, room around points, a legend that covers nothing. Both kinds of files are the same drawing
//! (`DrawnShape`), which overlays of photographs use as well.

mod axis;
mod chart;
mod color;
mod drawing;
mod layer;
#[cfg(feature = "overlay")]
mod letters;
mod panel;
#[cfg(feature = "overlay")]
mod raster;
mod shape;
mod sheet;
mod svg;
#[cfg(test)]
mod tests;
mod ticks;
mod typeset;

pub use axis::{Axis, Spacing};
pub use color::{ColorScale, Rgb, diverging, grey, sequential};
pub use layer::{Area, Dot, Marks, PlotLayer};
pub use panel::{Panel, PanelKind};
pub use sheet::Sheet;
pub use svg::is_figure;

#[cfg(feature = "overlay")]
pub(super) use {
    letters::text_width,
    raster::draw as draw_shape,
    shape::{Anchor, DrawnShape, Halo, Letters, Stroke},
    svg::{beginning, write_shape},
};
