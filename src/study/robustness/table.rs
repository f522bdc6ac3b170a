//! Protocols in rows: the standard table, sweeps over one parameter, and what came of each.

use super::{Answer, Mirrored, Protocol, Tally};
use crate::identify::Photometry;
use serde::Serialize;

/// Fields of view of the standard table, in degrees.
pub const STANDARD_FOV_DEG: [f64; 5] = [2.5, 5.0, 10.0, 20.0, 40.0];
/// The field of view at which the standard table varies the rest, in degrees.
pub const VARIED_FOV_DEG: f64 = 10.0;

/// A protocol, and what it is called in a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What is special about it.
    pub label: String,
    /// The protocol.
    pub protocol: Protocol,
}

/// The standard table: `base` at five fields of view, then with one thing worse at a time.
pub fn standard_cases(base: &Protocol) -> Vec<Case> {
    let case = |label: &str, protocol: Protocol| Case {
        label: label.to_owned(),
        protocol,
    };
    let fields = STANDARD_FOV_DEG.map(|fov_deg| {
        let label = format!("{fov_deg}° field");
        case(&label, Protocol { fov_deg, ..*base })
    });
    let varied = Protocol {
        fov_deg: VARIED_FOV_DEG,
        ..*base
    };
    let mut cases = fields.to_vec();
    cases.extend([
        case(
            "centroids 1 px off",
            Protocol {
                centroid_sigma_px: 1.0,
                ..varied
            },
        ),
        case(
            "centroids 2 px off",
            Protocol {
                centroid_sigma_px: 2.0,
                ..varied
            },
        ),
        case(
            "magnitudes 0.5 off",
            Protocol {
                mag_sigma: 0.5,
                ..varied
            },
        ),
        case(
            "as many false stars as true",
            Protocol {
                false_stars: 1.0,
                ..varied
            },
        ),
        case(
            "field of view unknown",
            Protocol {
                scale_error: None,
                ..varied
            },
        ),
        case(
            "half as many stars",
            Protocol {
                mean_stars: base.mean_stars / 2.0,
                ..varied
            },
        ),
        case(
            "no true star at all",
            Protocol {
                missing: 1.0,
                false_stars: 1.0,
                ..varied
            },
        ),
    ]);
    cases
}

/// A parameter that can be swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
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

impl Parameter {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::FieldOfView,
        Self::Stars,
        Self::CentroidError,
        Self::MagError,
        Self::Missing,
        Self::FalseStars,
    ];

    /// What it is called as an option.
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

    /// What it is, and in which unit.
    pub const fn title(self) -> &'static str {
        match self {
            Self::FieldOfView => "horizontal field of view (°)",
            Self::Stars => "stars on a frame, on average",
            Self::CentroidError => "centroid error on each axis (px)",
            Self::MagError => "magnitude error (mag)",
            Self::Missing => "stars missing (%)",
            Self::FalseStars => "false stars (% of the true ones)",
        }
    }

    /// `protocol` with this value of the parameter.
    #[must_use]
    pub fn set(self, protocol: &Protocol, value: f64) -> Protocol {
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

/// One row of a table: the protocol and what came of it. Rates are in percent, intervals have
/// [`CONFIDENCE`](super::CONFIDENCE).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What is special about it.
    pub case: String,
    /// See [`Protocol::fov_deg`].
    pub fov_deg: f64,
    /// See [`Protocol::mean_stars`].
    pub mean_stars: f64,
    /// See [`Protocol::centroid_sigma_px`].
    pub centroid_error_px: f64,
    /// See [`Protocol::mag_sigma`].
    pub mag_error: f64,
    /// See [`Protocol::missing`].
    pub missing_percent: f64,
    /// See [`Protocol::false_stars`].
    pub false_percent: f64,
    /// See [`Protocol::scale_error`].
    pub scale_error_percent: Option<f64>,
    /// See [`Protocol::mirrored`].
    pub mirrored: Mirrored,
    /// Whether the magnitudes are given as Johnson V (else as fluxes).
    pub johnson_v: bool,
    /// True stars from which on a trial counts in the rates.
    pub least_true_stars: usize,
    /// All trials.
    pub trials: usize,
    /// Trials with enough true stars: those that follow are of these.
    pub counted: usize,
    /// Identified rightly.
    pub right: usize,
    /// Identified as what they are not.
    pub wrong: usize,
    /// Not identified.
    pub no_answer: usize,
    /// The rate of right answers.
    pub right_percent: f64,
    /// Its interval's lower end.
    pub right_low_percent: f64,
    /// Its interval's upper end.
    pub right_high_percent: f64,
    /// Wrong answers among all trials, whatever the number of stars.
    pub wrong_of_all: usize,
    /// The upper end of the interval of the rate of wrong answers among all trials.
    pub wrong_high_percent: f64,
    /// Centroids that were named.
    pub named: usize,
    /// Those of them that are another star, or none.
    pub misnamed: usize,
    /// Median time of an identification over all trials, in milliseconds.
    pub median_ms: f64,
    /// Time that 99 of 100 did not exceed, in milliseconds.
    pub p99_ms: f64,
}

impl Row {
    /// The row of `case`, of which `all` came; a trial counts in the rates from so many true stars on.
    pub fn new(case: &Case, all: &Tally, least_true_stars: usize) -> Self {
        let counted = all.with_true_stars(least_true_stars);
        let right = counted.interval(Answer::Right);
        let rate = counted.count(Answer::Right) as f64 / counted.trials().max(1) as f64;
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
            scale_error_percent: protocol.scale_error.map(percent),
            mirrored: protocol.mirrored,
            johnson_v: protocol.photometry == Photometry::JohnsonV,
            least_true_stars,
            trials: all.trials(),
            counted: counted.trials(),
            right: counted.count(Answer::Right),
            wrong: counted.count(Answer::Wrong),
            no_answer: counted.count(Answer::None),
            right_percent: percent(rate),
            right_low_percent: percent(right.low),
            right_high_percent: percent(right.high),
            wrong_of_all: all.count(Answer::Wrong),
            wrong_high_percent: percent(all.interval(Answer::Wrong).high),
            named,
            misnamed,
            median_ms: milliseconds(all.time_quantile_ms(0.5)),
            p99_ms: milliseconds(all.time_quantile_ms(0.99)),
        }
    }
}

/// A part in percent, to as many digits as a table can use.
fn percent(part: f64) -> f64 {
    (part * 1e6).round() / 1e4
}

fn milliseconds(time_ms: f64) -> f64 {
    (time_ms * 1e3).round() / 1e3
}
