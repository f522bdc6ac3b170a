//! Figures for people, as SVG or PNG.
//!
//! [`PlotLayer`]s of marks over two [`Axis`] → [`Panel`] → [`Sheet`] of panels → [`Figure::render`]

mod axis;
mod figure;
mod files;
mod layer;
mod panel;
mod scaled;
mod sheet;
mod style;

pub(crate) use axis::{Axis, Scale};
pub(crate) use figure::{Figure, Form};
pub(crate) use files::{FigureForm, PlotFile, figure_files};
pub(crate) use layer::{ColorScale, Dot, FilledRectangle, Marks, PlotLayer};
pub(crate) use panel::Panel;
pub(crate) use sheet::Sheet;
pub(crate) use style::{
    Area, BLACK, BLUE, FONT, LETTERS_PX, ORANGE, WHITE, chart_on, plot_error, two_digits,
};
