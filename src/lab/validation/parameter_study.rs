//! Studies over one parameter: a run for each of its values, and a row for each run.

use super::summary::ValidationSummary;
use crate::base::format::five_digits;
use crate::base::units::RAD_PER_DEG;
use crate::camera::focal_length_px;
use crate::lab::simulate::{Setup, SetupParameter};
use crate::predict::{Spacing, UnknownParameter};
use serde::Serialize;

/// What a study varies.
#[derive(Debug, Clone, Copy)]
pub enum StudyParameter {
    /// A parameter of the camera, of the conditions or of the scene.
    Setup(SetupParameter),
    /// The horizontal field of view, in degrees, by the focal length; pixels and spot stay the
    /// same.
    FieldOfView,
}

impl StudyParameter {
    const FIELD_OF_VIEW: &'static str = "fov_deg";

    /// The parameter with this name.
    ///
    /// # Errors
    /// [`UnknownParameter`].
    pub fn named(name: &str) -> Result<Self, UnknownParameter> {
        if name == Self::FIELD_OF_VIEW {
            return Ok(Self::FieldOfView);
        }
        SetupParameter::named(name).map(Self::Setup)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Setup(parameter) => parameter.name(),
            Self::FieldOfView => Self::FIELD_OF_VIEW,
        }
    }

    /// The title of its axis in a figure.
    pub fn title(self) -> String {
        match self {
            Self::Setup(parameter) => parameter.title(),
            Self::FieldOfView => "horizontal field of view (°)".to_owned(),
        }
    }

    /// Gives it a value.
    pub fn set(self, setup: &mut Setup, value: f64) {
        match self {
            Self::Setup(parameter) => parameter.set(setup, value),
            Self::FieldOfView => {
                let sheet = &mut setup.scenario.camera;
                let pitch_um = (sheet.pitch_x_um * sheet.pitch_y_um).sqrt();
                let focal_px = focal_length_px(sheet.width_px as f64, value * RAD_PER_DEG);
                sheet.focal_length_mm = focal_px * pitch_um * 1e-3;
            }
        }
    }
}

/// The results of a run at one value of the parameter.
#[derive(Debug, Clone, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct StudyRow {
    pub parameter: &'static str,
    pub value: f64,
    pub frames: usize,
    pub right: usize,
    pub none: usize,
    pub wrong: usize,
    pub right_percent: f64,
    pub right_low_percent: f64,
    pub right_high_percent: f64,
    pub wrong_high_percent: f64,
    pub detected: u64,
    pub named: u64,
    pub misnamed: u64,
    pub misnamed_companions: u64,
    pub false_per_mpx: f64,
    pub false_low_per_mpx: f64,
    pub false_high_per_mpx: f64,
    pub predicted_limit_vmag: f64,
    pub measured_limit_vmag: Option<f64>,
    pub measured_limit_sigma_mag: Option<f64>,
    pub limit_difference_mag: Option<f64>,
    pub centroid_ratio: Option<f64>,
    pub centroid_ratio_sigma: Option<f64>,
    pub boresight_p50_arcsec: Option<f64>,
    pub boresight_p95_arcsec: Option<f64>,
    pub roll_p50_arcsec: Option<f64>,
    pub roll_p95_arcsec: Option<f64>,
    pub nees_mean: Option<f64>,
    pub nees_sigma: Option<f64>,
    pub pull_x_sd: f64,
    pub pull_y_sd: f64,
    pub pull_flux_sd: f64,
    pub faintest_difference_mag: f64,
    pub faintest_difference_sigma_mag: f64,
    /// Title of an axis of the parameter.
    #[serde(skip)]
    pub title: String,
    /// Whether the values have even ratios.
    #[serde(skip)]
    pub is_log: bool,
}

impl StudyRow {
    /// The row of a run with this value of the parameter.
    pub fn new(
        parameter: StudyParameter,
        value: f64,
        spacing: Spacing,
        summary: &ValidationSummary,
    ) -> Self {
        let identification = &summary.identification.all;
        let (detection, completeness) = (&summary.detection, &summary.completeness);
        let attitude = summary.attitude.as_ref();
        let pulls = &summary.pulls;
        Self {
            parameter: parameter.name(),
            value,
            frames: summary.frames,
            right: identification.right,
            none: identification.none,
            wrong: identification.wrong,
            right_percent: identification.right_percent,
            right_low_percent: identification.right_low_percent,
            right_high_percent: identification.right_high_percent,
            wrong_high_percent: identification.wrong_high_percent,
            detected: detection.detected,
            named: detection.named,
            misnamed: detection.misnamed,
            misnamed_companions: detection.misnamed_companions,
            false_per_mpx: detection.false_per_mpx,
            false_low_per_mpx: detection.false_low_per_mpx,
            false_high_per_mpx: detection.false_high_per_mpx,
            predicted_limit_vmag: completeness
                .predicted_fit_vmag
                .unwrap_or(completeness.predicted_limit_vmag),
            measured_limit_vmag: completeness.measured_limit_vmag,
            measured_limit_sigma_mag: completeness.measured_limit_sigma_mag,
            limit_difference_mag: completeness.difference_mag,
            centroid_ratio: summary.centroids.ratio,
            centroid_ratio_sigma: summary.centroids.ratio_sigma,
            boresight_p50_arcsec: attitude.map(|a| a.boresight_arcsec.p50),
            boresight_p95_arcsec: attitude.map(|a| a.boresight_arcsec.p95),
            roll_p50_arcsec: attitude.map(|a| a.roll_arcsec.p50),
            roll_p95_arcsec: attitude.map(|a| a.roll_arcsec.p95),
            nees_mean: attitude.map(|a| a.nees_mean),
            nees_sigma: attitude.map(|a| a.nees_sigma),
            pull_x_sd: pulls.x.sd,
            pull_y_sd: pulls.y.sd,
            pull_flux_sd: pulls.flux.sd,
            faintest_difference_mag: summary.faintest.mean,
            faintest_difference_sigma_mag: summary.faintest.mean_sigma,
            title: parameter.title(),
            is_log: spacing == Spacing::Log,
        }
    }

    /// `rows` as text, a table for each parameter.
    pub fn to_text(rows: &[Self]) -> String {
        let mut text = String::new();
        for rows in rows.chunk_by(|a, b| a.parameter == b.parameter) {
            text += &format!("{:>26}{HEADING}", rows[0].parameter);
            for row in rows {
                text += &row.line();
            }
        }
        text
    }

    fn line(&self) -> String {
        let or_dash = |value: Option<f64>, decimals: usize| {
            value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
        };
        let interval = format!(
            "{:.2} to {:.2}",
            self.right_low_percent, self.right_high_percent
        );
        format!(
            "{:>26} {:>7} {:>7} {:>6} {:>6} {:>8.2} {interval:>19} {:>8} {:>8} {:>9} {:>9} {:>7} {:>7}\n",
            five_digits(self.value),
            self.frames,
            self.right,
            self.none,
            self.wrong,
            self.right_percent,
            or_dash(self.measured_limit_vmag, 3),
            or_dash(self.limit_difference_mag, 3),
            or_dash(self.centroid_ratio, 3),
            or_dash(self.boresight_p50_arcsec, 2),
            or_dash(self.boresight_p95_arcsec, 2),
            or_dash(self.nees_mean, 2),
        )
    }
}

/// The heading of the rows, after the name of the parameter.
const HEADING: &str = "  frames   right   none  wrong  right %                95 %    limit    minus  ratio to boresight    95 %    NEES
                                                                                             V expected     bound off ″, 50            of 3
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::lab::simulate::Scene;
    use crate::predict::Scenario;

    #[test]
    fn the_focal_length_follows_the_field_of_view() {
        let mut setup = Setup {
            scenario: Scenario::of(Preset::NanosatTracker),
            scene: Scene::default(),
        };
        StudyParameter::FieldOfView.set(&mut setup, 10.0);
        let sheet = setup.scenario.camera;
        let half_width_um = 0.5 * sheet.width_px as f64 * sheet.pitch_x_um;
        let half_rad = (half_width_um * 1e-3 / sheet.focal_length_mm).atan();
        assert!((2.0 * half_rad.to_degrees() - 10.0).abs() < 1e-9);
    }
}
