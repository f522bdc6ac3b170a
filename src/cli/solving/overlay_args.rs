//! How overlays are drawn.

use clap::{Args, ValueEnum};
use starpipe::report::overlay::{
    LabelKind, OverlayFormat, OverlayOptions, PictureCut, Rings, Stretch,
};

#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub(super) struct OverlayArgs {
    /// Brightness scale of the picture
    #[arg(long, value_enum, default_value_t = StretchOption::Auto, requires = "out")]
    stretch: StretchOption,
    /// Detections to mark
    #[arg(long, value_enum, default_value_t = RingsOption::Named, requires = "out")]
    rings: RingsOption,
    /// Labels of the stars
    #[arg(long, value_enum, default_value_t = LabelOption::Name, requires = "out")]
    label: LabelOption,
    /// What else to draw, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "WHAT",
        value_delimiter = ',',
        default_value = "constellations,deep-sky",
        requires = "out"
    )]
    draw: Vec<SkyOption>,
    /// Width of the picture, in pixels [default: that of the frame, or a whole fraction or multiple of it]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=20_000), requires = "out")]
    overlay_width: Option<u32>,
    /// Crop the picture for sharing, with a caption: 1080 × 1080 or 1080 × 1350 pixels
    #[arg(
        long,
        value_enum,
        value_name = "SIZE",
        conflicts_with = "overlay_width",
        requires = "out"
    )]
    overlay_for: Option<CutOption>,
    /// File format of the picture: FRAME.png, FRAME.jpg or FRAME.svg
    #[arg(long, value_enum, default_value_t = FormatOption::Png, requires = "out")]
    overlay_format: FormatOption,
}

/// How an overlay shows the frame.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum StretchOption {
    /// 8-bit photographs are unchanged, the dark sky of linear data (FITS, 16 bits) is brightened
    Auto,
    /// Original levels
    None,
    /// A dark sky is brightened
    Soft,
    /// The sky background is subtracted, so that faint stars show
    Hard,
}

/// Which detections an overlay marks.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum RingsOption {
    /// The brightest identified stars, with their names; all detections if the frame is not identified
    Named,
    /// All
    All,
    /// None
    None,
}

/// What stars are called.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum LabelOption {
    /// By name: Rigel, α CMi, 24 Tau
    Name,
    /// By Henry Draper number: HD 34085
    Hd,
    /// By Hipparcos number: HIP 24436
    Hip,
}

/// What else of the sky is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SkyOption {
    /// Nothing
    None,
    /// Figures and names of the constellations
    Constellations,
    /// The brightest clusters, nebulae and galaxies
    DeepSky,
    /// Right ascension and declination
    Grid,
    /// Azimuth and altitude, if site and time are known
    AltazGrid,
}

/// Cuts for sharing.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum CutOption {
    /// 1080 × 1080 pixels
    Square,
    /// 1080 × 1350 pixels
    Story,
}

/// Kinds of files.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum FormatOption {
    /// Lossless
    Png,
    /// Small files
    Jpg,
    /// Marks and labels as vectors, over the frame as JPEG
    Svg,
}

impl OverlayArgs {
    /// How to draw overlays.
    pub(super) fn options(&self) -> OverlayOptions {
        let mut options = OverlayOptions::default();
        options.stretch = match self.stretch {
            StretchOption::Auto => Stretch::Auto,
            StretchOption::None => Stretch::None,
            StretchOption::Soft => Stretch::Soft,
            StretchOption::Hard => Stretch::Hard,
        };
        options.rings = match self.rings {
            RingsOption::Named => Rings::Named,
            RingsOption::All => Rings::All,
            RingsOption::None => Rings::None,
        };
        options.label = match self.label {
            LabelOption::Name => LabelKind::Name,
            LabelOption::Hd => LabelKind::Hd,
            LabelOption::Hip => LabelKind::Hip,
        };
        let draws = |what| self.draw.contains(&what);
        options.sky.constellations = draws(SkyOption::Constellations);
        options.sky.deep_sky = draws(SkyOption::DeepSky);
        options.sky.equatorial_grid = draws(SkyOption::Grid);
        options.sky.horizontal_grid = draws(SkyOption::AltazGrid);
        options.width_px = self.overlay_width;
        options.cut = self.overlay_for.map(|cut| match cut {
            CutOption::Square => PictureCut::Square,
            CutOption::Story => PictureCut::Story,
        });
        options.format = match self.overlay_format {
            FormatOption::Png => OverlayFormat::Png,
            FormatOption::Jpg => OverlayFormat::Jpeg,
            FormatOption::Svg => OverlayFormat::Svg,
        };
        options
    }
}
