//! Errors over many frames, for groups of frames.

use super::trial::{SkyTrial, TrialCellRow, TrialFrameRow};
use crate::base::format::{to_decimals, to_significant};
use crate::lab::robustness::Answers;
use crate::sky::CLEAR_MAG;
use serde::Serialize;

/// Cells with a mean extinction above this are behind clouds,
const CLOUDED_MAG: f64 = 0.5;
/// and below this are clear, where the two are told apart.
const UNCLOUDED_MAG: f64 = 0.1;
/// Parts into which probabilities are divided.
const TENTHS: usize = 10;

/// Whether a frame belongs to a group.
type Belongs = fn(&TrialFrameRow) -> bool;

/// Groups of frames by name.
const GROUPS: [(&str, Belongs); 12] = [
    ("all", |_| true),
    ("V 20 to 22", |row| row.true_zenith_mag_arcsec2 >= 20.0),
    ("V 18 to 20", |row| {
        (18.0..20.0).contains(&row.true_zenith_mag_arcsec2)
    }),
    ("brighter", |row| row.true_zenith_mag_arcsec2 < 18.0),
    ("Moon", |row| row.moon_altitude_deg > 0.0),
    ("no Moon", |row| row.moon_altitude_deg <= 0.0),
    ("clouds", |row| row.cloud_mag > 0.0),
    ("no clouds", |row| row.cloud_mag == 0.0),
    ("below 5 s", |row| row.exposure_s < 5.0),
    ("8 bits", |row| row.bits == 8),
    ("bias known", |row| row.bias_known),
    ("bias unknown", |row| !row.bias_known),
];

/// The results of many frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SkySummary {
    /// Errors in groups of frames; the first is that of all.
    pub groups: Vec<GroupRow>,
    /// Errors of cells, in groups of them.
    pub cells: Vec<CellGroup>,
    /// What the probability of a clear sky is worth.
    pub clear: Vec<ClearTenth>,
}

/// Whether a cell of a frame belongs to a group.
type CellBelongs = fn(&TrialFrameRow, &TrialCellRow) -> bool;

/// Groups of cells by name.
const CELL_GROUPS: [(&str, CellBelongs); 8] = [
    ("all", |_, _| true),
    ("10 to 20°", |_, cell| cell.altitude_deg < 20.0),
    ("20 to 40°", |_, cell| {
        (20.0..40.0).contains(&cell.altitude_deg)
    }),
    ("above 40°", |_, cell| cell.altitude_deg >= 40.0),
    ("no clouds", |frame, _| frame.cloud_mag == 0.0),
    ("10 to 20°", |frame, cell| {
        frame.cloud_mag == 0.0 && cell.altitude_deg < 20.0
    }),
    ("above 20°", |frame, cell| {
        frame.cloud_mag == 0.0 && cell.altitude_deg >= 20.0
    }),
    ("clouds", |frame, _| frame.cloud_mag > 0.0),
];

/// Errors in a group of cells, measured less true.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellGroup {
    pub group: &'static str,
    pub cells: usize,
    pub brightness_mean_mag: Option<f64>,
    pub brightness_sd_mag: Option<f64>,
    pub brightness_pull: Option<f64>,
    pub clouds_mean_mag: Option<f64>,
    pub clouds_sd_mag: Option<f64>,
    pub clouds_pull: Option<f64>,
    pub limit_mean_mag: Option<f64>,
    pub limit_sd_mag: Option<f64>,
    pub limit_pull: Option<f64>,
}

/// Errors in a group of frames, measured less true; a pull is the root mean square of errors over stated
/// errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupRow {
    pub group: &'static str,
    pub frames: usize,
    pub right: usize,
    pub wrong: usize,
    pub measured: usize,
    pub without_brightness: usize,
    pub zenith_mean_mag: Option<f64>,
    pub zenith_sd_mag: Option<f64>,
    pub zenith_pull: Option<f64>,
    pub cell_mean_mag: Option<f64>,
    pub cell_sd_mag: Option<f64>,
    pub cell_pull: Option<f64>,
    pub extinction_frames: usize,
    pub extinction_rms_mag: Option<f64>,
    pub extinction_pull: Option<f64>,
    pub limit_mean_mag: Option<f64>,
    pub limit_sd_mag: Option<f64>,
    pub cloud_share_rms: Option<f64>,
    pub cloud_share_pull: Option<f64>,
    pub clouds_area: Option<f64>,
}

/// Cells whose probability of a clear sky is in a tenth of its range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClearTenth {
    pub clear_from: f64,
    pub clear_to: f64,
    pub cells: usize,
    pub mean_clear: f64,
    pub mean_clear_low: f64,
    pub mean_clear_high: f64,
    pub share_clear: f64,
}

impl SkySummary {
    /// The results of `trials`.
    pub fn of(trials: &[SkyTrial]) -> Self {
        let rows = GROUPS.iter().map(|(group, belongs)| {
            let chosen = trials.iter().filter(|trial| belongs(&trial.frame));
            GroupRow::new(group, &chosen.collect::<Vec<_>>())
        });
        Self {
            groups: rows.collect(),
            cells: CELL_GROUPS
                .iter()
                .map(|(group, belongs)| CellGroup::of(group, trials, *belongs))
                .collect(),
            clear: (0..TENTHS)
                .filter_map(|tenth| ClearTenth::of(tenth, trials))
                .collect(),
        }
    }
}

impl GroupRow {
    fn new(group: &'static str, trials: &[&SkyTrial]) -> Self {
        let frames = || trials.iter().map(|trial| &trial.frame);
        let cells = || trials.iter().flat_map(|trial| &trial.cells);
        let count = |holds: Belongs| frames().filter(|row| holds(row)).count();
        let answers: Answers = frames().map(|row| row.status).collect();
        let zenith = ErrorSamples::of(frames().map(|row| {
            let error = row.zenith_mag_arcsec2? - row.true_zenith_mag_arcsec2;
            Some((error, row.zenith_sigma_mag?))
        }));
        let cell = ErrorSamples::of(cells().map(|row| {
            let error = row.mag_arcsec2? - row.true_mag_arcsec2;
            Some((error, row.sigma_mag?))
        }));
        let extinction = ErrorSamples::of(frames().map(|row| {
            let error = row.extinction_mag? - row.true_extinction_mag;
            Some((error, row.extinction_sigma_mag?))
        }));
        let limit = ErrorSamples::of(frames().map(|row| Some((row.limit_difference_mag?, 1.0))));
        let share = ErrorSamples::of(frames().map(|row| {
            let error = row.cloud_share? - row.true_cloud_share?;
            Some((error, row.cloud_share_sigma?))
        }));
        Self {
            group,
            frames: trials.len(),
            right: answers.right,
            wrong: answers.wrong,
            measured: count(|row| row.measured),
            without_brightness: count(|row| row.no_brightness.is_some()),
            zenith_mean_mag: zenith.mean(),
            zenith_sd_mag: zenith.sd(),
            zenith_pull: zenith.pull(),
            cell_mean_mag: cell.mean(),
            cell_sd_mag: cell.sd(),
            cell_pull: cell.pull(),
            extinction_frames: extinction.0.len(),
            extinction_rms_mag: extinction.rms(),
            extinction_pull: extinction.pull(),
            limit_mean_mag: limit.mean(),
            limit_sd_mag: limit.sd(),
            cloud_share_rms: share.rms(),
            cloud_share_pull: share.pull(),
            clouds_area: area_under_curve(cells()),
        }
    }
}

impl CellGroup {
    fn of(group: &'static str, trials: &[SkyTrial], belongs: CellBelongs) -> Self {
        let cells: Vec<&TrialCellRow> = trials
            .iter()
            .flat_map(|trial| {
                let inside = move |cell: &&TrialCellRow| belongs(&trial.frame, cell);
                trial.cells.iter().filter(inside)
            })
            .collect();
        let brightness = ErrorSamples::of(cells.iter().map(|cell| {
            let error = cell.mag_arcsec2? - cell.true_mag_arcsec2;
            Some((error, cell.sigma_mag?))
        }));
        let clouds = ErrorSamples::of(cells.iter().map(|cell| {
            let error = cell.clouds_mag? - cell.true_clouds_mag;
            Some((error, cell.clouds_sigma_mag?))
        }));
        let limit = ErrorSamples::of(cells.iter().map(|cell| {
            let error = cell.limit_vmag? - cell.true_limit_vmag?;
            Some((error, cell.limit_sigma_mag?))
        }));
        Self {
            group,
            cells: cells.len(),
            brightness_mean_mag: brightness.mean(),
            brightness_sd_mag: brightness.sd(),
            brightness_pull: brightness.pull(),
            clouds_mean_mag: clouds.mean(),
            clouds_sd_mag: clouds.sd(),
            clouds_pull: clouds.pull(),
            limit_mean_mag: limit.mean(),
            limit_sd_mag: limit.sd(),
            limit_pull: limit.pull(),
        }
    }
}

/// Errors with their stated standard errors.
struct ErrorSamples(Vec<(f64, f64)>);

impl ErrorSamples {
    fn of(errors: impl Iterator<Item = Option<(f64, f64)>>) -> Self {
        Self(errors.flatten().collect())
    }

    fn mean_of(&self, of: impl Fn(&(f64, f64)) -> f64) -> Option<f64> {
        let Self(errors) = self;
        let sum: f64 = errors.iter().map(of).sum();
        (!errors.is_empty()).then(|| sum / errors.len() as f64)
    }

    fn mean(&self) -> Option<f64> {
        self.mean_of(|(error, _)| *error).map(rounded)
    }

    fn sd(&self) -> Option<f64> {
        let mean = self.mean_of(|(error, _)| *error)?;
        self.mean_of(|(error, _)| (error - mean).powi(2))
            .map(|square| rounded(square.sqrt()))
    }

    fn rms(&self) -> Option<f64> {
        self.mean_of(|(error, _)| error * error)
            .map(|square| rounded(square.sqrt()))
    }

    fn pull(&self) -> Option<f64> {
        self.mean_of(|(error, sigma)| (error / sigma).powi(2))
            .map(|square| to_significant(square.sqrt(), 3))
    }
}

fn rounded(mag: f64) -> f64 {
    to_decimals(mag, 4)
}

/// The area under the curve of true over false positives; `None` without cells of both kinds.
fn area_under_curve<'a>(cells: impl Iterator<Item = &'a TrialCellRow>) -> Option<f64> {
    let ranked = cells.filter_map(|cell| {
        let is_clouded = cell.true_clouds_mag > CLOUDED_MAG;
        let is_either = is_clouded || cell.true_clouds_mag < UNCLOUDED_MAG;
        Some((1.0 - cell.clear?, is_clouded)).filter(|_| is_either)
    });
    let mut ranked: Vec<(f64, bool)> = ranked.collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let clouded = ranked.iter().filter(|(_, is_clouded)| *is_clouded).count() as f64;
    let pairs = clouded * (ranked.len() as f64 - clouded);
    let (mut below, mut right_pairs) = (0.0, 0.0);
    // Of equal probabilities half of the pairs count.
    for equal in ranked.chunk_by(|a, b| a.0 == b.0) {
        let here = equal.iter().filter(|(_, is_clouded)| *is_clouded).count() as f64;
        let others = equal.len() as f64 - here;
        right_pairs += here * (below + 0.5 * others);
        below += others;
    }
    (pairs > 0.0).then(|| rounded(right_pairs / pairs))
}

impl ClearTenth {
    fn of(tenth: usize, trials: &[SkyTrial]) -> Option<Self> {
        let cells = trials.iter().flat_map(|trial| &trial.cells);
        let ranked = cells.filter_map(|cell| Some((cell.clear?, cell)));
        let is_inside = |(clear, _): &(f64, &TrialCellRow)| {
            ((clear * TENTHS as f64) as usize).min(TENTHS - 1) == tenth
        };
        let inside: Vec<(f64, &TrialCellRow)> = ranked.filter(is_inside).collect();
        let cells = inside.len();
        let mean = |of: &dyn Fn(f64, &TrialCellRow) -> f64| {
            let sum: f64 = inside.iter().map(|(clear, cell)| of(*clear, cell)).sum();
            rounded(sum / cells as f64)
        };
        let edge = |tenth: usize| tenth as f64 / TENTHS as f64;
        (cells > 0).then(|| Self {
            clear_from: edge(tenth),
            clear_to: edge(tenth + 1),
            cells,
            mean_clear: mean(&|clear, _| clear),
            mean_clear_low: mean(&|clear, cell| cell.clear_low.unwrap_or(clear)),
            mean_clear_high: mean(&|clear, cell| cell.clear_high.unwrap_or(clear)),
            share_clear: mean(&|_, cell| f64::from(cell.true_clouds_mag < CLEAR_MAG)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(clear: f64, true_clouds_mag: f64) -> TrialCellRow {
        TrialCellRow {
            frame: 0,
            altitude_deg: 45.0,
            azimuth_deg: 0.0,
            true_mag_arcsec2: 20.0,
            mag_arcsec2: None,
            sigma_mag: None,
            true_clouds_mag,
            clouds_mag: None,
            clouds_sigma_mag: None,
            clear: Some(clear),
            clear_low: Some(clear),
            clear_high: Some(clear),
            true_limit_vmag: None,
            limit_vmag: None,
            limit_sigma_mag: None,
            limit_difference_mag: None,
        }
    }

    #[test]
    fn the_area_is_the_share_of_pairs_in_the_right_order() {
        // 0.3 mag is neither behind clouds nor clear.
        let cells = [(0.9, 0.0), (0.5, 0.0), (0.7, 1.0), (0.1, 2.0), (0.0, 0.3)];
        let cells = cells.map(|(clear, mag)| cell(clear, mag));
        assert_eq!(area_under_curve(cells.iter()), Some(0.75));
        let equal = [cell(0.5, 0.0), cell(0.5, 1.0)];
        assert_eq!(area_under_curve(equal.iter()), Some(0.5));
        assert_eq!(area_under_curve(equal[..1].iter()), None);
    }

    #[test]
    fn pulls_are_errors_over_stated_errors() {
        let errors = ErrorSamples::of([Some((0.03, 0.01)), None, Some((-0.01, 0.01))].into_iter());
        assert_eq!(errors.mean(), Some(0.01));
        assert_eq!(errors.sd(), Some(0.02));
        assert_eq!(errors.pull(), Some(2.24));
        assert_eq!(ErrorSamples(Vec::new()).rms(), None);
    }
}
