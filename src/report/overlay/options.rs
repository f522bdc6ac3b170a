//! What an overlay shows.

/// How an overlay is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct OverlayOptions {
    /// How the frame becomes a picture.
    pub stretch: Stretch,
    /// Which detections are marked.
    pub rings: Rings,
    /// What stars are called.
    pub label: LabelKind,
    /// What else of the sky is drawn, where the frame is identified.
    pub sky: SkyLayers,
    /// Width of the frame in the picture, in pixels; by default the frame's own or a whole fraction or
    /// multiple of it.
    pub width_px: Option<u32>,
    /// The part of the frame that is shown, for sharing; by default all of it.
    pub cut: Option<PictureCut>,
    /// The kind of file.
    pub format: OverlayFormat,
}

/// A picture for sharing: the middle of the frame in a usual size, with a caption.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureCut {
    /// 1080 × 1080 pixels.
    Square,
    /// 1080 × 1350 pixels.
    Story,
}

impl PictureCut {
    /// Width and height, in pixels, with the caption.
    pub const fn size_px(self) -> [u32; 2] {
        match self {
            Self::Square => [1080, 1080],
            Self::Story => [1080, 1350],
        }
    }
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
    /// As its maker left it: a photograph of 8 bits as it is, linear data ([`Soft`](Self::Soft)) with a dark sky
    /// brightened.
    #[default]
    Auto,
    /// As a photograph: a dark sky is brightened to a fifth of white.
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

/// What stars are called. A star without such a name or number has the next of: name, HD number,
/// Hipparcos number, identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum LabelKind {
    /// By proper name, else by Bayer letter or Flamsteed number: `Rigel`, `α CMi`, `24 Tau`.
    #[default]
    Name,
    /// By Henry Draper number: `HD 34085`.
    Hd,
    /// By Hipparcos number: `HIP 24436`.
    Hip,
}

/// What of the sky is drawn beside its stars. The Moon and the planets, and where site and time are known
/// the horizon, always are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SkyLayers {
    /// The figures and names of the constellations.
    pub constellations: bool,
    /// The brightest clusters, nebulae and galaxies.
    pub deep_sky: bool,
    /// Right ascension and declination.
    pub equatorial_grid: bool,
    /// Azimuth and altitude, where site and time are known.
    pub horizontal_grid: bool,
}

impl SkyLayers {
    /// None of them.
    pub const NONE: Self = Self {
        constellations: false,
        deep_sky: false,
        equatorial_grid: false,
        horizontal_grid: false,
    };
}

impl Default for SkyLayers {
    /// Constellations and deep-sky objects, without grids.
    fn default() -> Self {
        Self {
            constellations: true,
            deep_sky: true,
            ..Self::NONE
        }
    }
}

/// The kind of file of an overlay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum OverlayFormat {
    /// PNG.
    #[default]
    Png,
    /// JPEG.
    Jpeg,
    /// SVG, with the frame as a JPEG within it: marks and names stay sharp, and names can be searched.
    Svg,
}

impl OverlayFormat {
    /// The extension of its files.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
            Self::Svg => "svg",
        }
    }
}
