//! What a real camera does besides: what makes one pixel differ from another, and the light of a star spread otherwise.

use super::DataSheet;
use super::keys::{Key, Limits, key};

/// How the light of a star is spread over the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpotForm {
    /// A Gaussian, integrated over each pixel.
    ///
    /// # Reference
    /// Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, eqs. (1) and (2): IPSF.
    #[doc(alias = "IPSF")]
    #[default]
    Gaussian,
    /// A Gaussian, taken at the middle of each pixel: a model with an error of its own, to compare with. Its light does not add
    /// up to that of the star where the spot is small.
    #[doc(alias = "SPSF")]
    SampledGaussian,
    /// An even disc, as geometrical optics has it far out of focus, integrated over each pixel. Its radius is twice the spot's
    /// standard deviation, which is then its own on each axis.
    Disc,
}

impl SpotForm {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Gaussian, Self::SampledGaussian, Self::Disc];

    /// What it is called in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::SampledGaussian => "sampled-gaussian",
            Self::Disc => "disc",
        }
    }

    /// The form of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|form| form.name() == name)
    }
}

/// What a simulated frame shows of a camera beyond what its limit depends on. The default is a camera without any of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imperfections {
    /// Part of the light lost in the corners; it grows with the square of the distance from the centre.
    pub vignetting: f64,
    /// How far the lens's third-order radial distortion moves a star in the corner away from the centre, in pixels; negative
    /// towards it.
    pub distortion_px: f64,
    /// Decentred lens, along x: displacement in pixels that the second-order term makes at the corner's distance.
    pub decentring_x_px: f64,
    /// The same along y.
    pub decentring_y_px: f64,
    /// Standard deviation of the pixels' response to light, relative to its mean.
    #[doc(alias = "PRNU")]
    pub response_sigma: f64,
    /// Standard deviation of the pixels' dark current, relative to its mean (log-normal).
    #[doc(alias = "DSNU")]
    pub dark_current_sigma: f64,
    /// Hot pixels in a million.
    pub hot_pixels_per_mpx: f64,
    /// Mean dark current of a hot pixel, in electrons a second (exponentially distributed).
    pub hot_pixel_e_s: f64,
    /// Pixels in a million that give the bias whatever the light.
    pub dead_pixels_per_mpx: f64,
    /// Standard deviation of the pixels' bias, in grey levels.
    pub offset_sigma_adu: f64,
    /// Standard deviation of the columns' bias, in grey levels.
    pub column_sigma_adu: f64,
    /// Part of the charge beyond a full pixel that flows to its neighbours in the column; the rest is drained.
    pub blooming: f64,
    /// Depth of the layer in which charge is collected, in µm: how much a cosmic ray leaves.
    pub depth_um: f64,
    /// Seed of all that is the same in every frame of this camera.
    pub pattern_seed: f64,
    /// The form of a star's spot.
    pub spot_form: SpotForm,
    /// Whether the image is reversed left to right.
    pub mirrored: bool,
}

impl Default for Imperfections {
    fn default() -> Self {
        Self {
            vignetting: 0.0,
            distortion_px: 0.0,
            decentring_x_px: 0.0,
            decentring_y_px: 0.0,
            response_sigma: 0.0,
            dark_current_sigma: 0.0,
            hot_pixels_per_mpx: 0.0,
            hot_pixel_e_s: 1000.0,
            dead_pixels_per_mpx: 0.0,
            offset_sigma_adu: 0.0,
            column_sigma_adu: 0.0,
            blooming: 0.0,
            depth_um: 10.0,
            pattern_seed: 1.0,
            spot_form: SpotForm::default(),
            mirrored: false,
        }
    }
}

/// Parts of a whole, 0 and 1 included.
const PART: Limits = Limits::FromTo(0.0, 1.0);
/// Displacements that a lens with one image may have, in pixels.
const DISPLACEMENT_PX: Limits = Limits::FromTo(-1000.0, 1000.0);

/// The numbers of [`Imperfections`] by name. None has to be given.
pub const IMPERFECTION_KEYS: &[Key<DataSheet>] = &[
    key!(vignetting in imperfections, PART, "part of the light lost in the corners"),
    key!(distortion_px in imperfections,
        DISPLACEMENT_PX,
        "radial distortion: how far a star in the corner is moved outward, in pixels"
    ),
    key!(decentring_x_px in imperfections,
        DISPLACEMENT_PX,
        "decentred lens, along x: displacement at the corner's distance, in pixels"
    ),
    key!(decentring_y_px in imperfections,
        DISPLACEMENT_PX,
        "decentred lens, along y: displacement at the corner's distance, in pixels"
    ),
    key!(response_sigma in imperfections,
        PART,
        "standard deviation of the pixels' response to light, relative to its mean"
    ),
    key!(dark_current_sigma in imperfections,
        Limits::FromTo(0.0, 10.0),
        "standard deviation of the pixels' dark current, relative to its mean"
    ),
    key!(hot_pixels_per_mpx in imperfections,
        Limits::FromTo(0.0, 1e6),
        "hot pixels in a million"
    ),
    key!(hot_pixel_e_s in imperfections,
        Limits::NotNegative,
        "mean dark current of a hot pixel, in electrons a second"
    ),
    key!(dead_pixels_per_mpx in imperfections,
        Limits::FromTo(0.0, 1e6),
        "pixels in a million that see no light"
    ),
    key!(offset_sigma_adu in imperfections,
        Limits::NotNegative,
        "standard deviation of the pixels' bias, in grey levels"
    ),
    key!(column_sigma_adu in imperfections,
        Limits::NotNegative,
        "standard deviation of the columns' bias, in grey levels"
    ),
    key!(blooming in imperfections,
        PART,
        "part of the charge beyond a full pixel that flows along its column"
    ),
    key!(depth_um in imperfections,
        Limits::FromTo(0.1, 1000.0),
        "depth in which charge is collected, in µm: for cosmic rays"
    ),
    key!(pattern_seed in imperfections,
        Limits::Whole(0.0, 9_007_199_254_740_991.0),
        "seed of what is the same in every frame of the camera"
    ),
];
