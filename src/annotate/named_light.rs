//! Is the light at a star's place the star's, and was it measured?

use super::View;
use crate::base::coords::PixelPoint;
use crate::identify::SourceIndex;
use crate::solve::Source;

/// Why the light of a star in a frame is not its measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unmeasured {
    /// Its spot is saturated.
    Saturated,
    /// Its light is that of several stars.
    Blended,
    /// Its spot is wider than a star's: a trail, a glow, or a disc.
    Extended,
    /// It is at the border of the frame.
    Border,
    /// Its place and brightness do not make its name as sure as other names are.
    Uncertain,
}

impl Unmeasured {
    /// Its name in JSON.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Saturated => "saturated",
            Self::Blended => "blended",
            Self::Extended => "extended",
            Self::Border => "border",
            Self::Uncertain => "uncertain",
        }
    }

    /// What a detection without a name says of the star whose light it is.
    fn of(source: &Source) -> Self {
        let Some(flags) = source.measured.map(|measured| measured.flags) else {
            return Self::Uncertain;
        };
        match flags {
            _ if flags.saturated => Self::Saturated,
            _ if !flags.is_star_like() => Self::Extended,
            _ if flags.blended => Self::Blended,
            _ if flags.border => Self::Border,
            _ => Self::Uncertain,
        }
    }
}

/// The detections without a name, brightest first, and those with one.
pub(super) struct Lights<'a> {
    view: &'a View<'a>,
    is_named: Vec<bool>,
}

impl<'a> Lights<'a> {
    pub fn new(view: &'a View<'a>) -> Self {
        let mut is_named = vec![false; view.solution.sources.len()];
        for named in &view.found.matches {
            is_named[named.source.get()] = true;
        }
        for body in view.solution.bodies.iter().filter_map(|body| body.source) {
            is_named[body.get()] = true;
        }
        Self { view, is_named }
    }

    /// The brightest light within `reach_px` of a place, and what it says of the star there. A named light is
    /// that of another star.
    pub fn at(&self, place: &PixelPoint, reach_px: f64) -> Option<(SourceIndex, Unmeasured)> {
        let sources = self
            .view
            .solution
            .sources
            .iter()
            .zip(&self.is_named)
            .enumerate();
        let mut near = sources.filter(|(_, (source, _))| {
            let (dx, dy) = (source.position.x - place.x, source.position.y - place.y);
            dx * dx + dy * dy < reach_px * reach_px
        });
        let (index, (source, is_named)) = near.next()?;
        let why = if *is_named {
            Unmeasured::Blended
        } else {
            Unmeasured::of(source)
        };
        Some((SourceIndex::new(index), why))
    }
}
