//! The kinds of frames: skies with clutter, and pictures of no sky.

use serde::Serialize;

/// A kind of frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClutterKind {
    /// Stars alone, to compare with.
    Clean,
    /// Branches with leaves before the sky, dark or lit by lamps.
    Foliage,
    /// Roofs, walls with lit windows, wires.
    Edges,
    /// The sky mirrored in a window, ghosts of lamps in the lens, specks of light.
    Reflections,
    /// Clouds that dim the stars and are lit from below.
    Clouds,
    /// Stars trailed by a few pixels.
    Trails,
    /// As many false stars as true ones.
    FalseStars,
    /// Eight bits, the black level above the sky in parts of the frame.
    BlackLevel,
    /// Mosaic of colors, demosaiced, tone curve, JPEG of quality 70.
    Jpeg,
    /// No sky: white noise.
    Noise,
    /// No sky: noise with structure of all sizes.
    ColoredNoise,
    /// No sky: star-like spots at random.
    Dots,
    /// No sky: lines of text.
    Text,
    /// No sky: lines, circles and rectangles.
    Drawings,
    /// No sky: foliage before an even background.
    FoliageAlone,
    /// No sky: a facade with lit windows.
    Windows,
    /// No sky: falling snow in the light of a flash.
    Snow,
    /// No sky: lamps out of focus.
    Bokeh,
    /// Half the focal length: four times the stars, of which many blend.
    Blends,
    /// Hot pixels, one in a few thousand.
    HotPixels,
    /// Cosmic rays.
    CosmicRays,
}

impl ClutterKind {
    /// All of them.
    pub const ALL: [Self; 21] = [
        Self::Clean,
        Self::Foliage,
        Self::Edges,
        Self::Reflections,
        Self::Clouds,
        Self::Trails,
        Self::FalseStars,
        Self::BlackLevel,
        Self::Jpeg,
        Self::Blends,
        Self::HotPixels,
        Self::CosmicRays,
        Self::Noise,
        Self::ColoredNoise,
        Self::Dots,
        Self::Text,
        Self::Drawings,
        Self::FoliageAlone,
        Self::Windows,
        Self::Snow,
        Self::Bokeh,
    ];

    /// Its name in options and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Foliage => "foliage",
            Self::Edges => "edges",
            Self::Reflections => "reflections",
            Self::Clouds => "clouds",
            Self::Trails => "trails",
            Self::FalseStars => "false-stars",
            Self::BlackLevel => "black-level",
            Self::Jpeg => "jpeg",
            Self::Noise => "noise",
            Self::ColoredNoise => "colored-noise",
            Self::Dots => "dots",
            Self::Text => "text",
            Self::Drawings => "drawings",
            Self::FoliageAlone => "foliage-alone",
            Self::Windows => "windows",
            Self::Snow => "snow",
            Self::Bokeh => "bokeh",
            Self::Blends => "blends",
            Self::HotPixels => "hot-pixels",
            Self::CosmicRays => "cosmic-rays",
        }
    }

    /// The kind called `name`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Whether its frames show the sky.
    pub const fn is_sky(self) -> bool {
        !matches!(
            self,
            Self::Noise
                | Self::ColoredNoise
                | Self::Dots
                | Self::Text
                | Self::Drawings
                | Self::FoliageAlone
                | Self::Windows
                | Self::Snow
                | Self::Bokeh
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_json_and_no_two_are_the_same() {
        for kind in ClutterKind::ALL {
            assert_eq!(ClutterKind::named(kind.name()), Some(kind));
            let json = serde_json::to_string(&kind).unwrap();
            assert_eq!(json, format!("\"{}\"", kind.name()));
        }
        assert_eq!(ClutterKind::named("sky"), None);
    }
}
