//! The eleven figures of the paper: the limiting magnitude over one parameter each.
//!
//! Each has two curves, for exposures of 0.04 s and 0.5 s; the figure over the exposure has them
//! for apertures of 100 mm and 50 mm. In the available scan of the paper the curves and the ends of
//! the axes are lost: the ranges here are chosen to show what its text describes.
//!
//! # Reference
//! Tong, Li & Wang 2014, section 3, figures 3 and 4.

use super::check::ScenarioError;
use super::scenario::Scenario;
use super::sweep::{CurveValues, Spacing, Sweep, SweepCurve, SweepError, curves};

/// Number of values along a figure's axis.
const VALUES: usize = 96;

/// A figure of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperFigure {
    /// Number and letter in the paper: `3a`.
    pub id: &'static str,
    /// Title.
    pub title: &'static str,
    /// Name of the parameter along the axis.
    pub parameter: &'static str,
    /// First and last value of the parameter.
    pub range: [f64; 2],
    /// Spacing of the values.
    pub spacing: Spacing,
    /// The parameter that differs between the curves.
    pub series: CurveValues,
}

impl PaperFigure {
    /// All eleven figures.
    pub const ALL: [Self; 11] = [
        Self::over("3a", "Lens transmission", "lens_transmission", [0.1, 1.0]),
        Self::over("3b", "Aperture", "aperture_mm", [5.0, 200.0]),
        Self::over("3c", "Focal length", "focal_length_mm", [20.0, 500.0]),
        Self::over(
            "3d",
            "Peak quantum efficiency",
            "quantum_efficiency",
            [0.1, 1.0],
        ),
        Self::over("3e", "Pixel area", "pixel_area_um2", [10.0, 400.0]),
        Self::over(
            "3f",
            "Share of the brightest pixel",
            "peak_share",
            [0.02, 1.0],
        ),
        Self::over("3g", "Dark current", "dark_current_e_s", [0.0, 1e5]),
        Self {
            series: CurveValues::PAPER_APERTURES,
            ..Self::over("3h", "Exposure", "exposure_s", [0.005, 1.0])
        },
        Self::over(
            "4a",
            "Transmission of the air, 555 nm",
            "zenith_transmission",
            [0.02, 0.95],
        ),
        Self::over("4b", "Zenith distance", "zenith_distance_deg", [0.0, 88.0]),
        Self {
            spacing: Spacing::Log,
            ..Self::over(
                "4c",
                "Illuminance by the sky",
                "sky_illuminance_lx",
                [1e-4, 0.1],
            )
        },
    ];

    const fn over(
        id: &'static str,
        title: &'static str,
        parameter: &'static str,
        range: [f64; 2],
    ) -> Self {
        Self {
            id,
            title,
            parameter,
            range,
            spacing: Spacing::Linear,
            series: CurveValues::PAPER_EXPOSURES,
        }
    }

    /// Name of its file without extension: `figure-3b-aperture`.
    pub fn file_stem(&self) -> String {
        let words: Vec<String> = self
            .title
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(str::to_lowercase)
            .collect();
        format!("figure-{}-{}", self.id, words.join("-"))
    }

    /// The values along the axis.
    ///
    /// # Errors
    /// None for the figures of [`Self::ALL`].
    pub fn sweep(&self) -> Result<Sweep, SweepError> {
        Sweep::new(self.parameter, self.range, VALUES, self.spacing)
    }

    /// The curves for the camera and the conditions of `base`.
    ///
    /// # Errors
    /// [`ScenarioError`] if a value has no limit.
    pub fn curves(&self, base: &Scenario, sweep: &Sweep) -> Result<Vec<SweepCurve>, ScenarioError> {
        curves(base, sweep, &self.series)
    }
}

#[cfg(test)]
mod tests;
