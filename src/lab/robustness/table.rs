//! The standard table, sweeps over one parameter, and their results.

use super::protocol::{Mirrored, TrialProtocol};
use super::trial::TrialResults;
use crate::identify::Photometry;
use serde::Serialize;

/// Fields of view of the standard table, in degrees.
const STANDARD_FOV_DEG: [f64; 5] = [2.5, 5.0, 10.0, 20.0, 40.0];
/// The field of view at which the standard table varies other parameters, in degrees.
const VARIED_FOV_DEG: f64 = 10.0;

/// A protocol with its label in a table.
#[derive(Debug, Clone, PartialEq)]
pub struct ProtocolCase {
    /// Label of the case.
    pub label: String,
    /// The protocol.
    pub protocol: TrialProtocol,
}

/// The standard table: `base` at five fields of view, then with one parameter worse at a time.
pub fn standard_cases(base: &TrialProtocol) -> Vec<ProtocolCase> {
    let case = |label: &str, change: &dyn Fn(&mut TrialProtocol)| {
        let mut protocol = TrialProtocol {
            fov_deg: VARIED_FOV_DEG,
            ..*base
        };
        change(&mut protocol);
        ProtocolCase {
            label: label.to_owned(),
            protocol,
        }
    };
    let fields = STANDARD_FOV_DEG
        .map(|fov_deg| case(&format!("{fov_deg}° field"), &|p| p.fov_deg = fov_deg));
    let varied = [
        case("centroids 1 px off", &|p| p.centroid_sigma_px = 1.0),
        case("centroids 2 px off", &|p| p.centroid_sigma_px = 2.0),
        case("magnitudes 0.5 off", &|p| p.mag_sigma = 0.5),
        case("as many false stars as true", &|p| p.false_stars = 1.0),
        case("50 brighter false stars", &|p| p.bright_false_stars = 50),
        case("100 brighter false stars", &|p| p.bright_false_stars = 100),
        case("200 brighter false stars", &|p| p.bright_false_stars = 200),
        case("field of view unknown", &|p| p.scale_error = None),
        case("60° field, unknown", &|p| {
            (p.fov_deg, p.scale_error) = (60.0, None)
        }),
        case("80° field, unknown", &|p| {
            (p.fov_deg, p.scale_error) = (80.0, None)
        }),
        case("half as many stars", &|p| p.mean_stars /= 2.0),
        case("no true star at all", &|p| {
            (p.missing, p.false_stars) = (1.0, 1.0)
        }),
    ];
    fields.into_iter().chain(varied).collect()
}

/// A parameter that can be swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VariedParameter {
    /// Horizontal field of view, in degrees.
    FieldOfView,
    /// Mean number of stars.
    Stars,
    /// Centroid error, in pixels.
    CentroidError,
    /// Magnitude error.
    MagError,
    /// Missing stars, in percent.
    Missing,
    /// False stars, in percent of the true ones.
    FalseStars,
}

impl VariedParameter {
    /// All parameters.
    pub const ALL: [Self; 6] = [
        Self::FieldOfView,
        Self::Stars,
        Self::CentroidError,
        Self::MagError,
        Self::Missing,
        Self::FalseStars,
    ];

    /// Its name as an option.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FieldOfView => "fov",
            Self::Stars => "stars",
            Self::CentroidError => "centroid-error",
            Self::MagError => "mag-error",
            Self::Missing => "missing",
            Self::FalseStars => "false",
        }
    }

    /// Description with unit.
    pub const fn title(self) -> &'static str {
        match self {
            Self::FieldOfView => "horizontal field of view (°)",
            Self::Stars => "mean number of stars per frame",
            Self::CentroidError => "centroid error on each axis (px)",
            Self::MagError => "magnitude error (mag)",
            Self::Missing => "stars missing (%)",
            Self::FalseStars => "false stars (% of the true ones)",
        }
    }

    /// `protocol` with this value of the parameter.
    #[must_use]
    pub fn set(self, protocol: &TrialProtocol, value: f64) -> TrialProtocol {
        let mut changed = *protocol;
        match self {
            Self::FieldOfView => changed.fov_deg = value,
            Self::Stars => changed.mean_stars = value,
            Self::CentroidError => changed.centroid_sigma_px = value,
            Self::MagError => changed.mag_sigma = value,
            Self::Missing => changed.missing = value / 100.0,
            Self::FalseStars => changed.false_stars = value / 100.0,
        }
        changed
    }
}

/// The result of a case: one row of the table. Rates are in percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct CaseResult {
    pub case: String,
    pub fov_deg: f64,
    pub mean_stars: f64,
    pub centroid_error_px: f64,
    pub mag_error: f64,
    pub missing_percent: f64,
    pub false_percent: f64,
    pub bright_false_stars: usize,
    pub scale_error_percent: Option<f64>,
    pub mirrored: Mirrored,
    pub johnson_v: bool,
    pub least_true_stars: usize,
    pub trials: usize,
    pub counted: usize,
    pub right: usize,
    pub wrong: usize,
    pub no_answer: usize,
    pub right_percent: f64,
    pub right_low_percent: f64,
    pub right_high_percent: f64,
    pub wrong_of_all: usize,
    pub wrong_high_percent: f64,
    pub named: usize,
    pub misnamed: usize,
    pub median_ms: f64,
    pub p99_ms: f64,
}

impl CaseResult {
    /// The result of `case` from all its trials. Only trials with at least `least_true_stars` count
    /// in the rates.
    pub fn new(case: &ProtocolCase, all: &TrialResults, least_true_stars: usize) -> Self {
        let counted = all.with_true_stars(least_true_stars);
        let (answers, of_all) = (counted.answers(), all.answers());
        let right = answers.right_interval();
        let (named, misnamed) = counted.names();
        let protocol = &case.protocol;
        Self {
            case: case.label.clone(),
            fov_deg: protocol.fov_deg,
            mean_stars: protocol.mean_stars,
            centroid_error_px: protocol.centroid_sigma_px,
            mag_error: protocol.mag_sigma,
            missing_percent: percent(protocol.missing),
            false_percent: percent(protocol.false_stars),
            bright_false_stars: protocol.bright_false_stars,
            scale_error_percent: protocol.scale_error.map(percent),
            mirrored: protocol.mirrored,
            johnson_v: protocol.photometry == Photometry::JohnsonV,
            least_true_stars,
            trials: all.trials(),
            counted: counted.trials(),
            right: answers.right,
            wrong: answers.wrong,
            no_answer: answers.none,
            right_percent: percent(answers.right_share()),
            right_low_percent: percent(right.low),
            right_high_percent: percent(right.high),
            wrong_of_all: of_all.wrong,
            wrong_high_percent: percent(of_all.wrong_interval().high),
            named,
            misnamed,
            median_ms: milliseconds(all.time_quantile_ms(0.5)),
            p99_ms: milliseconds(all.time_quantile_ms(0.99)),
        }
    }
}

/// A share in percent, to four decimals.
fn percent(share: f64) -> f64 {
    (share * 1e6).round() / 1e4
}

fn milliseconds(time_ms: f64) -> f64 {
    (time_ms * 1e3).round() / 1e3
}
