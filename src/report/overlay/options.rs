//! What an overlay shows.

/// How an overlay is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct OverlayOptions {
    /// How the frame becomes a picture.
    pub stretch: Stretch,
    /// Which detections are marked.
    pub rings: Rings,
}

impl OverlayOptions {
    /// Whether a frame is drawn in its own colors.
    pub fn has_colors(&self) -> bool {
        self.stretch != Stretch::Hard
    }
}

/// How a frame becomes a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Stretch {
    /// In proportion, from the lowest level to the highest.
    None,
    /// As a photograph: a dark sky is brightened to a fifth of white.
    #[default]
    Soft,
    /// In grey and without its background, from just below the sky to the level of bright stars: faint stars show.
    Hard,
}

/// Which detections are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Rings {
    /// The brightest identified stars, which have their names; all where the frame is not identified.
    #[default]
    Named,
    /// All detections.
    All,
    /// None.
    None,
}
