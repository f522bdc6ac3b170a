//! Deviations of a real camera from the ideal: the lens, differences between pixels, the form of
//! spots.

use crate::camera::{LENS_TERMS, Projection};

/// Form of a star's spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SpotForm {
    /// A Gaussian, integrated over each pixel.
    ///
    /// # Reference
    /// Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, eqs. (1) and (2): IPSF.
    #[doc(alias = "IPSF")]
    #[default]
    Gaussian,
    /// A Gaussian, sampled at the centre of each pixel. An approximation for comparison: the light
    /// of a small spot does not add up to that of the star.
    #[doc(alias = "SPSF")]
    SampledGaussian,
    /// A uniform disc, the geometric image far out of focus, integrated over each pixel. Its radius
    /// is twice the spot's standard deviation, so that its standard deviation along each axis is
    /// the same.
    Disc,
    /// Moffat's profile, as turbulent air makes it: a core with wide wings. Its full width at half
    /// maximum is that of a Gaussian of the spot's standard deviation; its exponent
    /// [`Imperfections::moffat_beta`].
    Moffat,
    /// Airy's pattern of a pupil with a central [`Imperfections::obstruction`]. Without obstruction
    /// its full width at half maximum is that of a Gaussian of the spot's standard deviation.
    Airy,
    /// A picture, integrated over each pixel: [`DataSheet::spot_image`](super::DataSheet::spot_image).
    File,
}

impl SpotForm {
    /// All forms.
    pub const ALL: [Self; 6] = [
        Self::Gaussian,
        Self::SampledGaussian,
        Self::Disc,
        Self::Moffat,
        Self::Airy,
        Self::File,
    ];

    /// Name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::SampledGaussian => "sampled-gaussian",
            Self::Disc => "disc",
            Self::Moffat => "moffat",
            Self::Airy => "airy",
            Self::File => "file",
        }
    }

    /// The form called `name`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|form| form.name() == name)
    }
}

/// Part of the light of the centre that reaches a place whose distance from the centre, over that of
/// the corner, has this square; `vignetting` is the share that is lost in the corners.
pub fn lens_transmission(vignetting: f64, off_centre_sq: f64) -> f64 {
    (1.0 - vignetting * off_centre_sq).max(0.0)
}

/// Properties of a camera that affect simulated frames, but not the limiting magnitude of its
/// centre. The default has none of them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Imperfections {
    /// Share of the light lost in the corners; it grows with the square of the distance from the
    /// centre.
    pub vignetting: f64,
    /// Third-order radial distortion: displacement of a star in the corner, in pixels, positive
    /// away from the centre.
    pub distortion_px: f64,
    /// Fifth-order radial distortion: the same.
    pub distortion5_px: f64,
    /// Seventh-order radial distortion: the same.
    pub distortion7_px: f64,
    /// Decentred lens, along x: displacement by the second-order term at the distance of the
    /// corner, in pixels.
    pub decentring_x_px: f64,
    /// The same along y.
    pub decentring_y_px: f64,
    /// Where the axis of the lens meets the frame: right of its centre, in pixels.
    pub axis_x_px: f64,
    /// The same, below its centre.
    pub axis_y_px: f64,
    /// Unequal scales: displacement of a star by a larger scale along x, and a smaller one along y, at
    /// the distance of the corner, in pixels.
    pub stretch_px: f64,
    /// The same of a larger scale along the diagonal from the upper left.
    pub skew_px: f64,
    /// Standard deviation of the pixels' response to light, relative to its mean.
    #[doc(alias = "PRNU")]
    pub response_sigma: f64,
    /// Standard deviation of the pixels' dark current, relative to its mean (log-normal).
    #[doc(alias = "DSNU")]
    pub dark_current_sigma: f64,
    /// Hot pixels per million pixels.
    pub hot_pixels_per_mpx: f64,
    /// Mean dark current of a hot pixel, in electrons per second (exponentially distributed).
    pub hot_pixel_e_s: f64,
    /// Dead pixels per million pixels. They show the bias whatever the light.
    pub dead_pixels_per_mpx: f64,
    /// Standard deviation of the pixels' bias, in grey levels.
    pub offset_sigma_adu: f64,
    /// Standard deviation of the columns' bias, in grey levels.
    pub column_sigma_adu: f64,
    /// Share of the charge above full well that flows to the neighbors in the column; the rest is
    /// lost.
    pub blooming: f64,
    /// Depth of the layer that collects charge, in µm. It determines the charge of a cosmic ray.
    pub depth_um: f64,
    /// Seed of the pixel pattern, which is the same in every frame of the camera.
    pub pattern_seed: f64,
    /// Longer over shorter axis of the spot; the product of both stays that of a round spot.
    pub spot_axis_ratio: f64,
    /// Direction of the longer axis, from x towards y, in degrees.
    pub spot_angle_deg: f64,
    /// Coma: length of the flare of a star in the corner, in pixels, outward positive; it grows
    /// with the distance from the centre.
    pub coma_px: f64,
    /// Astigmatism: half of the length of the line that a star in the corner is drawn out to, in
    /// pixels, radial if positive; it grows with the square of the distance.
    pub astigmatism_px: f64,
    /// Curvature of the field: radius of the disc of a star in the corner, in pixels; it grows with
    /// the square of the distance.
    pub field_curvature_px: f64,
    /// Exponent of Moffat's profile.
    pub moffat_beta: f64,
    /// Diameter of the central obstruction of the pupil, over that of the pupil.
    pub obstruction: f64,
    /// Distance of the samples of a spot from a file, in pixels.
    pub spot_step_px: f64,
    /// Quality of the JPEG that a color camera writes; 0: it writes raw frames.
    pub jpeg_quality: f64,
    /// Exponent of the tone curve of that JPEG; 1: none.
    pub tone_gamma: f64,
    /// Standard deviation of the smoothing against noise before that JPEG, in pixels.
    pub denoise_px: f64,
    /// The form of a star's spot.
    pub spot_form: SpotForm,
    /// The ideal lens that the camera's comes closest to.
    pub projection: Projection,
    /// Angle from the axis up to which a lens that is no pinhole images the sky, in degrees.
    pub field_radius_deg: f64,
    /// Whether the image is reversed left to right.
    pub mirrored: bool,
}

impl Imperfections {
    /// Displacement by each term of the lens, in the order of
    /// [`DistortionModel::Stretched`](crate::camera::DistortionModel::Stretched), in pixels, outward
    /// positive.
    pub fn lens_terms_px(&self) -> [f64; LENS_TERMS] {
        [
            self.distortion_px,
            self.distortion5_px,
            self.distortion7_px,
            self.axis_x_px,
            self.axis_y_px,
            self.decentring_x_px,
            self.decentring_y_px,
            self.stretch_px,
            self.skew_px,
        ]
    }
}

impl Default for Imperfections {
    fn default() -> Self {
        Self {
            vignetting: 0.0,
            distortion_px: 0.0,
            distortion5_px: 0.0,
            distortion7_px: 0.0,
            decentring_x_px: 0.0,
            decentring_y_px: 0.0,
            axis_x_px: 0.0,
            axis_y_px: 0.0,
            stretch_px: 0.0,
            skew_px: 0.0,
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
            spot_axis_ratio: 1.0,
            spot_angle_deg: 0.0,
            coma_px: 0.0,
            astigmatism_px: 0.0,
            field_curvature_px: 0.0,
            moffat_beta: 2.5,
            obstruction: 0.0,
            spot_step_px: 0.2,
            jpeg_quality: 0.0,
            tone_gamma: 1.0,
            denoise_px: 0.0,
            spot_form: SpotForm::default(),
            projection: Projection::Pinhole,
            field_radius_deg: 90.0,
            mirrored: false,
        }
    }
}
