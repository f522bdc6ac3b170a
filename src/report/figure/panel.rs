//! A panel: layers over two axes, with a title and a legend above.

use super::axis::Axis;
use super::layer::PlotLayer;

/// Layers over two axes.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Above the panel.
    pub title: String,
    /// From left to right.
    pub x: Axis,
    /// From bottom to top.
    pub y: Axis,
    /// What is drawn, the last above the others; areas lie below everything.
    pub layers: Vec<PlotLayer>,
    /// What the panel is.
    pub kind: PanelKind,
}

/// What a panel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PanelKind {
    /// One quantity over another.
    #[default]
    Chart,
    /// A plane with axes, both of one scale: its border is that of the frame.
    Map,
    /// A plane of one scale, without axes and border.
    Bare,
}
