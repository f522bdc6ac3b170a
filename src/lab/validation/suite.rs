//! The hard suite: lenses, spots and detectors that are not those that the pipeline assumes, a run
//! for each, and a row for each run.

use super::summary::ValidationSummary;
use super::validator::ValidationProtocol;
use crate::camera::data_sheet::SpotForm;
use crate::ephemeris::observer::Site;
use crate::lab::simulate::camera_of;
use serde::Serialize;

/// A case of the suite.
#[derive(Debug, Clone, Copy)]
pub struct HardCase {
    /// Name, also of its directory.
    pub name: &'static str,
    /// What is hard about it.
    pub what: &'static str,
    change: fn(&mut ValidationProtocol),
}

impl HardCase {
    /// What is simulated.
    pub fn protocol(&self, base: &ValidationProtocol) -> ValidationProtocol {
        let mut protocol = base.clone();
        (self.change)(&mut protocol);
        protocol
    }
}

/// The cases. Displacements by lenses are in thousandths of half of the diagonal.
pub const HARD_SUITE: [HardCase; 20] = [
    HardCase {
        name: "ideal",
        what: "camera as described",
        change: |_| (),
    },
    HardCase {
        name: "through-air",
        what: "from the ground, up to 70 degrees from the zenith, with refraction",
        change: |run| run.site = Site::new(50.0, 10.0, 300.0).ok(),
    },
    HardCase {
        name: "lens-r3",
        what: "r³ distortion: 2.5 % of the half-diagonal in the corner",
        change: |run| lens(run, &[25.0]),
    },
    HardCase {
        name: "lens-r3-r5",
        what: "r³ and r⁵ distortion: 2.5 % of the half-diagonal in the corner",
        change: |run| lens(run, &[17.0, 8.0]),
    },
    HardCase {
        name: "lens-strong",
        what: "r³ and r⁵ distortion: 6.2 % of the half-diagonal in the corner",
        change: |run| lens(run, &[83.0, -21.0]),
    },
    HardCase {
        name: "lens-r3-r5-r7",
        what: "r³, r⁵ and r⁷ distortion with alternating signs",
        change: |run| lens(run, &[-69.0, 41.0, -17.0]),
    },
    HardCase {
        name: "lens-5-percent",
        what: "r³ distortion: 5 % at the edge of a square frame",
        change: |run| lens(run, &[100.0]),
    },
    HardCase {
        name: "lens-decentred",
        what: "r³ and r⁵ distortion, decentered",
        change: |run| lens(run, &[28.0, -11.0, 0.0, 0.0, 0.0, 2.8, -1.4]),
    },
    HardCase {
        name: "lens-off-centre",
        what: "r³ distortion, and the optical axis off the center by 2 % of the half-diagonal",
        change: |run| lens(run, &[-50.0, 0.0, 0.0, 16.0, 12.0]),
    },
    HardCase {
        name: "spot-disc",
        what: "out of focus: disks of 4 px radius",
        change: |run| {
            let camera = &mut run.setup.scenario.camera;
            camera.imperfections.spot_form = SpotForm::Disc;
            camera.spot_sigma_px = 2.0;
            camera.peak_share = None;
        },
    },
    HardCase {
        name: "spot-smeared",
        what: "stars smeared by 5 px along the rows",
        change: |run| run.setup.scenario.conditions.motion_px = 5.0,
    },
    HardCase {
        name: "spot-elongated",
        what: "spots twice as long as wide, at 30 degrees",
        change: |run| {
            let made = &mut run.setup.scenario.camera.imperfections;
            (made.spot_axis_ratio, made.spot_angle_deg) = (2.0, 30.0);
        },
    },
    HardCase {
        name: "spot-coma",
        what: "coma of 6 px in the corner",
        change: |run| run.setup.scenario.camera.imperfections.coma_px = 6.0,
    },
    HardCase {
        name: "spot-curved-field",
        what: "spots twice as wide in the corner",
        change: |run| {
            let camera = &mut run.setup.scenario.camera;
            // A disc has half of its radius as standard deviation on an axis.
            camera.imperfections.field_curvature_px = 2.0 * 3f64.sqrt() * camera.spot_sigma_px;
        },
    },
    HardCase {
        name: "spot-astigmatism",
        what: "spots twice as long as wide in the corner, radially elongated",
        change: |run| {
            let camera = &mut run.setup.scenario.camera;
            let radius_px = 3f64.sqrt() * camera.spot_sigma_px;
            camera.imperfections.field_curvature_px = radius_px;
            camera.imperfections.astigmatism_px = radius_px;
        },
    },
    HardCase {
        name: "spot-moffat",
        what: "Moffat profile with exponent 2.5",
        change: |run| run.setup.scenario.camera.imperfections.spot_form = SpotForm::Moffat,
    },
    HardCase {
        name: "spot-airy",
        what: "Airy pattern of a pupil with a central obstruction of 33 %",
        change: |run| {
            let made = &mut run.setup.scenario.camera.imperfections;
            (made.spot_form, made.obstruction) = (SpotForm::Airy, 0.33);
        },
    },
    HardCase {
        name: "vignetting",
        what: "60 % of the light lost in the corners",
        change: |run| run.setup.scenario.camera.imperfections.vignetting = 0.6,
    },
    HardCase {
        name: "color-jpeg",
        what: "JPEG of a color camera: demosaiced, smoothed, with a tone curve",
        change: |run| {
            let made = &mut run.setup.scenario.camera.imperfections;
            (made.jpeg_quality, made.tone_gamma, made.denoise_px) = (90.0, 2.2, 0.7);
        },
    },
    HardCase {
        name: "response",
        what: "pixel response varies by 3 %",
        change: |run| run.setup.scenario.camera.imperfections.response_sigma = 0.03,
    },
];

/// Sets the terms of the lens, in thousandths of half of the diagonal: of r³, r⁵ and r⁷, the axis in x and y,
/// decentring, stretch and skew. Those that are not given are 0.
fn lens(run: &mut ValidationProtocol, thousandths: &[f64]) {
    let camera = &mut run.setup.scenario.camera;
    let unit_px = camera_of(camera).radius_px() / 1000.0;
    let made = &mut camera.imperfections;
    [
        made.distortion_px,
        made.distortion5_px,
        made.distortion7_px,
        made.axis_x_px,
        made.axis_y_px,
        made.decentring_x_px,
        made.decentring_y_px,
        made.stretch_px,
        made.skew_px,
    ] = std::array::from_fn(|term| thousandths.get(term).map_or(0.0, |given| given * unit_px));
}

const HEADING: &str = "Mean and standard deviation of error over stated error (0 and 1 expected); NEES (3 expected).

                 frames  right  wrong   NEES     x     y           flux   focal length     zero point   limit  split  notes
";

/// The results of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct HardRow {
    pub case: &'static str,
    pub what: &'static str,
    pub frames: usize,
    pub right: usize,
    pub wrong: usize,
    pub nees_mean: Option<f64>,
    pub nees_sigma: Option<f64>,
    pub pull_x_sd: f64,
    pub pull_y_sd: f64,
    pub pull_flux_mean: f64,
    pub pull_flux_sd: f64,
    pub pull_focal_length_mean: f64,
    pub pull_focal_length_sd: f64,
    pub pull_zero_point_mean: f64,
    pub pull_zero_point_sd: f64,
    pub zero_point_difference_mag: f64,
    pub limit_difference_mag: Option<f64>,
    pub split: u64,
    pub misnamed: u64,
    pub false_per_mpx: f64,
    pub notes: String,
}

impl HardRow {
    /// The row of a case.
    pub fn new(case: &HardCase, summary: &ValidationSummary) -> Self {
        let identification = &summary.identification.all;
        let attitude = summary.attitude.as_ref();
        let pulls = &summary.pulls;
        let notes = summary.notes.iter();
        let notes: Vec<String> = notes.map(|(code, n)| format!("{code} {n}")).collect();
        Self {
            case: case.name,
            what: case.what,
            frames: summary.frames,
            right: identification.right,
            wrong: identification.wrong,
            nees_mean: attitude.map(|a| a.nees_mean),
            nees_sigma: attitude.map(|a| a.nees_sigma),
            pull_x_sd: pulls.x.sd,
            pull_y_sd: pulls.y.sd,
            pull_flux_mean: pulls.flux.mean,
            pull_flux_sd: pulls.flux.sd,
            pull_focal_length_mean: pulls.focal_length.mean,
            pull_focal_length_sd: pulls.focal_length.sd,
            pull_zero_point_mean: pulls.zero_point.mean,
            pull_zero_point_sd: pulls.zero_point.sd,
            zero_point_difference_mag: summary.zero_point.mean,
            limit_difference_mag: summary.completeness.difference_mag,
            split: summary.detection.split,
            misnamed: summary.detection.misnamed,
            false_per_mpx: summary.detection.false_per_mpx,
            notes: notes.join(", "),
        }
    }

    /// `rows` as a table in text.
    pub fn to_text(rows: &[Self]) -> String {
        let mut text = HEADING.to_owned();
        for row in rows {
            text += &row.line();
        }
        text
    }

    fn line(&self) -> String {
        let pull = |mean: f64, sd: f64| format!("{mean:+.2} ± {sd:.2}");
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        format!(
            "{:<16} {:>6} {:>6} {:>6} {:>6} {:>5.2} {:>5.2} {:>14} {:>14} {:>14} {:>7} {:>6}  {}\n",
            self.case,
            self.frames,
            self.right,
            self.wrong,
            or_dash(self.nees_mean.map(|nees| format!("{nees:.2}"))),
            self.pull_x_sd,
            self.pull_y_sd,
            pull(self.pull_flux_mean, self.pull_flux_sd),
            pull(self.pull_focal_length_mean, self.pull_focal_length_sd),
            pull(self.pull_zero_point_mean, self.pull_zero_point_sd),
            or_dash(self.limit_difference_mag.map(|mag| format!("{mag:+.3}"))),
            self.split,
            self.notes,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::lab::simulate::{Scene, Setup};
    use crate::predict::Scenario;

    #[test]
    fn each_case_can_be_simulated_and_has_a_name_of_its_own() {
        for preset in Preset::ALL {
            let base = ValidationProtocol {
                setup: Setup {
                    scenario: Scenario::of(preset),
                    scene: Scene::default(),
                },
                scale_known: false,
                site: None,
                seed: 1,
            };
            let mut names = Vec::new();
            for case in HARD_SUITE {
                let setup = case.protocol(&base).setup;
                assert_eq!(setup.check(), Ok(()), "{} of {preset:?}", case.name);
                assert!(!names.contains(&case.name), "{}", case.name);
                names.push(case.name);
            }
        }
    }
}
